"""softvox replay: designs in motion, as a page, a film or a picture."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Iterator
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
from softvox_view.replay.data import bytes_per_frame, frames_of, labels

DESCRIPTION = """\
Show designs in motion, side by side. What FILE ends in says how:

  .html  a page with the robots in 3-D: one file, for any browser, offline;
         orbit, zoom, play, scrub, follow (needs WebGL 2)
  .gif   a film that repeats (needs Pillow and imageio-ffmpeg)
  .mp4   a film (needs the same)
  .png   a picture of the last moment (needs Pillow)

Beside each robot stand its number, digits and fitness, the distance that its
centre of mass travels in this run, in voxel widths.
"""

USAGE = "softvox replay DESIGN [DESIGN ...] [--out FILE] [--cycles N] [--fps N] [options]"

#: The modules that the kinds of output need beyond softvox-gym's own.
FILM = ("PIL", "imageio_ffmpeg")
NEEDS = {".html": (), ".gif": FILM, ".mp4": FILM, ".png": ("PIL",)}

MOST_DESIGNS = 16
PER_CYCLE = 24  # frames of a page, where they fit
FEWEST_PER_CYCLE = 6  # with fewer the pumping can't be seen
MOST_BYTES = 400_000  # of a page's recording, so that the page stays well under a megabyte
MOST_PICTURES = 6000  # of a film
MOST_GIF_BYTES = 2**30  # of its pictures, which ffmpeg has all in memory at once
FPS = 25.0  # of a film
FASTEST_GIF = 50.0  # browsers slow faster ones down
WIDTH = 480  # pixels of a robot's picture in a film
LONGEST_NAME = 60


def within(low: float, high: float, read: Callable[[str], float] = number) -> Callable[[str], Any]:
    """Return what reads an option's number and makes sure that it is in bounds."""

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
        "--cycles",
        type=within(0.001, 1e5),  # a day of pumping
        metavar="N",
        help="of actuation (default: what --duration gives)",
    )
    parser.add_argument(
        "--fps",
        type=within(0.01, 1000),
        metavar="N",
        help=f"pictures per second of a film (default: {FPS:g}; a .gif has at most 50), or frames "
        f"that a page keeps per second of the run (default: {PER_CYCLE} per cycle, fewer where the "
        "page would be large)",
    )
    parser.add_argument(
        "--speed",
        type=within(0.01, 1000),
        default=replay.SPEED,
        metavar="X",
        help=f"1 is real time (default: {replay.SPEED:g}); a page begins with it",
    )
    parser.add_argument(
        "--width",
        type=within(120, 1920, whole_number),
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
    names = [str(d.index) if d.lattice == Lattice() else d.digits for d in designs]
    args.out = args.out or Path(f"replay-{'-'.join(names)[:LONGEST_NAME].rstrip('-')}.html")
    args.kind = args.out.suffix.lower()
    _check(args)
    with bad_input("--out"):
        check_file(args.out, force=args.force)
    every = _every(args, physics, designs)
    with bad_input():
        result = simulate(designs, physics, frames=every, threads=args.threads)
    if args.kind == ".html":
        recording = replay.recording(result)
        content = replay.page(recording, replay.still(result), speed=args.speed).encode()
    elif args.kind == ".png":
        content = png(_drawn(args, result, len(frames_of(result).step) - 1))
    else:
        content = _film(args, result)
    with bad_input("--out"):
        write_file(args.out, content, force=args.force)
    size = f"{len(content) / 1e6:.1f} MB" if len(content) >= 1e6 else f"{len(content) / 1e3:.0f} kB"
    shown = ", ".join(labels(result, i)[0] for i in range(len(result)))
    print(f"wrote {args.out}: {size}, {shown}")
    return 0


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
    """Make sure that the output is one that can be made, with its options and libraries."""
    if args.kind not in NEEDS:
        raise BadInputError(
            f"--out must end in {', '.join(NEEDS)}, which says what to make; got {str(args.out)!r}"
        )
    if args.kind == ".png" and args.fps is not None:
        raise BadInputError("--fps is for films and pages; a .png shows one moment")
    if args.kind == ".html" and args.width is not None:
        raise BadInputError("--width is for films and .png; a page is as wide as its window")
    if absent := [module for module in NEEDS[args.kind] if find_spec(module) is None]:
        error = ModuleNotFoundError(name=absent[0])
        raise BadInputError(missing(f"a {args.kind}", error, absent) + ", or make a .html")
    width = (args.width or WIDTH) // 2 * 2
    args.panel = width, round(width * 3 / 8) * 2  # even, as films must be
    if args.kind != ".html":
        args.fps = min(args.fps or FPS, FASTEST_GIF if args.kind == ".gif" else math.inf)


def _every(args: Namespace, physics: Physics, designs: list[Design]) -> int:
    """Return the steps from frame to frame, and make sure that what is asked for has room."""
    seconds, frequency = float(physics.duration), float(physics.frequency_hz)
    if args.kind == ".png":  # from the first to the last
        return max(1, int(seconds / float(physics.time_step)) - 1)
    if args.kind == ".html":
        size = bytes_per_frame(designs)
        most = MOST_BYTES / size / seconds  # frames per second
        needed = args.fps or FEWEST_PER_CYCLE * frequency
        if needed > most:
            raise BadInputError(
                f"the page would hold {needed * seconds * size / 1e6:.3g} MB of movement, and at "
                f"most {MOST_BYTES / 1e6:g} MB are put into one; give fewer designs, less time "
                "(--cycles) or a lower --fps"
            )
        fps = args.fps or min(PER_CYCLE * frequency, most)
        return max(1, round(1 / fps / float(physics.time_step)))
    pictures = (seconds - physics.settle_time) / args.speed * args.fps
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
    return max(1, int(args.speed / args.fps / float(physics.time_step)))


def _film(args: Namespace, result: Result) -> bytes:
    """Return a film from the start of actuation, each picture the frame nearest to its moment.

    A picture need not last a whole number of time steps; where the film is slower than the
    simulation, a frame is taken twice.
    """
    time, begin = frames_of(result).time[0], result.physics.settle_time
    seconds = args.speed / args.fps
    count = int((float(result.physics.duration) - begin) / seconds) + 1
    moments = begin + seconds * np.arange(count)
    shown = np.searchsorted((time[1:] + time[:-1]) / 2, moments).tolist()

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for k, frame in enumerate(shown):
            yield _drawn(args, result, frame)
            progress(k + 1, count)

    height, width, _ = _drawn(args, result, 0).shape
    with Progress(sys.stderr, unit="pictures") as progress:
        try:
            return encode.film(args.kind, pictures(), (width, height), args.fps)
        except (OSError, RuntimeError) as error:  # RuntimeError: there is no ffmpeg
            raise BadInputError(f"the film can't be encoded: {error}; try a .html") from error


def _drawn(args: Namespace, result: Result, frame: int) -> NDArray[np.uint8]:
    """Return the picture of a frame, with captions."""
    captions = [labels(result, i) for i in range(len(result))]
    picture = replay.still(result, frame=frame, panel=args.panel)
    return encode.captioned(picture, captions, args.panel)
