"""softvox export: results in the formats of other tools."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_gym.cli.terminal import bad_input
from softvox_gym.files import check_folder
from softvox_search.cli.results import make_folder, needs

DESCRIPTION = """\
Write the results of softvox compare in the format of IOHprofiler, which
IOHanalyzer and iohinspector read: a folder per searcher and policy, with a JSON
file and a data file per level of noise. Instances are the physics and shapes of
the experiment, listed in instances.csv; the dimension is the number of sites;
raw_y is the fitness that the searcher received, in voxel widths.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "export",
        help="write results for IOHprofiler's tools",
        description=DESCRIPTION,
        usage="softvox export RESULTS --out DIR [--format ioh] [--force]",
    )
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder of softvox compare")
    parser.add_argument("--format", choices=("ioh",), default="ioh", help="format (default: ioh)")
    parser.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder to write")
    parser.add_argument("--force", action="store_true", help="allow a DIR that has other files")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Read the results and write them."""
    with needs("export"):
        from softvox_search.experiment.results import read
        from softvox_search.export import ioh

        results = read(args.results)
    make_folder(args.out)
    with bad_input("--out"):
        check_folder(args.out, (), force=args.force)
        files = ioh(results, args.out)
    print(f"wrote into {args.out}: {len(files)} files of {len(results.runs)} runs")
    return 0
