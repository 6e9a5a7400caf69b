"""Options that name trials: --trials of commands that take them for real, and which of them."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from softvox_gym.cli.parser import add_cycles, number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import called
from softvox_gym.trials.database import read
from softvox_gym.trials.measured import MeasuredReality, from_trials
from softvox_gym.trials.trial import Trial

#: Options whose fact of a trial has to be as they say, and those of which a part may do.
EQUAL = {"source": "source", "kpa": "pressure_kpa", "hz": "frequency_hz"}
TEXTS = ("surface", "powder", "who")

#: What `add_filters` adds.
FILTERS = ("design", "lattice", "simulated_in", *EQUAL, *TEXTS)


def add_trials(parser: ArgumentParser) -> None:
    """Add --trials, --cycles and the filters."""
    group = parser.add_argument_group("trials", "of 2x2x2 designs, under the same conditions")
    group.add_argument(
        "--trials",
        type=Path,
        action="append",
        metavar="DIR",
        help="a folder of trials; may be given several times",
    )
    add_cycles(group)
    add_filters(group)


def add_filters(parser: Any) -> None:
    """Add options that choose among the trials."""
    parser.add_argument("--design", metavar="N", help="only this one, by number or digits")
    parser.add_argument("--lattice", metavar="NAME", help="only designs of this one, as 2x2x2")
    parser.add_argument("--source", choices=("measured", "simulated"), help="only these")
    parser.add_argument("--simulated-in", metavar="NAME", help="only those of this reality")
    parser.add_argument(
        "--surface",
        metavar="TEXT",
        help="only this one; where no trial has it, those that contain the text",
    )
    parser.add_argument("--powder", metavar="TEXT", help="the same; '' where none is said")
    for option, what in (("--kpa", "pressure"), ("--hz", "frequency")):
        words = f"only this {what} of the pump; '' where none is said"
        parser.add_argument(option, type=_number_or_none, metavar="X", help=words)
    parser.add_argument("--who", metavar="TEXT", help="only of this one, or as --surface")


def _number_or_none(text: str) -> float | str:
    """Read a number, or "" for none."""
    return number(text) if text else text


def measured_of(args: Namespace) -> MeasuredReality | None:
    """Return the reality of the trials that options of `add_trials` name; None without --trials.

    Raises
    ------
    BadInputError
        Where a folder can't be read, none is chosen, those can't be one reality, or other options
        of trials stand alone.
    """
    if args.trials is None:
        alone = [name for name in ("cycles", *FILTERS) if vars(args)[name] is not None]
        if alone:
            raise BadInputError(f"--{alone[0].replace('_', '-')} is of --trials; give it as well")
        return None
    with bad_input("--trials:"):
        return from_trials(some_chosen(read(*args.trials), args), cycles=args.cycles)


def some_chosen(trials: Sequence[Trial], args: Namespace) -> list[Trial]:
    """Return what `chosen` does; ValueError where that is none."""
    if not (made := chosen(trials, args)):
        raise ValueError(
            f"none of the {len(trials)} trials is as the options say; softvox trials list shows all"
        )
    return made


def chosen(trials: Sequence[Trial], args: Namespace) -> list[Trial]:
    """Return the trials that the options of `add_filters` choose; all where none is given."""
    given = ((name, vars(args)[name]) for name in TEXTS)
    texts = [_of_text(trials, name, text) for name, text in given if text is not None]
    return [
        trial
        for trial in trials
        if args.design in (None, str(called(trial.design)), trial.design.digits)
        and args.lattice in (None, str(trial.design.lattice))
        and args.simulated_in in (None, trial.reality)
        and all(
            vars(args)[name] in (None, getattr(trial, key) or "") for name, key in EQUAL.items()
        )
        and all(trial in some for some in texts)
    ]


def _of_text(trials: Sequence[Trial], name: str, text: str) -> set[Trial]:
    """Return the trials of which a text is that, whatever its case; where none is, has it in it."""
    own = {trial: getattr(trial, name).casefold() for trial in trials}
    wanted = text.casefold()
    exact = {trial for trial, value in own.items() if value == wanted}
    return exact or {trial for trial, value in own.items() if text and wanted in value}
