"""softvox trials add: files of tracks into the folder of trials."""

from __future__ import annotations

import argparse
import math
import re
from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_gym.cli.parser import add_shape, number, whole_number
from softvox_gym.cli.reality import plain
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import bad_input
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import heading
from softvox_gym.trials.database import add, name_of, read
from softvox_gym.trials.track_files import KINDS, Film, Found, read_track_files
from softvox_gym.trials.trial import LICENSES, VOXEL_CM
from softvox_view.cli.trials.options import add_into

DESCRIPTION = """\
Read tracks of robots from files, and keep each as a trial. Three kinds of file
are known by what is in them (docs/trials.md):
  csv          t_s or cycle, and x_cm,y_cm or x_px,y_px; design and trial, which
               is the repetition, where one file holds several
  tracker      Tracker's File > Export > Data File, with t, x and y
  deeplabcut   DeepLabCut's CSV of an analysed video; needs --fps

Nothing is written unless everything is good. The same command once more
completes what was interrupted.
"""

EXAMPLE = """\
example:
  softvox trials add film.csv --design 6453 --fps 60 --scale 10/437 \\
    --picture 1920x1080 --x-axis 90 --start 1.5 --frequency-hz 0.5 \\
    --surface acrylic --powder cornstarch --pressure-kpa 6 \\
    --who "A. Person" --date 2026-11-27 --license CC-BY-4.0
"""

TEXTS = {
    "surface": "what the robot stood on",
    "who": "who ran it",
    "date": "of the run, as 2026-11-27; none where it is simulated",
    "robot": "which one, where several of a design were built",
    "powder": "what lay on the surface",
    "camera": "the camera, and where it stood",
    "notes": "anything else",
}

NUMBERS = {
    "pressure-kpa": "of the pump",
    "frequency-hz": "of the actuation; needed where a file counts seconds or frames",
    "cycles": "of actuation in the run (default: those of the track)",
    "voxel-cm": f"the resting edge of a voxel (default: {VOXEL_CM:g}, of simulated ones 1)",
}


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
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    add_into(parser)
    parser.add_argument("--dry-run", action="store_true", help="only say what would be added")
    of_run = parser.add_argument_group("the run")
    of_run.add_argument("--design", metavar="N", help="number, digits or a file")
    add_shape(of_run)
    of_run.add_argument(
        "--repetition",
        type=whole_number,
        metavar="N",
        help="of the first file's track; further ones are numbered on (default: 1)",
    )
    for name, text in TEXTS.items():
        is_needed = name in ("surface", "who")
        meta = "DATE" if name == "date" else "TEXT"
        of_run.add_argument(f"--{name}", required=is_needed, default="", metavar=meta, help=text)
    for name, text in NUMBERS.items():
        of_run.add_argument(f"--{name}", type=number, metavar="X", help=text)
    of_run.add_argument("--license", required=True, choices=LICENSES, help="of the data")
    of_run.add_argument(
        "--reality", metavar="NAME", help="of tracks that are simulated: the world they are from"
    )
    film = parser.add_argument_group("the film")
    film.add_argument("--format", choices=KINDS, help="of the files (default: by their content)")
    film.add_argument(
        "--scale",
        metavar="L",
        help="CM/PIXELS, a reference length such as 10/437; or cm, mm or m, Tracker's unit",
    )
    film.add_argument(
        "--picture", type=_size, metavar="WxH", help="pixels, which no point may leave"
    )
    film.add_argument(
        "--y", choices=("up", "down"), help="where y grows (default: down in pixels, else up)"
    )
    film.add_argument(
        "--x-axis",
        type=number,
        default=0.0,
        metavar="DEG",
        help="where the robot's +x axis points in the picture at the start, counter-clockwise "
        "from the right (default: 0)",
    )
    film.add_argument(
        "--start", type=number, metavar="S", help="when the pump starts (default: first line)"
    )
    film.add_argument("--fps", type=number, metavar="X", help="frames per second, for DeepLabCut")
    film.add_argument(
        "--point", metavar="NAME", help="the body part or Tracker's track, where there are several"
    )
    film.add_argument(
        "--likelihood",
        type=number,
        default=0.9,
        metavar="X",
        help="DeepLabCut's points below are left out (default: 0.9)",
    )
    film.add_argument(
        "--allow-jumps", action="store_true", help="take tracks that no robot could have made"
    )
    parser.set_defaults(run=run, parser=parser)


def _size(text: str) -> tuple[int, int]:
    if not (sides := re.fullmatch(r"([1-9]\d{0,5})x([1-9]\d{0,5})", text)):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT as 1920x1080, got {text!r}")
    return int(sides[1]), int(sides[2])


def run(args: Namespace) -> int:
    """Read all files, then add all trials, and print them."""
    facts = {name: getattr(args, name) for name in (*TEXTS, "license")}
    given = {name.replace("-", "_"): vars(args)[name.replace("-", "_")] for name in NUMBERS}
    facts |= {name: value for name, value in given.items() if value is not None}
    if args.reality is not None:
        facts |= {"source": "simulated", "reality": args.reality}
    design = None if args.design is None else design_of(args.design, args.shape, args.phases)
    with bad_input():
        found = read_track_files(
            args.files,
            film=Film(
                kind=args.format,
                scale=args.scale,
                picture=args.picture,
                y=args.y,
                x_axis_deg=args.x_axis,
                start_s=args.start,
                fps=args.fps,
                point=args.point,
                likelihood=args.likelihood,
                allow_jumps=args.allow_jumps,
            ),
            design=design,
            lattice=None if design else Lattice.of(args.shape, phases=args.phases),
            repetition=args.repetition,
            known=read(args.into) if args.into.exists() else (),
            **facts,
        )
        trials = [one.trial for one in found]
        if args.dry_run:
            new = sum(not (args.into / name_of(trial)).exists() for trial in set(trials))
            known = len(set(trials)) - new
        else:
            new, known = map(len, add(args.into, trials))
    lead = "would be added" if args.dry_run else "added"
    count = f"{new} trial{'' if new == 1 else 's'}"
    print(f"{_table(found).text()}\n\n{count} {lead} to {args.into}, {known} were there already")
    return 0


def _table(found: tuple[Found, ...]) -> Section:
    rows = []
    for trial, path, line, left_out in found:
        design = trial.design
        rows.append(
            (
                trial.digest[:8],
                design.index if design.lattice == Lattice() else design.digits,
                trial.repetition,
                len(trial.cycle),
                left_out,
                float(trial.cycle[-1]),
                math.hypot(*trial.displacement),
                plain(heading(trial.displacement)),
                f"{path}, line {line}",
            )
        )
    columns = (
        Column("digest", "digest"),
        Column("design", "design"),
        Column("repetition", "rep."),
        Column("points", "points"),
        Column("left_out", "left out"),
        Column("cycles", "cycles", ".4g"),
        Column("distance", "distance", ".2f"),
        Column("heading", "heading", ".0f"),
        Column("from", "from"),
    )
    sentence = "distance in voxel widths, heading in degrees from +x towards +y"
    return Section(columns=columns, rows=rows, sentence=sentence)
