"""softvox trials: runs of robots, kept as small files and compared with the simulator.

Each of `SUBCOMMANDS` is a module with `add_parser(commands)`, which sets `run` and `parser` as a
command's does, and is cheap to import.
"""

from __future__ import annotations

from argparse import Namespace
from functools import partial
from typing import Any

from softvox_gym.cli.parser import Parser
from softvox_view.cli.trials import add, compare, database, next

SUBCOMMANDS = (add, database, compare, next)

DESCRIPTION = """\
Keep runs of robots, real or simulated, in a folder of small text files, one per
trial. Each file is named by the digest of its content, so folders can be merged
and kept under version control (docs/trials-database.md).
"""


def add_parser(commands: Any) -> None:
    """Add the command with its subcommands."""
    parser = commands.add_parser(
        "trials",
        help="keep runs of real robots, and compare them with the simulator",
        description=DESCRIPTION,
        usage="softvox trials SUBCOMMAND [options]",
        epilog="softvox trials SUBCOMMAND --help describes a subcommand and its options.",
    )
    parser.set_defaults(run=partial(_help, parser), parser=parser)
    subcommands = parser.add_subparsers(
        title="subcommands", metavar="SUBCOMMAND [options]", prog="softvox trials"
    )
    for module in SUBCOMMANDS:
        module.add_parser(subcommands)


def _help(parser: Parser, args: Namespace) -> int:
    parser.print_help()
    return 2
