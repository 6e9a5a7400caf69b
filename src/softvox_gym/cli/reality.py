"""softvox reality: the gap between the simulator and other worlds."""

from __future__ import annotations

import json
import math
from argparse import Namespace
from pathlib import Path
from textwrap import fill
from typing import Any

from softvox_gym.cli.parser import add_physics, physics_of
from softvox_gym.cli.terminal import bad_input
from softvox_gym.files import check_folder, write_folder
from softvox_gym.landscapes import gap
from softvox_gym.physics import Physics
from softvox_gym.realities import SETS, Reality, realities, reality

TABLE = "realities.csv"

#: Name in the table of the reality given by options.
OWN = "yours"

DESCRIPTION = f"""\
Compare the simulator's landscape with those of other worlds: the named
realities, whose exact landscapes ship with the package; those of the sets
{" and ".join(SETS)} ({len(SETS["public"])} each, as public-0), drawn from the prior in
docs/reality-gap.md; or one of your own, by the physics options. Landscapes that
don't ship take a few seconds each to simulate, and are kept.

{fill(gap.MEANING, 79)}
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "reality",
        help="compare the landscape with those of other worlds",
        description=DESCRIPTION,
        usage="softvox reality [NAME ...] [--list] [--out DIR] [options]",
    )
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help="a reality of --list, or of a set, as public-0 (default: all of --list)",
    )
    parser.add_argument(
        "--list", action="store_true", help="describe each reality, with its source, and stop"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"also write {TABLE}, unrounded, into this folder"
    )
    parser.add_argument("--force", action="store_true", help="replace an earlier table in DIR")
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Print the table, and write it."""
    with bad_input():
        chosen = [reality(name) for name in args.names]
        if (own := physics_of(args)) != Physics.published():
            chosen.append(Reality(OWN, own, about="the options given", source="you"))
        chosen = chosen or list(realities().values())
    if args.out is not None:
        with bad_input("--out"):
            check_folder(args.out, [TABLE], force=args.force)
    if args.list:
        print("\n".join(f"{one.name:16} {one.about}\n{'':16} {one.source}" for one in chosen))
        return 0
    table = gap.gaps(chosen)
    if args.out is not None:
        with bad_input("--out"):
            write_folder(args.out, {TABLE: table.csv()}, force=args.force)
    if args.json:
        rows = [{key: plain(value) for key, value in row.items()} for row in table.records()]
        print(json.dumps(rows, indent=2, allow_nan=False))
        return 0
    print(table.text())
    for row in table.records():
        if row["diverged"]:
            print(f"\n{row['diverged']} designs diverge in {row['reality']}; their reward is 0")
    if args.out is not None:
        print(f"\nwrote {args.out / TABLE}")
    return 0


def plain(value: Any) -> Any:
    """Return a value for JSON, which has no NaN: None in its place."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
