"""softvox calibrate: the physics under which simulated robots move like real ones."""

from __future__ import annotations

import json
import math
import sys
from argparse import Namespace
from pathlib import Path
from textwrap import fill
from typing import Any

from softvox_gym.calibration import (
    AXES,
    KNOWN,
    Calibration,
    calibrate,
    grid_of,
    known_of,
    tracks_of,
)
from softvox_gym.cli.parser import add_physics, add_several, add_threads, physics_of
from softvox_gym.cli.reality import plain
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.cli.trials import add_trials, measured_of
from softvox_gym.design import Design, written
from softvox_gym.files import check_folder
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.lattice import Lattice
from softvox_gym.physics import Physics
from softvox_gym.progress import Progress
from softvox_gym.real_tracks import LITTLE, MOST_CYCLES, WITHIN, RealTrack, heading, read_tracks
from softvox_gym.realities import Reality, reality
from softvox_gym.trials.measured import MeasuredReality
from softvox_view.cli.options import import_figures, write_figures

#: The most points in the printed table.
SHOWN = 10

DESCRIPTION = f"""\
Find the physics under which simulated designs move like real robots: simulate
every real design at every point of a grid of physics. What is real is given by
  --tracks    files of real tracks, in the format of softvox figures
  --trials    a folder of trials (see softvox trials) of 2x2x2 designs under the
              same conditions; a frequency recorded in them is taken as known
  --reality   a pseudo-reality, with --designs; {", ".join(KNOWN[:-1])} and
              {KNOWN[-1]} are taken as known, as whoever pumps a robot knows
              them, and nothing else

A point's score is the number of headings that match within {WITHIN} degrees; ties
are decided by how many designs diverge, then by the distance between the ends.
Designs that travel less than {LITTLE:g} voxel widths in reality have no heading and
are not counted; a design that has none at a point is a miss there. Robots are
compared after as many cycles as the real ones walked; with --trials, all after
as many as the shortest run has, or after --cycles.

--grid names axes, each with values or with its default values:
  friction,shear                   pairs of friction, kinetic at most static; T*
  friction,strain=0.2:0.5:4        pairs of friction; 4 strains from 0.2 to 0.5
  shear=0,0.5,frequency_hz=2,4     two values of each
shear is T*, the shear strength of a voxel's face over the voxel's weight. All
numeric parameters of the physics may be axes. These have default values:
{fill(", ".join(AXES), 79)}
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "calibrate",
        help="find the physics under which designs move like real robots",
        description=DESCRIPTION,
        usage="softvox calibrate --tracks FILE.csv [options]\n"
        "       softvox calibrate --trials DIR [options]\n"
        "       softvox calibrate --reality NAME --designs N,N,... [options]",
    )
    add_several(parser, "--tracks", "FILE.csv", "tracks of real robots")
    parser.add_argument("--reality", metavar="NAME", help="a reality of softvox reality --list")
    parser.add_argument(
        "--designs", metavar="N,N,...", help="designs for --reality, as numbers or digits"
    )
    parser.add_argument(
        "--grid",
        default="friction,shear",
        metavar="GRID",
        help="the axes of the grid (default: friction,shear)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON, with all points")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="also draw the number of matched headings over the grid, and the real tracks over "
        "those of the best point, into this folder, with tables of both",
    )
    parser.add_argument("--force", action="store_true", help="replace earlier files in DIR")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_trials(parser)
    add_threads(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, simulate, draw, write all files at once, then print."""
    if (bool(args.tracks), bool(args.trials), args.reality is not None).count(True) != 1:
        raise BadInputError(
            "give what is real: one of --tracks FILE.csv, --trials DIR, and --reality NAME "
            "--designs N,N,..."
        )
    if (args.designs is None) == (args.reality is not None):
        raise BadInputError("--reality NAME and --designs N,N,... belong together; give both")
    if args.duration is not None:
        raise BadInputError(
            "--duration follows from the cycles of the real tracks; leave it out, and give "
            "--frequency-hz to set how long a cycle is"
        )
    with bad_input("--grid"):
        grid = grid_of(args.grid)
    if args.out is not None:
        import_figures()
        with bad_input("--out"):
            check_folder(args.out, ["calibration.csv"], force=args.force)
    where = _where(args)
    known = _take_known(args, where)
    physics = physics_of(args)
    tracks = _tracks(args, where, physics)
    with bad_input(), Progress(sys.stderr, quiet=args.quiet, unit="robots") as progress:
        made = calibrate(tracks, grid, physics, threads=args.threads, progress=progress)
    points, designs = points_of(made), designs_of(made)
    if args.out is not None:
        _write(args, made, tracks, {"calibration.csv": points, "calibration_designs.csv": designs})
    if args.json:
        found = {
            "best": made.point(made.best),
            "with_heading": int(made.has_heading.sum()),
            "reality": args.reality,
            "about": None if where is None else where.about,
            "known": known,
            "designs": [{k: plain(value) for k, value in row.items()} for row in designs.records()],
            "points": points.records(),
            "physics": made.physics.to_dict(),
        }
        print(json.dumps(found, indent=2, allow_nan=False))
        return 0
    print(f"{points.text()}\n\nat the best point:\n{designs.text()}")
    if where is not None:
        told = (f"{k} {v if isinstance(v, str) else f'{v:g}'}" for k, v in known.items())
        print(f"\nreal: {where.about}\ntaken as known: {', '.join(told) or 'nothing'}")
    if args.out is not None:
        print(f"\nwrote {args.out}")
    return 0


def _where(args: Namespace) -> Reality | None:
    """Return the reality that the options name; None if they give tracks."""
    if (made := measured_of(args)) is not None:
        return made
    with bad_input("--reality:"):
        return None if args.reality is None else reality(args.reality)


def _take_known(args: Namespace, where: Reality | None) -> dict[str, Any]:
    """Set the known parameters of the reality unless an option sets them, and return them."""
    known = {} if where is None else known_of(where)
    for name, value in known.items():
        if vars(args)[name] is None:
            setattr(args, name, value)
    return {name: vars(args)[name] for name in known}


def _tracks(args: Namespace, where: Reality | None, physics: Physics) -> tuple[RealTrack, ...]:
    if isinstance(where, MeasuredReality):
        return where.against(physics).tracks
    if where is None:
        with bad_input("--tracks"):
            return read_tracks(args.tracks, most_cycles=MOST_CYCLES)
    with bad_input("--designs:"):
        numbers = [written(text.strip(), Lattice()).index for text in args.designs.split(",")]
        return tracks_of(where, list(dict.fromkeys(numbers)))


def points_of(made: Calibration) -> Section:
    """Return the points, best first."""
    records = [made.point(i) for i in made.order]
    spec = {"headings": "d", "share": ".0%", "diverged": "d"} | dict.fromkeys(made.parameters, "g")
    title = {
        "friction_static": "static",
        "friction_kinetic": "kinetic",
        "shear_ratio": "T*",
        "heading_error_mean": "heading error",
        "heading_error_rms": "RMS",
        "distance_error_mean": "distance error",
        "distance_error_rms": "RMS",
        "end_error_rms": "end error RMS",
    }
    lost = int(made.diverged.any(axis=1).sum())
    return Section(
        columns=[
            Column(key, title.get(key, key), spec.get(key, ".1f" if "heading" in key else ".2f"))
            for key in records[0]
        ],
        rows=[tuple(record.values()) for record in records],
        screen=SHOWN,
        facts={
            "points": len(made),
            "n": len(made.designs),
            "headed": int(made.has_heading.sum()),
            "lost": lost,
        },
        sentence="{points} points, the best of them shown; {n} designs, {headed} of them with a "
        "heading in reality; {lost} points where designs diverge. Errors in degrees and voxel "
        "widths.",
    )


def designs_of(made: Calibration) -> Section:
    """Return the designs, in reality and at the best point."""
    best, model = made.best, made.end[made.best]
    table = {
        Column("design", "design"): made.designs.tolist(),
        Column("digits"): [Design(number).digits for number in made.designs.tolist()],
        Column("trials", "trials"): made.trials.tolist(),
        Column("spread", "spread", ".2f"): made.spread.tolist(),
        Column("cycles", "cycles", ".4g"): made.cycles.tolist(),
        Column("heading_real", "heading", ".0f"): [plain(heading(end)) for end in made.real],
        Column("heading", "model's", ".0f"): [plain(heading(end)) for end in model],
        Column("matched", "matched"): made.matched[best].tolist(),
        Column("distance_real", "distance", ".2f"): [math.hypot(*end) for end in made.real],
        Column("distance", "model's", ".2f"): [math.hypot(*end) for end in model],
        Column("end_error", "end error", ".2f"): made.end_error[best].tolist(),
        Column("diverged"): made.diverged[best].tolist(),
    }
    return Section(columns=list(table), rows=list(zip(*table.values(), strict=True)))


def _write(
    args: Namespace,
    made: Calibration,
    tracks: tuple[RealTrack, ...],
    tables: dict[str, Section],
) -> None:
    from softvox_view.figures import files_of
    from softvox_view.figures.calibration import draw_calibration
    from softvox_view.figures.style import FORMATS

    with bad_input("--out:"):
        files = files_of(draw_calibration(made, tracks), list(FORMATS))
    text = {name: section.csv() for name, section in tables.items()}
    write_figures(args.out, {**files, **text}, force=args.force)
