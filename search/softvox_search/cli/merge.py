"""softvox merge: the parts of an experiment merged into one folder of results."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_gym.cli.terminal import complain
from softvox_search.cli.own_code import look_in
from softvox_search.cli.results import check_report, make_folder, needs, report, warn, writing

DESCRIPTION = """\
Merge the parts of an experiment, from one or more folders that softvox compare
FILE.toml --part K/N has written, and write the report. The result has the same
bytes as that of a single softvox compare, except in manifest.json. If runs are
still missing, the others are kept, the exit status is 1, and the command that
does the missing ones is named.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "merge",
        help="merge the parts of an experiment",
        description=DESCRIPTION,
        usage="softvox merge DIR... --out ALL [options]",
    )
    parser.add_argument(
        "folders", type=Path, nargs="+", metavar="DIR", help="folders with the parts"
    )
    parser.add_argument("--out", type=Path, metavar="ALL", required=True, help="folder to write")
    parser.add_argument(
        "--force", action="store_true", help="delete earlier results in the folder first"
    )
    parser.add_argument("--no-report", action="store_true", help="write no report")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Copy the runs and write the summary; 1 if some are missing."""
    look_in(Path.cwd())
    with needs("merge"):
        from softvox_search.experiment.compare import merge
    if not args.no_report:
        check_report()
    make_folder(args.out)
    with writing(args.out):
        outcome = merge(args.folders, args.out, force=args.force, say=warn)
        if outcome.is_whole and not args.no_report:
            outcome.files += report(args.out)
    print(f"{outcome.total - outcome.missing} of {outcome.total} runs are in {args.out}")
    if outcome.missing:
        complain(
            "error",
            f"{outcome.missing} runs are missing; {outcome.command} --out {args.out} does them",
        )
        return 1
    print(f"wrote into {args.out}: {', '.join(outcome.files)}")
    return 0
