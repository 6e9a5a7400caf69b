"""softvox leaderboard: a ranking of searchers, from folders of results."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_search.cli.results import needs, warn

DESCRIPTION = """\
Rank the searchers in folders of results, best first, in a table per problem
(physics, shape, level of noise). A run that is in several folders counts once.
  value   median, over runs, of the recommended design's fitness without noise,
          voxel widths; best is the largest of them
  regret  difference of the median to the optimum, voxel widths
  found   share of the runs that evaluated an optimal design
  ert     expected number of evaluations until then, not counting cached ones
regret, found and ert are shown where the optimum is known: on 2x2x2, with
several phases only if that landscape is on this machine. Searchers that share a
label but differ in settings have a row each, which shows the settings.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "leaderboard",
        help="rank searchers, from folders of results",
        description=DESCRIPTION,
        usage="softvox leaderboard RESULTS... [--json | --csv]",
    )
    parser.add_argument(
        "results", type=Path, nargs="+", metavar="RESULTS", help="folders of softvox compare"
    )
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print JSON")
    form.add_argument("--csv", action="store_true", help="print CSV")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Read the folders and print the table."""
    with needs("leaderboard"):
        from softvox_search.experiment.results import read
        from softvox_search.leaderboard import as_json, as_text, leaderboard

        table, notes = leaderboard([read(folder) for folder in args.results])
    for note in notes:
        warn(note)
    if args.csv:
        print(table.to_csv(index=False), end="")
    else:
        print(as_json(table) if args.json else as_text(table))
    return 0
