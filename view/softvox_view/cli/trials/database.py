"""softvox trials check, merge, list and export: the folder of trials itself."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_gym.cli.terminal import bad_input
from softvox_gym.trials.database import faults, merge, read
from softvox_view.cli.trials.options import add_folders, add_into, folders_of


def add_parser(commands: Any) -> None:
    """Add the subcommands."""
    parser = commands.add_parser(
        "check",
        help="find every fault of a folder",
        description="Find every fault of folders of trials; the exit status is 1 where there is\n"
        "one.\n",
        usage="softvox trials check [DIR ...] [--shipped]",
    )
    add_folders(parser)
    parser.set_defaults(run=run_check, parser=parser)

    parser = commands.add_parser(
        "merge",
        help="put folders together",
        description="Copy the trials of folders into another. Trials that tell one run otherwise\n"
        "are refused, before anything is written.\n",
        usage="softvox trials merge FROM ... [--into DIR]",
    )
    parser.add_argument("folders", type=Path, nargs="+", metavar="FROM", help="folders of trials")
    add_into(parser)
    parser.set_defaults(run=run_merge, parser=parser)


def run_check(args: Namespace) -> int:
    """Print a line per fault, and how many trials there are."""
    found: list[str] = []
    with bad_input():
        for folder in folders_of(args):
            found += faults(folder)
        if not found:
            print(f"{len(read(*folders_of(args)))} trials, no fault")
    print("".join(f"{line}\n" for line in found), end="")
    return int(bool(found))


def run_merge(args: Namespace) -> int:
    """Copy what is new, and say how many."""
    with bad_input():
        added = merge(args.into, *args.folders)
    print(f"{len(added.new)} trials added to {args.into}, {len(added.known)} were there")
    return 0
