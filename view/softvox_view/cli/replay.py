"""softvox replay: designs in motion, as a page, a film or a picture."""

from __future__ import annotations

import math
import sys
from argparse import Namespace
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.cli.parser import add_physics, add_threads, number, physics_of, whole_number
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import Design
from softvox_gym.files import check_file, write_file
from softvox_gym.lattice import Lattice
from softvox_gym.missing import missing
from softvox_gym.physics import Physics
from softvox_gym.progress import Progress
from softvox_gym.rendering import png
from softvox_gym.simulation import Result, simulate
from softvox_view import encode, replay
from softvox_view.replay.data import bytes_per_frame, frames_of, label, short_label

DESCRIPTION = """\
Show designs in motion, side by side. What FILE ends in says how:

  .html  a page with the robots in 3-D: one file, for any browser, offline;
         orbit, zoom, play, scrub, follow (needs WebGL 2)
  .gif   a film that repeats (needs Pillow)
  .mp4   a film (needs imageio-ffmpeg)
  .png   a picture of the last moment (needs Pillow)

Beside each robot stand its number, digits and fitness, the distance that its
centre of mass travels in this run, in voxel widths.
"""

USAGE = "softvox replay DESIGN [DESIGN ...] [--out FILE] [--cycles N] [--fps N] [options]"

#: The modules that the kinds of output need beyond softvox-gym's own.
NEEDS = {".html": (), ".gif": ("PIL",), ".mp4": ("PIL", "imageio_ffmpeg"), ".png": ("PIL",)}

MOST_DESIGNS = 16
MOST_CYCLES = 1e5  # a day of pumping; what is made of it is limited besides
PER_CYCLE = 24  # frames of a page, where they fit
FEWEST_PER_CYCLE = 6  # with fewer the pumping can't be seen
MOST_BYTES = 400_000  # of a page's recording, so that the page stays well under a megabyte
MOST_PICTURES = 6000  # of a film
MOST_GIF_BYTES = 2**29  # of its pictures, which are all in memory at once
FPS = 25.0  # of a film
WIDTH = 480  # pixels of a robot's picture in a film
WIDTHS = (120, 1920)
LONGEST_NAME = 60


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "replay",
        help="show designs in motion: a page in 3-D, a film or a picture",
        description=DESCRIPTION,
        usage=USAGE,
    )
    parser.add_argument("designs", metavar="DESIGN", nargs="+", help="a number or digits")
    parser.add_argument(
        "--shape",
        type=whole_number,
        nargs=3,
        default=(2, 2, 2),
        metavar=("NX", "NY", "NZ"),
        help="the lattice (default: 2 2 2)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="default: replay-DESIGN.html in this folder"
    )
    parser.add_argument(
        "--cycles", type=number, metavar="N", help="of actuation (default: what --duration gives)"
    )
    parser.add_argument(
        "--fps",
        type=number,
        metavar="N",
        help=f"pictures per second of a film (default: {FPS:g}; a .gif has at most 50), or frames "
        f"that a page keeps per second of the run (default: {PER_CYCLE} per cycle, fewer where the "
        "page would be large)",
    )
    parser.add_argument(
        "--speed",
        type=number,
        default=replay.SPEED,
        metavar="X",
        help=f"1 is real time (default: {replay.SPEED:g}); a page begins with it",
    )
    parser.add_argument(
        "--width",
        type=whole_number,
        metavar="N",
        help=f"pixels of each robot's picture in a film or .png (default: {WIDTH})",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    add_threads(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, simulate, draw, write."""
    if len(args.designs) > MOST_DESIGNS:
        raise BadInputError(
            f"{len(args.designs)} designs were given, and at most {MOST_DESIGNS} are shown side by "
            "side; give fewer"
        )
    designs = [design_of(text, tuple(args.shape)) for text in args.designs]
    physics = _physics(args)
    args.out = args.out or Path(f"replay-{_name(designs)}.html")
    kind = args.out.suffix.lower()
    _check(kind, args)
    with bad_input("--out"):
        check_file(args.out, force=args.force)
    every, made = {
        ".html": (_page_every, _page),
        ".png": (_picture_every, _picture),
        ".gif": (_film_every, _film),
        ".mp4": (_film_every, _film),
    }[kind]
    with bad_input():
        frames = every(args, physics, designs)
        result = simulate(designs, physics, frames=frames, threads=args.threads)
    content = made(args, result)
    with bad_input("--out"):
        write_file(args.out, content, force=args.force)
    size = f"{len(content) / 1e6:.1f} MB" if len(content) >= 1e6 else f"{len(content) / 1e3:.0f} kB"
    labels = ", ".join(label(result, i) for i in range(len(result)))
    print(f"wrote {args.out}: {size}, {labels}")
    return 0


def _physics(args: Namespace) -> Physics:
    if args.cycles is None:
        return physics_of(args)
    if args.duration is not None:
        raise BadInputError("--cycles and --duration both say how long the run is; give one")
    # A long settling needs a long duration, which the cycles then replace.
    if args.settle_time is not None and math.isfinite(args.settle_time):
        args = Namespace(**{**vars(args), "duration": args.settle_time + 1.0})
    physics = physics_of(args)
    if not 0 < args.cycles <= MOST_CYCLES:
        raise BadInputError(
            f"--cycles must be a positive number up to {MOST_CYCLES:g}, got {args.cycles:g}"
        )
    with bad_input():
        return physics.lasting(args.cycles)


def _name(designs: list[Design]) -> str:
    """Return what the designs are called in a file's name."""
    names = [str(d.index) if d.lattice == Lattice() else d.digits for d in designs]
    return "-".join(names)[:LONGEST_NAME].rstrip("-")


def _check(kind: str, args: Namespace) -> None:
    """Make sure that the output is one that can be made, its rates good and its libraries there."""
    if kind not in NEEDS:
        raise BadInputError(
            f"--out must end in {', '.join(NEEDS)}, which says what to make; got {str(args.out)!r}"
        )
    for option, value in (("--fps", args.fps), ("--speed", args.speed)):
        if value is not None and not 0.01 <= value <= 1000:
            raise BadInputError(f"{option} must be from 0.01 to 1000, got {value:g}")
    if kind == ".png" and args.fps is not None:
        raise BadInputError("--fps is for films and pages; a .png shows one moment")
    if kind == ".html" and args.width is not None:
        raise BadInputError("--width is for films and .png; a page is as wide as its window")
    if args.width is not None and not WIDTHS[0] <= args.width <= WIDTHS[1]:
        raise BadInputError(f"--width must be from {WIDTHS[0]} to {WIDTHS[1]}, got {args.width}")
    absent = [module for module in NEEDS[kind] if find_spec(module) is None]
    if absent:
        error = ModuleNotFoundError(name=absent[0])
        raise BadInputError(missing(f"a {kind}", error, absent) + ", or make a .html")


def _page_every(args: Namespace, physics: Physics, designs: list[Design]) -> int:
    """Return the steps from frame to frame of a page."""
    size = bytes_per_frame(designs)
    seconds = float(physics.duration)
    most = MOST_BYTES / size / seconds  # frames per second
    frequency = float(physics.frequency_hz)
    fps = args.fps or min(PER_CYCLE * frequency, most)
    if fps > most or (args.fps is None and fps < FEWEST_PER_CYCLE * frequency):
        needed = (args.fps or FEWEST_PER_CYCLE * frequency) * seconds * size
        raise BadInputError(
            f"the page would hold {needed / 1e6:.3g} MB of movement, and at most "
            f"{MOST_BYTES / 1e6:g} MB are put into one; give fewer designs, less time (--cycles) "
            "or a lower --fps"
        )
    return max(1, round(1 / fps / float(physics.time_step)))


def _film_every(args: Namespace, physics: Physics, designs: list[Design]) -> int:
    """Return the steps from picture to picture of a film."""
    pictures = (float(physics.duration) - physics.settle_time) / args.speed * _film_fps(args)
    if pictures > MOST_PICTURES:
        raise BadInputError(
            f"the film would have {pictures:.0f} pictures, and at most {MOST_PICTURES} are made; "
            "give less time (--cycles), a higher --speed or a lower --fps"
        )
    width, height = _panel(args)
    size = pictures * len(designs) * width * height
    if args.out.suffix.lower() == ".gif" and size > MOST_GIF_BYTES:
        raise BadInputError(
            f"the .gif would need {size / 2**30:.2g} GiB of memory, and at most "
            f"{MOST_GIF_BYTES / 2**30:g} GiB are used; give a lower --width, less time (--cycles), "
            "a lower --fps, or make an .mp4"
        )
    return max(1, int(args.speed / _film_fps(args) / float(physics.time_step)))


def _picture_every(args: Namespace, physics: Physics, designs: list[Design]) -> int:
    """Return the steps to the end of the run."""
    return max(1, int(float(physics.duration) / float(physics.time_step)) - 1)


def _panel(args: Namespace) -> tuple[int, int]:
    """Return the size of each robot's picture; even, as films must be."""
    width = (args.width or WIDTH) // 2 * 2
    return width, round(width * 3 / 8) * 2


def _film_fps(args: Namespace) -> float:
    wish: float = args.fps or FPS
    return encode.gif_fps(wish) if args.out.suffix.lower() == ".gif" else wish


def _page(args: Namespace, result: Result) -> bytes:
    recording = replay.recording(result)
    return replay.page(recording, replay.still(result), speed=args.speed).encode()


def _picture(args: Namespace, result: Result) -> bytes:
    return png(_drawing(args, result)(len(frames_of(result).step) - 1))


def _film(args: Namespace, result: Result) -> bytes:
    make = encode.gif if args.out.suffix.lower() == ".gif" else encode.mp4
    shown, draw = _shown(args, result), _drawing(args, result)
    with Progress(sys.stderr, unit="pictures") as progress:
        try:
            return make(
                lambda k: draw(shown[k]), len(shown), fps=_film_fps(args), progress=progress
            )
        except (OSError, RuntimeError) as error:  # RuntimeError: there is no ffmpeg
            raise BadInputError(
                f"the film can't be encoded: {error}; try a .gif or a .html"
            ) from error


def _shown(args: Namespace, result: Result) -> list[int]:
    """Return the frames that a film shows, from the start of actuation: one for each picture.

    A picture need not last a whole number of time steps, so the frame nearest to it is taken, twice
    where the film is slower than the simulation.
    """
    time, begin = frames_of(result).time[0], result.physics.settle_time
    seconds = args.speed / _film_fps(args)
    pictures = int((float(result.physics.duration) - begin) / seconds) + 1
    middles = (time[1:] + time[:-1]) / 2
    shown: list[int] = np.searchsorted(middles, begin + seconds * np.arange(pictures)).tolist()
    return shown


def _drawing(args: Namespace, result: Result) -> Callable[[int], NDArray[np.uint8]]:
    """Return what draws a frame, with captions."""
    panel = _panel(args)
    captions = [(label(result, i), short_label(result, i)) for i in range(len(result))]
    return lambda k: encode.captioned(replay.still(result, frame=k, panel=panel), captions, panel)
