"""softvox robustness: how noise changes the landscape."""

from __future__ import annotations

import json
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

from softvox_gym.cli.parser import number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.files import check_folder, write_folder
from softvox_gym.landscapes import robustness
from softvox_gym.landscapes.noisy import LEVELS

KNOWN = ", ".join(f"{level:g}" for level in LEVELS)

DESCRIPTION = f"""\
Show how noise on actuation, friction, stiffness, density and the floor's tilt
changes the landscape, from the noisy ground truth that ships with the package:
64 draws of every design at each level, and 256 new draws of the best designs.
Level 1 is the assumed real variability (Jakobi, Husbands and Harvey 1995),
level 0 is no noise.

{fill(robustness.MEANING, 79)}

At level 4 a robot now and then slides down the tilted floor for a metre. This
dominates the means, but not the quantile.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "robustness",
        help="show how noise changes the landscape and the top hundred",
        description=DESCRIPTION,
    )
    parser.add_argument(
        "--level",
        type=number,
        default=1.0,
        metavar="L",
        help=f"noise in the list of the published top hundred, one of {KNOWN} (default: 1)",
    )
    parser.add_argument(
        "--all", action="store_true", help="list all hundred, not only those with a remark"
    )
    parser.add_argument("--json", action="store_true", help="print JSON, with all hundred")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="also write everything as CSV into this folder"
    )
    parser.add_argument("--force", action="store_true", help="replace an earlier result in DIR")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Print the summary, and write the tables."""
    if args.level not in LEVELS:
        raise BadInputError(f"--level must be one of {KNOWN}, got {args.level:g}")
    if args.out is not None:
        tables = robustness.tables()
        with bad_input("--out"):
            check_folder(args.out, tables, force=args.force)
            write_folder(args.out, tables, force=args.force)
    levels, top = robustness.levels(), robustness.published(args.level)
    if args.json:
        data = {"levels": levels.to_dict(), "published": top.to_dict()}
        print(json.dumps(data, indent=2, allow_nan=False))
        return 0
    if not args.all:
        top = replace(top, rows=[row for row in top.rows if row[-1]])
    print(f"{levels.text()}\n\n{top.text()}")
    if args.out is not None:
        print(f"\nwrote {args.out}")
    return 0
