"""Folders of trials, which every subcommand of `softvox trials` reads or writes."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.trials.database import read, shipped
from softvox_gym.trials.trial import Trial

#: Texts of a trial by which it may be chosen.
FILTERS = {
    "surface": "what the robot stood on",
    "powder": "what lay on it; '' for nothing",
    "source": "measured or simulated",
    "simulated-in": "the reality that a simulated one is of",
    "who": "who ran it",
}

#: Of the values that there are, an error names at most so many.
SHOWN = 9

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
        "--shipped", action="store_true", help="also the trials that ship with the package"
    )


def add_into(parser: ArgumentParser) -> None:
    """Add --into, the folder to write."""
    parser.add_argument(
        "--into",
        type=Path,
        default=DEFAULT,
        metavar="DIR",
        help=f"the folder, which is made where there is none (default: {DEFAULT})",
    )


def add_filters(parser: ArgumentParser) -> None:
    """Add options that choose among the trials."""
    group = parser.add_argument_group(
        "which trials", "Each may be given several times, for trials that have one of the values."
    )
    group.add_argument("--design", action="append", metavar="N", help="number or digits")
    for name, about in FILTERS.items():
        group.add_argument(f"--{name}", action="append", metavar="TEXT", help=about)


def chosen(args: Namespace, trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the trials that the options of `add_filters` choose.

    Raises
    ------
    BadInputError
        Where none is left, naming what there is instead.
    """
    kept = tuple(trials)
    if not kept:
        raise BadInputError("the folders hold no trials; softvox trials add makes some")
    for name in ("design", *FILTERS):
        if wanted := vars(args)[name.replace("-", "_")]:
            there = kept
            kept = tuple(trial for trial in there if _values(trial, name) & {*wanted})
            if not kept:
                known = sorted({min(_values(trial, name)) for trial in there})
                more = ", ..." if len(known) > SHOWN else ""
                raise BadInputError(
                    f"no trial has --{name} {' or '.join(map(repr, wanted))}; of those there are, "
                    f"it is {', '.join(map(repr, known[:SHOWN]))}{more}"
                )
    return kept


def _values(trial: Trial, name: str) -> set[str]:
    """Return what may be given for a trial to be chosen."""
    if name == "design":
        return {str(trial.design.index), trial.design.digits}
    return {trial.reality if name == "simulated-in" else getattr(trial, name)}


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
