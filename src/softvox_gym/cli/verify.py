"""softvox verify: compare this build with reference data."""

from __future__ import annotations

import json
from argparse import Namespace
from dataclasses import asdict
from math import isfinite
from typing import Any

import softvox_gym
from softvox_gym import engine
from softvox_gym.cli.parser import add_threads
from softvox_gym.cli.terminal import bad_input
from softvox_gym.verify import checks
from softvox_gym.verify.agreement import EXCEPTED, Row

DESCRIPTION = """\
Compare this build with the published top 100, with data measured from the
authors' own engine, and with itself on every instruction set of this machine,
and print the agreement table. "largest" is the largest difference in any
coordinate, in voxel widths. Takes a few seconds.

linkless   designs in which no two voxels touch; for these the authors' engine
           took a tenth of the time step (dt/10)
sensitive  designs that fall over; for these the authors' engine, compiled
           again, differs from itself by up to 0.25

verdicts:
ok          all designs are within the limit
known       one design is outside the limit, for the reason given, and within a
            limit of its own
not judged  reported only, because the authors' engine differs from itself
FAILED      a design is outside its limit; the exit status is 1
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "verify",
        help="compare this build with the published table and reference data",
        description=DESCRIPTION,
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    add_threads(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Print the table as it is computed; return 0 if nothing failed, else 1."""
    with bad_input():
        isa = engine.isa_name()
    rows: list[Row] = []
    if not args.json:
        print(f"softvox {softvox_gym.__version__} ({isa}) against the paper and its engine\n")
        print(HEAD, flush=True)
    for row in checks(threads=args.threads):
        rows.append(row)
        if not args.json:
            print(as_text(row), flush=True)
    failed = sum(not row.passed for row in rows)
    if args.json:
        print(as_json(rows, isa))
    elif failed:
        print(f"\n{failed} of {len(rows)} rows FAILED")
    else:
        known = sum(row.verdict == EXCEPTED for row in rows)
        print("\nThis build agrees" + (f", but for {known} known differences." if known else "."))
    return 1 if failed else 0


HEAD = f"{'':20} {'agree':>9}  {'largest':>7}  {'limit':>7}  verdict"


def as_text(row: Row) -> str:
    """Return a row as a line."""
    largest = "" if row.largest is None else f"{row.largest:.1e}"
    limit = "" if row.tolerance is None else f"{row.tolerance:.1e}"
    count = f"{row.agree}/{row.compared}"
    verdict = row.verdict + (f": {row.note}" if row.note else "")
    return f"{row.name:20} {count:>9}  {largest:>7}  {limit:>7}  {verdict}"


def as_json(rows: list[Row], isa: str) -> str:
    """Return the table as JSON; null for a difference that is NaN."""
    table = [asdict(row) for row in rows]
    for row in table:
        row["largest"] = row["largest"] if isfinite(row["largest"] or 0.0) else None
    data = {
        "version": softvox_gym.__version__,
        "instruction_set": isa,
        "passed": all(row.passed for row in rows),
        "rows": table,
    }
    return json.dumps(data, indent=2, allow_nan=False)
