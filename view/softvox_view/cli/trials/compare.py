"""softvox trials compare: trials compared with the simulator, and with each other."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from pathlib import Path
from textwrap import fill
from typing import Any

from softvox_gym.cli.parser import add_physics, add_threads, named, physics_of
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.cli.trials import add_cycles, add_filters, add_folders, read_chosen
from softvox_gym.files import check_folder
from softvox_gym.landscapes.section import counted
from softvox_gym.physics import Physics
from softvox_gym.progress import Progress
from softvox_gym.realities import Reality, reality
from softvox_gym.trials.comparison import MEANING, Comparison, compare
from softvox_view.cli.options import import_figures, write_figures

TABLE, PAGE = "comparison.csv", "compare.html"

DESCRIPTION = f"""\
Compare the trials of every design with its simulation, and with each other:
every error is shown next to the repeatability, the difference between two
trials. Each condition (source, reality, surface, powder, pressure, frequency)
has its own table.

Real and simulated robots are compared after as many cycles as the shortest
trial of the condition has; with --cycles 23, after 23 cycles; with --cycles
90:23, after 90 real and 23 simulated ones, as in the paper. With --cycles,
shorter trials are left out.

{fill(MEANING, 79)}
"""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = commands.add_parser(
        "compare",
        help="compare trials with the simulator, and with each other",
        description=DESCRIPTION,
        usage="softvox trials compare [DIR ...] [--cycles C] [--out DIR] [options]",
    )
    add_folders(parser)
    add_cycles(parser)
    parser.add_argument(
        "--reality", metavar="NAME", help="simulate in this reality of softvox reality --list"
    )
    parser.add_argument("--json", action="store_true", help="print JSON, with all numbers")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"also write {PAGE}, its figures as PNG and PDF, and {TABLE} into this folder",
    )
    parser.add_argument("--force", action="store_true", help="replace earlier files in DIR")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_threads(parser)
    add_filters(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, simulate, draw, write all files at once, then print."""
    world = _world(args)
    if args.out is not None:
        import_figures()
        with bad_input("--out"):
            check_folder(args.out, [TABLE, PAGE], force=args.force)
    trials = read_chosen(args)
    with bad_input(), Progress(sys.stderr, quiet=args.quiet, unit="robots") as progress:
        made = compare(trials, world, cycles=args.cycles, threads=args.threads, progress=progress)
    if args.out is not None:
        _write(args, made)
    if args.json:
        print(json.dumps(as_dict(made), indent=2, allow_nan=False))
        return 0
    print(head(made))
    for section in made.conditions.values():
        print(f"\n{section.title}: {section.facts['cycles']}\n{section.text()}")
    if args.out is not None:
        print(f"\nwrote {args.out}")
    return 0


def head(made: Comparison) -> str:
    """Return a description of what is compared."""
    left_out = counted(len(made.left_out), "trial")
    short = f" Left out, as too short: {left_out}." if made.left_out else ""
    lost = sum(row.diverged for row in made.rows)
    still = f" {counted(lost, 'simulated robot')} diverged, and so stood still." if lost else ""
    return f"Simulator: {made.world.name}.{short}{still}"


def as_dict(made: Comparison) -> dict[str, Any]:
    """Return a comparison ready for JSON."""
    return {
        "simulator": made.world.name,
        **made.world.to_dict(),
        "left_out": [trial.digest for trial in made.left_out],
        "conditions": [
            {**condition._asdict(), **section.facts, "rows": section.records()}
            for condition, section in made.conditions.items()
        ],
    }


def _world(args: Namespace) -> Reality:
    """Return the simulator that the options select."""
    if args.duration is not None:
        raise BadInputError(
            "--duration follows from the cycles of the trials; leave it out, and give --cycles"
        )
    physics = physics_of(args)
    if args.reality is None:
        return Reality(named(physics, args.physics), physics)
    if physics != Physics.published():
        raise BadInputError("give either --reality or physics options, not both")
    with bad_input("--reality:"):
        return reality(args.reality)


def _write(args: Namespace, made: Comparison) -> None:
    from softvox_view.figures import Drawing, files_of
    from softvox_view.figures.style import FORMATS
    from softvox_view.figures.trials import draw_comparison, page

    with bad_input("--out:"):
        drawing = Drawing(draw_comparison(made))
    files = files_of(drawing, list(FORMATS))
    inline = files_of(drawing, ["svg"])
    text = {PAGE: page(made, head(made), inline), TABLE: made.section().csv()}
    write_figures(args.out, {**files, **text}, force=args.force)
