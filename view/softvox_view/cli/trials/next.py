"""softvox trials next: which robots to build and test next, based on the trials."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softvox_gym import Reality, Task
from softvox_gym.build import bill, plan
from softvox_gym.cli.parser import add_physics, physics_of, whole_number
from softvox_gym.cli.reality import plain
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.cli.trials import add_cycles, add_filters, add_folders, read_chosen
from softvox_gym.design import Design
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.progress import Progress
from softvox_gym.real_tracks import heading
from softvox_gym.trials.measured import for_cycles
from softvox_search.cli.options import add_method_options, options_given
from softvox_view.cli.build import check_form, sheets_of

if TYPE_CHECKING:
    from softvox_search.transfer.next import Proposal

DESCRIPTION = """\
Propose robots to build and test next, based on trials: designs on which the
models that fit the trials disagree (--method eea), or those with the highest
expected reward (--method ite). The best choice comes first; each further one is
chosen as if the results of those before it were as expected. Designs that were
measured, even turned or mirrored, and designs that the kit can't build are left
out. With an empty folder, the simulator or the method's own models choose.

The trials must be of one world, with one surface, powder, pressure and
frequency; options select them. They are compared with the simulator of the
physics options, after as many cycles as the shortest run has.

eea simulates all designs under 40 models on first use, which takes some
minutes, and keeps the results; --option size=8 uses fewer models. softvox
transfer --list shows the options of the methods.
"""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = commands.add_parser(
        "next",
        help="propose robots to build and test",
        description=DESCRIPTION,
        usage="softvox trials next [DIR ...] [--method eea|ite] [--budget N] [options]",
    )
    add_folders(parser)
    parser.add_argument(
        "--method",
        choices=("eea", "ite"),
        default="eea",
        help="eea (disagreement) or ite (expected reward) (default: %(default)s)",
    )
    parser.add_argument(
        "--budget",
        type=whole_number,
        default=5,
        metavar="N",
        help="number of robots, at most 100 (default: %(default)s)",
    )
    add_method_options(parser, task="displacement", heading="0")
    add_cycles(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="draw sheets to build the robots from, as softvox build does",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_filters(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Propose robots, draw the sheets, then print."""
    from softvox_search.transfer.next import proposals
    from softvox_search.transfer.registry import REGISTRY

    if args.duration is not None:
        raise BadInputError("--duration follows from the cycles; leave it out, and give --cycles")
    with bad_input("--task:" if args.heading is None else "--heading:"):
        task = Task(args.task, args.heading)
    if args.out:
        check_form(args.out)
        with bad_input("--out"):
            check_file(args.out, force=args.force)
    physics, where, options = physics_of(args), None, options_given(args.option)
    trials = read_chosen(args)
    with bad_input():
        REGISTRY.check_options(args.method, options)
        if trials:
            where = Reality.from_trials(trials, nominal=physics, cycles=args.cycles)
            physics = where.nominal
        elif args.cycles:
            physics = for_cycles(physics, args.cycles[1])
    with bad_input(), Progress(sys.stderr, quiet=args.quiet, unit="models") as progress:
        made = proposals(
            where,
            method=args.method,
            budget=args.budget,
            task=task,
            seed=args.seed,
            nominal=physics,
            progress=progress,
            **options,
        )
    sheets = str(args.out) if args.out and made else None
    facts = {
        **{"method": args.method, "options": options, "task": task.name, "heading": task.heading},
        "seed": args.seed,
        "measured": [] if where is None else where.designs.tolist(),
        "about": "nothing was measured" if where is None else where.about,
        "cycles_real": None if where is None else where.cycles,
        "cycles_simulated": round(float(physics.cycles), 3),
        **{"physics": physics.to_dict(), "sheets": sheets},
    }
    if sheets:
        plans = [plan(Design(one.design)) for one in made]
        content = sheets_of(args.out, plans, bill(plans))
        with bad_input("--out"):
            write_file(args.out, content, force=args.force)
    table = _table(made)
    if args.json:
        print(json.dumps({**facts, "proposals": table.records()}, indent=2, allow_nan=False))
    else:
        print(_text(facts, table))
    return 0


def _table(made: Sequence[Proposal]) -> Section:
    """Return the table of proposals, best first."""
    ways = [None if one.displacement is None else one.displacement[:2] for one in made]
    headings = [None if way is None else plain(heading(way)) for way in ways]
    table = {
        Column("design", "design"): [one.design for one in made],
        Column("digits"): [Design(one.design).digits for one in made],
        Column("reward", "expected", ".2f"): [one.reward for one in made],
        Column("spread", "spread", ".2f"): [one.spread for one in made],
        Column("heading", "heading" if any(w is not None for w in ways) else "", ".0f"): headings,
        Column("simulated", "simulated", ".2f"): [one.simulated for one in made],
        Column("displacement"): [None if way is None else way.tolist() for way in ways],
        Column("why", "why"): [one.why for one in made],
    }
    return Section(columns=list(table), rows=list(zip(*table.values(), strict=True)))


def _text(facts: dict[str, Any], table: Section) -> str:
    """Return the proposals as text."""
    along = "" if facts["heading"] is None else f" along {facts['heading']:g} degrees"
    designs = " ".join(str(row[0]) for row in table.rows)
    lines = [
        f"{facts['method']}, {facts['task']}{along}; {facts['about']}",
        f"compared after {facts['cycles_simulated']:g} simulated cycles",
        "",
    ]
    if not designs:
        return "\n".join([*lines, "no robot is proposed"])
    sheets = (
        f"wrote {facts['sheets']}, the sheets to build them from"
        if facts["sheets"]
        else f"softvox build {designs} --out FILE draws the sheets to build them from."
    )
    return "\n".join(
        [*lines, table.text(), "", "Lengths in voxel widths, headings in degrees.", sheets]
    )
