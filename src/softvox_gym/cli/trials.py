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

#: Options whose fact of a trial has to be as they say, and those whose text it has to contain.
EQUAL = {"source": "source", "kpa": "pressure_kpa", "hz": "frequency_hz"}
CONTAINED = ("surface", "powder", "who")

#: What `add_filters` adds.
FILTERS = ("design", "lattice", "simulated_in", *EQUAL, *CONTAINED)


def add_trials(parser: ArgumentParser) -> None:
    """Add --trials, --cycles and the filters."""
    group = parser.add_argument_group("trials", "They must be of 2x2x2 designs and one condition.")
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
    parser.add_argument("--design", metavar="N", help="only this design, a number or digits")
    parser.add_argument("--lattice", metavar="NAME", help="only designs of this lattice, as 2x2x2")
    parser.add_argument(
        "--source", choices=("measured", "simulated"), help="only trials of this source"
    )
    parser.add_argument("--simulated-in", metavar="NAME", help="only trials of this reality")
    parser.add_argument("--surface", metavar="TEXT", help="only surfaces that contain TEXT")
    parser.add_argument("--powder", metavar="TEXT", help="only powders that contain TEXT")
    parser.add_argument("--kpa", type=number, metavar="X", help="only this pressure of the pump")
    parser.add_argument("--hz", type=number, metavar="X", help="only this frequency of the pump")
    parser.add_argument("--who", metavar="TEXT", help="only trials by people whose name has TEXT")


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
            raise BadInputError(
                f"--{alone[0].replace('_', '-')} needs --trials DIR; give that as well"
            )
        return None
    with bad_input("--trials:"):
        return from_trials(some_chosen(read(*args.trials), args), cycles=args.cycles)


def some_chosen(trials: Sequence[Trial], args: Namespace) -> list[Trial]:
    """Return what `chosen` does; ValueError where that is none."""
    if not (made := chosen(trials, args)):
        raise ValueError(
            f"none of the {len(trials)} trials matches the options; softvox trials list shows all"
        )
    return made


def chosen(trials: Sequence[Trial], args: Namespace) -> list[Trial]:
    """Return the trials that the options of `add_filters` choose; all where none is given."""
    return [
        trial
        for trial in trials
        if args.design in (None, str(called(trial.design)), trial.design.digits)
        and args.lattice in (None, str(trial.design.lattice))
        and args.simulated_in in (None, trial.reality)
        and all(vars(args)[name] in (None, getattr(trial, key)) for name, key in EQUAL.items())
        and all(
            (vars(args)[name] or "").casefold() in getattr(trial, name).casefold()
            for name in CONTAINED
        )
    ]
