"""softvox trials add: tracks from files, added to the folder of trials."""

from __future__ import annotations

import argparse
import re
from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_gym.cli.parser import add_shape, number, whole_number
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import bad_input
from softvox_gym.cli.trials import add_into
from softvox_gym.landscapes.section import counted
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import VOXEL_CM
from softvox_gym.trials.database import add
from softvox_gym.trials.track_files import Film, read_track_files
from softvox_gym.trials.trial import LICENSES
from softvox_view.cli.trials.database import table_of

DESCRIPTION = """\
Read tracks of robots from files, and keep each as a trial. Three kinds of files
are recognised by their content (docs/trials.md):
  csv          columns t_s or cycle, and x_cm,y_cm or x_px,y_px; also design and
               trial (the repetition) if the file has several tracks
  tracker      Tracker's File > Export > Data File, with t, x and y
  deeplabcut   DeepLabCut's CSV of an analysed video; needs --fps

Everything is checked before anything is written. After an interruption, the
same command adds what is missing.
"""

EXAMPLE = """\
example:
  softvox trials add film.csv --design 6453 --fps 60 --scale 10/437 \\
    --picture 1920x1080 --x-axis-deg 90 --start-s 1.5 --frequency-hz 0.5 \\
    --surface acrylic --powder cornstarch --pressure-kpa 6 \\
    --who "A. Person" --date 2026-11-27 --license CC-BY-4.0
"""

#: Options: name, metavar, type and help; those for facts of a `Trial`, then of a `Film`.
RUN = (
    ("--surface", "TEXT", str, "what the robot stood on"),
    ("--who", "TEXT", str, "who ran it"),
    ("--date", "DATE", str, "date of the run, as 2026-11-27; required unless simulated"),
    ("--robot", "TEXT", str, "which robot, if several of a design were built"),
    ("--powder", "TEXT", str, "what lay on the surface"),
    ("--pressure-kpa", "X", number, "pressure of the pump"),
    ("--frequency-hz", "X", number, "frequency of actuation; required with seconds or frames"),
    ("--cycles", "X", number, "cycles of actuation in the run (default: those of the track)"),
    ("--voxel-cm", "X", number, f"edge of a voxel at rest (default: {VOXEL_CM:g}, simulated: 1)"),
    ("--camera", "TEXT", str, "the camera, and where it stood"),
    ("--notes", "TEXT", str, "anything else"),
    ("--reality", "NAME", str, "the reality in which the tracks were simulated"),
)
FILM = (
    ("--scale", "L", str, "reference length as CM/PIXELS, 10/437; for Tracker also cm, mm, m"),
    (
        "--x-axis-deg",
        "DEG",
        number,
        "direction of the robot's +x axis at the start, counter-clockwise "
        "from the picture's right (default: 0)",
    ),
    ("--start-s", "S", number, "time at which the pump starts (default: that of the first line)"),
    ("--fps", "X", number, "frames per second, for DeepLabCut's files"),
    ("--point", "NAME", str, "body part, or track of Tracker, if the file has several"),
    ("--likelihood", "X", number, "leave out DeepLabCut's points below X (default: 0.9)"),
)


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = commands.add_parser(
        "add",
        help="read tracks of robots from files",
        description=DESCRIPTION,
        epilog=EXAMPLE,
        usage="softvox trials add FILE ... --surface TEXT --who TEXT --date DATE\n"
        "                          --license NAME [options]",
    )
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE", help="files of tracks")
    add_into(parser)
    group = parser.add_argument_group("the run")
    group.add_argument("--design", metavar="N", help="the design: a number, digits or a file")
    add_shape(group)
    group.add_argument(
        "--repetition",
        type=whole_number,
        metavar="N",
        help="number of the first track; further ones are numbered onwards (default: 1)",
    )
    group.add_argument("--license", required=True, choices=LICENSES, help="licence of the data")
    for name, holds, kind, text in RUN:
        is_needed = name in ("--surface", "--who")
        group.add_argument(name, type=kind, metavar=holds, required=is_needed, help=text)
    group = parser.add_argument_group("the film")
    group.add_argument(
        "--picture",
        type=_size,
        metavar="WxH",
        help="size in pixels; points outside it are errors",
    )
    group.add_argument(
        "--y",
        choices=("up", "down"),
        help="direction of y (default: down in pixels, else up); the other one "
        "for a film from below, whose --x-axis-deg counts clockwise",
    )
    for name, holds, kind, text in FILM:
        group.add_argument(name, type=kind, metavar=holds, help=text)
    parser.set_defaults(run=run, parser=parser)


def _size(text: str) -> tuple[int, int]:
    if not (sides := re.fullmatch(r"([1-9]\d{0,5})x([1-9]\d{0,5})", text)):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT as 1920x1080, got {text!r}")
    return int(sides[1]), int(sides[2])


def run(args: Namespace) -> int:
    """Read all files, then add all trials, and print them."""
    given = {name: value for name, value in vars(args).items() if value is not None}
    facts = {name: given[name] for name in ("license", *map(_name, RUN)) if name in given}
    film = {name: given[name] for name in ("picture", "y", *map(_name, FILM)) if name in given}
    if args.reality is not None:
        facts["source"] = "simulated"
    design = None if args.design is None else design_of(args.design, args.shape, args.phases)
    with bad_input():
        found = read_track_files(
            args.files,
            film=Film(**film),
            design=design,
            lattice=design.lattice if design else Lattice.of(args.shape, phases=args.phases),
            repetition=args.repetition,
            **facts,
        )
        places = {one.trial: one.place for one in found}
        new, known = add(args.into, places, refuse_copies=True)
    print(table_of(list(places)).text())
    for one in found:
        if one.left_out:
            print(f"{one.place}: lines left out, without a likely position: {one.left_out}")
    print(f"{counted(len(new), 'trial')} added to {args.into}, {len(known)} were there already")
    return 0


def _name(option: tuple[Any, ...]) -> str:
    return str(option[0]).removeprefix("--").replace("-", "_")
