"""Options for trials: their folders, filters, and the cycles that are compared."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from softvox_gym.cli.parser import add_several, number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import called
from softvox_gym.real_tracks import MOST_CYCLES
from softvox_gym.trials.database import read, shipped
from softvox_gym.trials.measured import MeasuredReality, from_trials, pair
from softvox_gym.trials.trial import Trial

#: Default folder of trials, in the current folder.
DEFAULT = Path("trials")

#: Options that must equal a fact of a trial, and options that may also be contained in it.
EQUAL = {"source": "source", "kpa": "pressure_kpa", "hz": "frequency_hz", "simulated_in": "reality"}
TEXTS = ("surface", "powder", "who")

#: What `add_filters` adds.
FILTERS = ("design", "lattice", *EQUAL, *TEXTS)


def add_trials(parser: ArgumentParser) -> None:
    """Add --trials, --cycles and the filters."""
    group = parser.add_argument_group("trials", "They must be of 2x2x2 designs and one condition.")
    add_several(group, "--trials", "DIR", "a folder of trials")
    add_cycles(group)
    add_filters(group)


def add_folders(parser: ArgumentParser) -> None:
    """Add the folders to read, and --shipped."""
    parser.add_argument(
        "folders",
        type=Path,
        nargs="*",
        metavar="DIR",
        help=f"folders of trials (default: {DEFAULT})",
    )
    add_shipped(parser)


def add_shipped(parser: ArgumentParser) -> None:
    """Add --shipped."""
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


def add_cycles(parser: Any) -> None:
    """Add --cycles."""
    parser.add_argument(
        "--cycles",
        type=cycles,
        metavar="N",
        help="compare real and simulated robots after N cycles, or after REAL:SIMULATED, as 90:23 "
        "(default: as many as the shortest run has)",
    )


def cycles(text: str) -> tuple[float, float]:
    """Read the cycles after which robots are compared: N, or REAL:SIMULATED."""
    parts = [number(part) for part in text.split(":")]
    try:
        return pair(parts)
    except ValueError:
        raise ArgumentTypeError(
            f"must be N or REAL:SIMULATED, above 0 and at most {MOST_CYCLES}, got {text}"
        ) from None


def add_filters(parser: Any) -> None:
    """Add options that select trials."""
    parser.add_argument("--design", metavar="N", help="only this design, a number or digits")
    parser.add_argument("--lattice", metavar="NAME", help="only designs of this lattice, as 2x2x2")
    parser.add_argument(
        "--source", choices=("measured", "simulated"), help="only trials of this source"
    )
    parser.add_argument("--simulated-in", metavar="NAME", help="only trials of this reality")
    parser.add_argument(
        "--surface",
        metavar="TEXT",
        help="only this surface, or if no trial has it, surfaces that contain TEXT",
    )
    parser.add_argument("--powder", metavar="TEXT", help="likewise; '' for trials without one")
    for option, what in (("--kpa", "pressure"), ("--hz", "frequency")):
        words = f"only this {what} of the pump; '' for trials without one"
        parser.add_argument(option, type=_number_or_none, metavar="X", help=words)
    parser.add_argument("--who", metavar="TEXT", help="only trials by these people, likewise")


def _number_or_none(text: str) -> float | str:
    """Read a number, or "" for none."""
    return number(text) if text else text


def measured_of(args: Namespace) -> MeasuredReality | None:
    """Return the reality made from the trials of the options; None without --trials.

    Raises
    ------
    BadInputError
        If a folder can't be read, no trial is selected, the trials can't form one reality, or
        filters are given without --trials.
    """
    if not args.trials:
        alone = [name for name in ("cycles", *FILTERS) if vars(args)[name] is not None]
        if alone:
            raise BadInputError(
                f"--{alone[0].replace('_', '-')} needs --trials DIR; give that as well"
            )
        return None
    with bad_input("--trials:"):
        return from_trials(_some_chosen(read(*args.trials), args), cycles=args.cycles)


def folders_of(args: Namespace) -> list[Path]:
    """Return the folders of `add_folders`; with --shipped, the default one may be missing."""
    own = args.folders or ([] if args.shipped and not DEFAULT.exists() else [DEFAULT])
    return [*own, shipped()] if args.shipped else own


def read_chosen(args: Namespace) -> list[Trial]:
    """Read the trials that the options select; none if the folders have none.

    Raises
    ------
    BadInputError
        If a folder is missing or has a fault, or the options select none of its trials.
    """
    with bad_input():
        return _some_chosen(read(*folders_of(args)), args)


def _some_chosen(trials: Sequence[Trial], args: Namespace) -> list[Trial]:
    """Return what `chosen` does; ValueError if it selects none of the trials."""
    made = chosen(trials, args)
    if trials and not made:
        raise ValueError(
            f"none of the {len(trials)} trials matches the options; softvox trials list shows all"
        )
    return made


def chosen(trials: Sequence[Trial], args: Namespace) -> list[Trial]:
    """Return the trials that the options of `add_filters` select; all without options."""
    given = ((name, vars(args)[name]) for name in TEXTS)
    texts = [_of_text(trials, name, text) for name, text in given if text is not None]
    return [
        trial
        for trial in trials
        if args.design in (None, str(called(trial.design)), trial.design.digits)
        and args.lattice in (None, str(trial.design.lattice))
        and all(
            vars(args)[name] in (None, getattr(trial, key) or "") for name, key in EQUAL.items()
        )
        and all(trial in some for some in texts)
    ]


def _of_text(trials: Sequence[Trial], name: str, text: str) -> set[Trial]:
    """Return the trials with this text, in any case; if there are none, those that contain it."""
    own = {trial: getattr(trial, name).casefold() for trial in trials}
    wanted = text.casefold()
    exact = {trial for trial, value in own.items() if value == wanted}
    return exact or {trial for trial, value in own.items() if text and wanted in value}
