"""softvox trials next: which robots to build and test, by what the database holds."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softvox_gym import MeasuredReality, Physics, Reality, Task
from softvox_gym.build import bill, plan
from softvox_gym.cli.parser import add_physics, cycles, number, physics_of, whole_number
from softvox_gym.cli.reality import plain
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.cli.trials import add_filters, chosen
from softvox_gym.design import Design
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.progress import Progress
from softvox_gym.real_tracks import heading
from softvox_search.cli.options import not_negative, options_given
from softvox_view.cli.build import check_form, sheets_of
from softvox_view.cli.trials.options import add_folders, read_folders

if TYPE_CHECKING:
    from softvox_search.transfer.next import Proposal

DESCRIPTION = """\
Propose robots to build and test next, by what was measured: where the models
that fit it disagree (--method eea), or where most is expected (--method ite).
The first choice comes first, and every other one as if those before it had
shown what is expected of them. None was measured, turned and mirrored ones
included, and the kit can build them all. In an empty folder nothing was
measured, and the simulator or the method's own models choose.

The trials have to be of one world, with one surface, powder, pressure and
frequency; options choose among them. The simulator that they are held against
is that of the physics options, over as many cycles as the shortest run has.

eea simulates 40 models of all designs when it is first asked, which takes some
minutes, and keeps them; --option size=8 has fewer. softvox transfer --list has
the options of the methods.
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
    options: dict[str, dict[str, Any]] = {
        "method": {
            "choices": ("eea", "ite"),
            "default": "eea",
            "help": "eea, by disagreement, or ite, by expected gain (default: %(default)s)",
        },
        "budget": {
            "type": whole_number,
            "default": 5,
            "metavar": "N",
            "help": "robots, at most 100 (default: %(default)s)",
        },
        "task": {
            "default": "displacement",
            "metavar": "NAME",
            "help": "displacement, in any direction, or directed, along a heading "
            "(default: %(default)s)",
        },
        "heading": {
            "type": number,
            "metavar": "DEG",
            "help": "of the directed task, degrees from x towards y (default: 0)",
        },
        "seed": {
            "type": not_negative,
            "default": 0,
            "metavar": "N",
            "help": "of all random numbers (default: %(default)s)",
        },
        "option": {
            "action": "append",
            "default": [],
            "metavar": "KEY=VALUE",
            "help": "of the method, with a value as in TOML; may be given several times",
        },
        "cycles": {
            "type": cycles,
            "metavar": "N",
            "help": "after which real and simulated robots are looked at, or REAL:SIMULATED, as "
            "90:23 (default: as many as the shortest run has)",
        },
        "json": {"action": "store_true", "help": "print JSON"},
        "out": {
            "type": Path,
            "metavar": "FILE",
            "help": "draw the sheets to build them from, .pdf or .html, as softvox build does",
        },
        "force": {"action": "store_true", "help": "replace FILE where it exists"},
        "quiet": {"action": "store_true", "help": "no progress bar"},
    }
    for name, settings in options.items():
        parser.add_argument(f"--{name}", **settings)
    add_filters(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Propose robots, and print them."""
    from softvox_search.transfer.next import proposals
    from softvox_search.transfer.registry import REGISTRY

    if args.duration is not None:
        raise BadInputError("--duration is said by --cycles; leave it out")
    with bad_input("--task:" if args.heading is None else "--heading:"):
        task = Task(args.task, args.heading)
    if args.out:
        check_form(args.out, args.budget)
        with bad_input("--out"):
            check_file(args.out, force=args.force)
    physics, where = _worlds(args)
    options = options_given(args.option)
    with bad_input():
        REGISTRY.check_options(args.method, options)
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
    facts = {
        "method": args.method,
        "options": options,
        "task": task.name,
        "heading": task.heading,
        "seed": args.seed,
        "measured": [] if where is None else where.designs.tolist(),
        "about": "nothing was measured" if where is None else where.about,
        "cycles_real": None if where is None else where.cycles,
        "cycles_simulated": round(float(physics.cycles), 3),
        "physics": physics.to_dict(),
        "sheets": None,
    }
    table = _table(made)
    if args.out and made:
        plans = [plan(Design(one.design)) for one in made]
        content = sheets_of(args.out, plans, bill(plans))
        with bad_input("--out"):
            write_file(args.out, content, force=args.force)
        facts["sheets"] = str(args.out)
    if args.json:
        print(json.dumps({**facts, "proposals": table.records()}, indent=2, allow_nan=False))
    else:
        print(_text(facts, table))
    return 0


def _worlds(args: Namespace) -> tuple[Physics, MeasuredReality | None]:
    """Return the simulator, and what was measured; None where nothing was."""
    there, physics = read_folders(args), physics_of(args)
    if not there:
        return physics, None
    if not (trials := chosen(there, args)):
        raise BadInputError("no trial is of that kind; softvox trials list shows what there are")
    with bad_input():
        real, simulated = args.cycles or (None, None)
        where = Reality.from_trials(trials, cycles=real)
        simulated = simulated or where.cycles
        if abs(simulated - float(physics.cycles)) > 1e-3:  # else a landscape that ships
            physics = physics.lasting(simulated)
    return physics, replace(where, nominal=physics)


def _table(made: Sequence[Proposal]) -> Section:
    """Return the proposals, the first choice first."""
    rows = []
    for one in made:
        moved = None if one.displacement is None else one.displacement[:2]
        rows.append(
            (
                one.design,
                Design(one.design).digits,
                one.reward,
                one.spread,
                None if moved is None else plain(heading(moved)),
                one.simulated,
                None if moved is None else moved.tolist(),
                one.why,
            )
        )
    columns = (
        Column("design", "design"),
        Column("digits"),
        Column("reward", "expected", ".2f"),
        Column("spread", "spread", ".2f"),
        Column("heading", "heading" if any(row[4] is not None for row in rows) else "", ".0f"),
        Column("simulated", "simulated", ".2f"),
        Column("displacement"),
        Column("why", "why"),
    )
    return Section(columns=columns, rows=rows)


def _text(facts: dict[str, Any], table: Section) -> str:
    """Return it for people."""
    along = "" if facts["heading"] is None else f" along {facts['heading']:g} degrees"
    designs = " ".join(str(row[0]) for row in table.rows)
    draw = f"softvox build {designs} --out FILE draws the sheets to build them from."
    wrote = f"wrote {facts['sheets']}, the sheets to build them from"
    return "\n".join(
        [
            f"{facts['method']}, {facts['task']}{along}; {facts['about']}",
            f"held against {facts['cycles_simulated']:g} simulated cycles",
            "",
            table.text() if table.rows else "no robot is proposed",
            "",
            "Lengths in voxel widths, headings in degrees.",
            (wrote if facts["sheets"] else draw) if designs else "",
        ]
    ).rstrip()
