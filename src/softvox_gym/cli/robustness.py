"""softvox robustness: what noise does to the landscape."""

from __future__ import annotations

import json
from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softvox_gym.cli.parser import number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.files import check_folder, write_folder
from softvox_gym.landscapes.noisy import LEVELS

if TYPE_CHECKING:
    from softvox_gym.landscapes.robustness import Level, Published

KNOWN = ", ".join(f"{level:g}" for level in LEVELS)

DESCRIPTION = """\
Show what noise on actuation, friction, stiffness, density and the floor's tilt
does to the landscape, from the noisy ground truth that ships with the package:
64 draws of every design at each level, 256 fresh ones of the best. Level 1 is
the assumed real variability (Jakobi, Husbands and Harvey 1995), 0 none.

  tau       Kendall's rank correlation of the mean with the exact fitness, over
            all designs and over the 100 fittest
  overlap   how many of the 100 fittest are among the 100 with the best mean,
            and among the 100 with the best 10 % quantile (q10)
  retained  what is left of the fitness of the 100 fittest, on average

At level 4 a robot now and then slides down the tilted floor for a metre, and
the means are of that more than of walking; the quantile is not.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "robustness",
        help="show what noise does to the landscape and the top hundred",
        description=DESCRIPTION,
    )
    parser.add_argument(
        "--level",
        type=number,
        default=1.0,
        metavar="L",
        help=f"for the list of the published top hundred, one of {KNOWN} (default: 1)",
    )
    parser.add_argument(
        "--all", action="store_true", help="list all hundred, not only those that fall out"
    )
    parser.add_argument("--json", action="store_true", help="print JSON, with all hundred")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="also write everything as CSV into this folder"
    )
    parser.add_argument("--force", action="store_true", help="replace an earlier result in DIR")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Print the summary, and write the tables."""
    from softvox_gym.landscapes import robustness

    if args.level not in LEVELS:
        raise BadInputError(f"--level must be one of {KNOWN}, got {args.level:g}")
    top = robustness.published(args.level)
    if args.out is not None:
        tables = robustness.tables()
        with bad_input("--out"):
            check_folder(args.out, tables, force=args.force)
            contents = {name: text.encode() for name, text in tables.items()}
            write_folder(args.out, contents, force=args.force)
    if args.json:
        print(as_json(robustness.levels(), top, args.level))
        return 0
    print(levels_text(robustness.levels()))
    print()
    print(published_text(top, args.level, show_all=args.all))
    if args.out is not None:
        print(f"\nwrote {args.out}")
    return 0


def as_json(rows: list[Level], top: list[Published], level: float) -> str:
    """Return everything for programs."""
    data = {
        "levels": [asdict(row) for row in rows],
        "level": level,
        "published": [asdict(row) for row in top],
    }
    return json.dumps(data, indent=2, allow_nan=False)


def levels_text(rows: list[Level]) -> str:
    """Return the summary of the levels as lines."""
    lines = [
        f"{'level':>5}  {'best':>5}  {'mean':>6}  {'+-':>5}  {'tau':>5}  {'tau 100':>7}  "
        f"{'overlap':>7}  {'by q10':>6}  {'retained':>8}  {'diverged':>8}"
    ]
    lines += [
        f"{row.level:5g}  {row.best:5}  {row.mean:6.3f}  {row.standard_error:5.3f}  "
        f"{row.kendall_tau:5.2f}  {row.kendall_tau_top:7.2f}  {row.overlap:7}  "
        f"{row.overlap_q10:6}  "
        f"{row.retained:8.0%}  {row.p_diverged:8.1%}"
        for row in rows
    ]
    return "\n".join(lines)


def published_text(rows: list[Published], level: float, *, show_all: bool) -> str:
    """Return what becomes of the published top hundred as lines."""
    fallen = [row for row in rows if not row.survives]
    shown = rows if show_all else [row for row in rows if not row.survives or row.is_sensitive]
    lines = [
        f"{len(rows) - len(fallen)} of the published top {len(rows)} are among the 100 with the "
        f"best mean at level {level:g}.",
        "",
        f"{'rank':>4}  {'design':>6}  {'digits':8}  {'fitness':>7}  {'mean':>6}  {'std':>5}  "
        f"{'q10':>6}  {'retained':>8}  {'rank':>5}",
        f"{'':35}under noise",
    ]
    lines += [
        f"{row.rank:4}  {row.design:6}  {row.digits}  {row.fitness:7.2f}  {row.mean:6.2f}  "
        f"{row.std:5.2f}  {row.q10:6.2f}  {row.retained:8.0%}  {row.noisy_rank:5}"
        + ("  sensitive: falls over" if row.is_sensitive else "")
        + ("" if row.survives else "  out")
        for row in shown
    ]
    return "\n".join(lines)
