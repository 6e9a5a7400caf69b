"""Folders of trials, which every subcommand of `softvox trials` reads or writes."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from softvox_gym.cli.terminal import bad_input
from softvox_gym.cli.trials import some_chosen
from softvox_gym.trials.database import read, shipped
from softvox_gym.trials.trial import Trial

#: Where trials are, unless something else is said; in the current folder.
DEFAULT = Path("trials")


def add_folders(parser: ArgumentParser) -> None:
    """Add the folders to read, and --shipped."""
    parser.add_argument(
        "folders",
        type=Path,
        nargs="*",
        metavar="DIR",
        help=f"folders of trials (default: {DEFAULT})",
    )
    parser.add_argument(
        "--shipped", action="store_true", help="add the trials that ship with the package"
    )


def add_into(parser: ArgumentParser) -> None:
    """Add --into, the folder to write."""
    parser.add_argument(
        "--into",
        type=Path,
        default=DEFAULT,
        metavar="DIR",
        help=f"folder of trials to add to, created if needed (default: {DEFAULT})",
    )


def folders_of(args: Namespace) -> list[Path]:
    """Return the folders that the options name; with --shipped, the default may be missing."""
    own = args.folders or ([] if args.shipped and not DEFAULT.exists() else [DEFAULT])
    return [*own, shipped()] if args.shipped else own


def read_folders(args: Namespace) -> tuple[Trial, ...]:
    """Read the trials that the options name, sorted by digest, each once.

    Raises
    ------
    BadInputError
        Where a folder is missing or has a fault.
    """
    with bad_input():
        return read(*folders_of(args))


def read_chosen(args: Namespace) -> list[Trial]:
    """Read the trials that the options name and choose; none where there are none.

    Raises
    ------
    BadInputError
        Where a folder is missing or has a fault, or none is chosen of those that there are.
    """
    every = read_folders(args)
    with bad_input():
        return some_chosen(every, args) if every else []
