"""softvox replay: designs in motion, as a page, a film or a picture."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.cli.landscape import ranking
from softvox_gym.cli.parser import (
    add_physics,
    add_several,
    add_shape,
    add_threads,
    named,
    number,
    physics_of,
    whole_number,
    world_of,
)
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import Design
from softvox_gym.engine import step_count
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.landscapes.table import landscape
from softvox_gym.lattice import Lattice
from softvox_gym.missing import missing
from softvox_gym.motion import frames_of
from softvox_gym.physics import Physics
from softvox_gym.progress import Progress
from softvox_gym.realities import Reality
from softvox_gym.rendering import png
from softvox_gym.simulation import Result, simulate, spaced
from softvox_view import encode, replay
from softvox_view.replay.data import bytes_per_frame, frames_at, labels
from softvox_view.replay.still import Panels, panel_for

DESCRIPTION = """\
Show designs in motion, side by side. The ending of FILE sets the format:

  .html  a page with the robots in 3-D: one file, for any browser, offline;
         orbit, zoom, play, scrub, follow (needs WebGL 2)
  .gif   a film that repeats (needs Pillow and imageio-ffmpeg)
  .mp4   a film (needs the same)
  .png   a picture of the last moment (needs Pillow)
  .glb   the voxels and their movement, for 3-D programs (glTF)

Robots are seen from the side and go to the right. Each is shown with its
number, its digits, its fitness (the distance that its centre of mass travels in
this run, in voxel widths), a ghost at its start, its path, and a ruler.
"""

USAGE = """\
softvox replay DESIGN ... [--out FILE] [--versus WORLD] [options]
       softvox replay --top N [--out FILE] [options]"""

#: The modules beyond softvox-gym's own that the kinds of output need.
FILM = ("PIL", "imageio_ffmpeg")
NEEDS = {".html": (), ".gif": FILM, ".mp4": FILM, ".png": ("PIL",), ".glb": ()}
RECORDED = (".html", ".glb")

MOST_DESIGNS = 16
MOST_WORLDS = 4
MOST_OF_TOP = 200
LAP = 12  # frames per cycle of a page of --top
PER_CYCLE = 24  # frames of a page, if they fit
FEWEST_PER_CYCLE = 6  # with fewer the pumping is invisible
MOST_BYTES = 400_000  # of a page's recording, so that the page stays well under a megabyte
MOST_PICTURES = 6000  # of a film
MOST_FRAMES = 20_000  # simulated for a film, unless its pictures are closer
MOST_GIF_BYTES = 2**30  # of a GIF's pictures, which ffmpeg holds in memory all at once
FPS = 25.0  # of a film
FASTEST_GIF = 50.0  # browsers slow down faster ones
WIDTH = 480  # pixels of a robot's picture in a film
LONGEST_NAME = 60


def within(low: float, high: float, read: Callable[[str], float] = number) -> Callable[[str], Any]:
    """Return a parser for an option's number that checks its bounds."""

    def checked(text: str) -> float:
        value = read(text)
        if not low <= value <= high:
            raise ArgumentTypeError(f"must be from {low:g} to {high:g}, got {value:g}")
        return value

    return checked


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "replay",
        help="show designs in motion: a page in 3-D, a film or a picture",
        description=DESCRIPTION,
        usage=USAGE,
    )
    parser.add_argument("designs", metavar="DESIGN", nargs="*", help="a number, digits or a file")
    parser.add_argument(
        "--top",
        type=within(1, MOST_OF_TOP, whole_number),
        metavar="N",
        help="show the fittest N instead, only the best of robots that are equal when turned or "
        "mirrored, on a page on which each repeats its last cycle",
    )
    add_several(
        parser,
        "--versus",
        "WORLD",
        "also show each design in this world, in the same scene: reality=NAME (of softvox "
        "reality --list), or parameters as gravity=-1.62,strain=0.1",
        kind=str,
    )
    parser.add_argument(
        "--boxes",
        action="store_true",
        help="draw each voxel as a cube, as in the model (default: neighbours share corners)",
    )
    add_shape(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="file to write (default: replay-DESIGN.html in this folder)",
    )
    parser.add_argument(
        "--cycles",
        type=within(0.001, 1e5),  # a day of pumping
        metavar="N",
        help="cycles of actuation (default: those of --duration)",
    )
    parser.add_argument(
        "--fps",
        type=within(0.01, 1000),
        metavar="N",
        help=f"pictures per second of a film (default: {FPS:g}; at most 50 in a .gif), or frames "
        f"in a page per second of the run (default: {PER_CYCLE} per cycle, fewer if the page would "
        "be large)",
    )
    parser.add_argument(
        "--speed",
        type=within(0.01, 1000),
        default=replay.SPEED,
        metavar="X",
        help=f"speed of the replay, 1 for real time (default: {replay.SPEED:g})",
    )
    parser.add_argument(
        "--width",
        type=within(120, 1920, whole_number),
        metavar="N",
        help=f"width of each robot's picture in a film or .png, pixels (default: {WIDTH})",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    add_threads(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, simulate, draw, write."""
    if bool(args.designs) == bool(args.top):
        raise BadInputError("give either designs or --top N")
    if len(args.designs) > MOST_DESIGNS:
        raise BadInputError(
            f"{len(args.designs)} designs were given, and at most {MOST_DESIGNS} are shown side by "
            "side; give fewer"
        )
    shape = tuple(args.shape)
    designs = [design_of(text, shape, args.phases) for text in args.designs]
    physics = _physics(args)
    worlds = _worlds(args, physics)
    names = [str(d.index) if d.lattice == Lattice() else d.digits for d in designs]
    names = names or [f"top-{args.top}"]
    args.out = args.out or Path(f"replay-{'-'.join(names)[:LONGEST_NAME].rstrip('-')}.html")
    args.kind = args.out.suffix.lower()
    _check(args)
    with bad_input("--out"):
        check_file(args.out, force=args.force)
    if args.top:
        with bad_input():
            content, shown = _gallery(args, physics)
    else:
        every = _every(args, list(worlds.values()), designs)
        with bad_input():
            results = {
                name: _seen(world.simulate(designs, frames=steps, threads=args.threads), world)
                for (name, world), steps in zip(worlds.items(), every, strict=True)
            }
        content = _made(args, results)
        shown = ", ".join(label for i in range(len(designs)) for label, _ in _labels(results, i))
    with bad_input("--out"):
        write_file(args.out, content, force=args.force)
    size = f"{len(content) / 1e6:.1f} MB" if len(content) >= 1e6 else f"{len(content) / 1e3:.0f} kB"
    print(f"wrote {args.out}: {size}, {shown}")
    return 0


def _labels(results: Mapping[str, Result], i: int) -> list[tuple[str, str]]:
    """Return the labels of a design's robots, one for each world."""
    first, *others = results.values()
    named = [(name if others else "", result) for name, result in results.items()]
    return [labels(result, i, world=name, design=first.design(i)) for name, result in named]


def _worlds(args: Namespace, physics: Physics) -> dict[str, Reality]:
    """Return the worlds to show designs in, by name: that of the options, then each --versus."""
    if args.top and args.versus:
        raise BadInputError("--versus can't be combined with --top; give designs instead")
    if len(args.versus) >= MOST_WORLDS:
        raise BadInputError(f"--versus takes at most {MOST_WORLDS - 1} worlds; give fewer")
    worlds = {named(physics, args.physics): Reality.of(physics)}
    for text in args.versus:
        with bad_input("--versus"):
            name, world = world_of(text, physics)
        if name in worlds:
            raise BadInputError(f"--versus {text}: that world is shown already; give another")
        if args.cycles is not None:
            world = replace(world, physics=world.physics.lasting(args.cycles))
        worlds[name] = world
    return worlds


def _seen(result: Result, world: Reality) -> Result:
    """Return a result whose frames are in voxel widths, even if voxels consist of parts."""
    if world.resolution == 1 or result.frames is None:
        return result
    position, edge = (
        values / world.resolution for values in (result.frames.position, result.frames.edge)
    )
    return replace(result, frames=replace(result.frames, position=position, edge=edge))


def _made(args: Namespace, results: Mapping[str, Result]) -> bytes:
    """Return the content of the file."""
    first, *others = results.values()
    if args.kind == ".glb":
        return replay.glb(replay.versus(results) if others else replay.recording(first))
    scenes = [[(result, i) for result in results.values()] for i in range(len(first))]
    panel = panel_for(len(scenes)) if args.kind == ".html" else args.panel
    panels = Panels(scenes, panel=panel, boxes=args.boxes)
    if args.kind == ".html":
        recording = replay.versus(results) if others else replay.recording(first)
        last = panels.picture(lambda result: len(frames_of(result).step) - 1)
        return replay.page(recording, last, speed=args.speed, boxes=args.boxes).encode()
    if args.kind == ".png":
        return png(_drawn(args, panels, results, math.inf))
    return _film(args, panels, results)


def _gallery(args: Namespace, physics: Physics) -> tuple[bytes, str]:
    """Return a page with the fittest of every symmetry class, and a description of it."""
    table, classes = landscape(physics), symmetry_classes()
    order = ranking(table)["design"]
    if not len(order):
        raise BadInputError("--top: all designs diverge under this physics; give another")
    _, first = np.unique(classes[order], return_index=True)
    designs = order[np.sort(first)[: args.top]]
    every = max(1, round(1 / (LAP * float(physics.frequency_hz) * float(physics.time_step))))
    result = simulate(designs, physics, frames=every, threads=args.threads)
    recording = replay.lap(result)
    for rank, robot in enumerate(recording["robots"]):
        robot["short_label"] = f"{rank + 1} · {robot['short_label']}"
    title = f"The fittest {len(designs)} robots, one of each symmetry class"
    few = range(min(len(designs), 12))
    page = replay.page(
        recording, replay.still(result, *few), title=title, speed=args.speed, gallery=True
    )
    return page.encode(), f"{len(designs)} robots, {result.fitness[0]:.2f} and less"


def _physics(args: Namespace) -> Physics:
    if args.cycles is None:
        return physics_of(args)
    if args.duration is not None:
        raise BadInputError("--cycles and --duration both say how long the run is; give one")
    # A long settling needs a long duration, which the cycles then replace.
    if args.settle_time is not None and math.isfinite(args.settle_time):
        args.duration = args.settle_time + 1.0
    return physics_of(args).lasting(args.cycles)


def _check(args: Namespace) -> None:
    """Check that the output can be made, with its options and libraries."""
    if args.kind not in NEEDS:
        raise BadInputError(
            f"--out must end in {', '.join(NEEDS)}, which says what to make; got {str(args.out)!r}"
        )
    if args.top and args.kind != ".html":
        raise BadInputError(f"--top makes a page; --out must end in .html, not {args.kind}")
    if args.top and (args.fps or args.boxes):
        raise BadInputError(f"--fps and --boxes are not for --top; the page shows {LAP} a cycle")
    if args.top and args.phases > 1:
        raise BadInputError("--phases is not for --top, whose landscape is that of one phase")
    if args.top and tuple(args.shape) != Lattice():
        raise BadInputError("--shape is not for --top, whose landscape is that of 2 2 2")
    if args.kind == ".png" and args.fps is not None:
        raise BadInputError("--fps is for films and pages; a .png shows one moment")
    if args.kind in RECORDED and args.width is not None:
        raise BadInputError("--width is for films and .png")
    if args.kind == ".glb" and args.boxes:
        raise BadInputError("--boxes is for pictures; a .glb always has boxes")
    if absent := [module for module in NEEDS[args.kind] if find_spec(module) is None]:
        error = ModuleNotFoundError(name=absent[0])
        raise BadInputError(missing(f"a {args.kind}", error, absent) + ", or make a .html")
    width = (args.width or WIDTH) // 2 * 2
    args.panel = width, round(width * 3 / 8) * 2  # even, as films must be
    if args.kind not in RECORDED:
        args.fps = min(args.fps or FPS, FASTEST_GIF if args.kind == ".gif" else math.inf)


def _every(args: Namespace, worlds: Sequence[Reality], designs: list[Design]) -> list[int]:
    """Return the steps between frames; check that the output is not too large.

    One number per world; worlds with different time steps get nearly the same interval.
    """
    physics = [world.of_parts(world.physics) for world in worlds]
    steps = [float(one.time_step) for one in physics]
    seconds = max(float(one.duration) for one in physics)
    frequency = max(float(one.frequency_hz) for one in physics)
    if args.kind == ".png":
        runs = [step_count(float(one.time_step), float(one.duration)) for one in physics]
        return [spaced(steps, math.ceil(PER_CYCLE * frequency * seconds)) for steps in runs]
    if args.kind in RECORDED:
        size = sum(world.resolution**3 * bytes_per_frame(designs) for world in worlds)
        most = MOST_BYTES / size / seconds  # frames per second
        needed = args.fps or FEWEST_PER_CYCLE * frequency
        if needed > most:
            raise BadInputError(
                f"{args.out} would hold {needed * seconds * size / 1e6:.3g} MB of movement, and at "
                f"most {MOST_BYTES / 1e6:g} MB are put into a file; give fewer designs, less time "
                "(--cycles) or a lower --fps"
            )
        fps = args.fps or min(PER_CYCLE * frequency, most)
        return [max(1, round(1 / fps / step)) for step in steps]
    pumped = max(float(one.duration) - one.settle_time for one in physics)
    pictures = pumped / args.speed * args.fps
    if pictures > MOST_PICTURES:
        raise BadInputError(
            f"the film would have {pictures:.0f} pictures, and at most {MOST_PICTURES} are made; "
            "give less time (--cycles), a higher --speed or a lower --fps"
        )
    size = 4 * pictures * len(designs) * math.prod(args.panel)
    if args.kind == ".gif" and size > MOST_GIF_BYTES:
        raise BadInputError(
            f"the .gif would need {size / 2**30:.2g} GiB of memory, and at most "
            f"{MOST_GIF_BYTES / 2**30:g} GiB are used; give a lower --width, less time (--cycles), "
            "a lower --fps, or make an .mp4"
        )
    # Finer than the pictures, to come close to each one's moment and to the start of the pump.
    fine = max(1 / (4 * PER_CYCLE * frequency), seconds / MOST_FRAMES)
    return [max(1, int(min(args.speed / args.fps, fine) / step)) for step in steps]


def _film(args: Namespace, panels: Panels, results: Mapping[str, Result]) -> bytes:
    """Return a film from the start of actuation, each picture the frame nearest to its moment.

    A picture need not last a whole number of time steps. If the film is slower than the simulation,
    frames are repeated.
    """
    seconds = args.speed / args.fps
    all_of_them = results.values()
    pumped = max(float(r.physics.duration) - r.physics.settle_time for r in all_of_them)
    moments = seconds * np.arange(int(pumped / seconds) + 1)

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for k, moment in enumerate(moments.tolist()):
            yield _drawn(args, panels, results, moment)
            progress(k + 1, len(moments))

    height, width, _ = _drawn(args, panels, results, 0.0).shape
    with Progress(sys.stderr, unit="pictures") as progress:
        try:
            return encode.film(args.kind, pictures(), (width, height), args.fps)
        except (OSError, RuntimeError) as error:  # RuntimeError: there is no ffmpeg
            raise BadInputError(f"the film can't be encoded: {error}; try a .html") from error


def _drawn(
    args: Namespace, panels: Panels, results: Mapping[str, Result], moment: float
) -> NDArray[np.uint8]:
    """Return the picture of a moment, s from the start of the pump, with captions."""
    picture = panels.picture(lambda result: int(frames_at(result, np.array([moment]))[0]))
    captions = []
    for i, stage in enumerate(panels.stages):
        walks = zip(range(len(stage.walks)), results, strict=False)  # none without voxels
        signs = [(*stage.sign(k), name) for k, name in walks]
        lines = _labels(results, i)
        captions.append(encode.Caption(lines, signs if len(results) > 1 else []))
    return encode.captioned(picture, captions, args.panel)
