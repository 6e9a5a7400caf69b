"""What a browser may ask for: the parameters of every request, each with what reads it."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from math import cos, pi, sin
from typing import Any

import numpy as np

from softvox_gym import Design, Physics
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.noise import tilted

#: The physics that all changes start from.
PRESET = "published"

#: Evaluations that a path may have: more would hide the map.
MOST_BUDGET = 2000

#: Python's filters of warnings are one for all threads.
_warnings = threading.Lock()


class BadRequestError(ValueError):
    """A request that can't be met.

    Parameters
    ----------
    message : str
        What was given, what was expected, and how to correct it.
    parameter : str, optional
        Which parameter is wrong, where it is one.
    """

    def __init__(self, message: str, parameter: str | None = None) -> None:
        super().__init__(message)
        self.parameter = parameter


@dataclass(frozen=True)
class Slider:
    """A parameter as the page shows it.

    Parameters
    ----------
    name : str
        Of `Physics`, or `tilt` or `downhill`.
    label, unit : str
    low, high, step : float
        Of the slider; the number beside it takes whatever the physics takes.
    default : float
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    default: float


_published = Physics.preset(PRESET)
SLIDERS = (
    Slider("friction_static", "Static friction", "", 0, 2, 0.05, _published.friction_static),
    Slider("friction_kinetic", "Kinetic friction", "", 0, 2, 0.05, _published.friction_kinetic),
    Slider("shear_strength", "Shear strength", "Pa", 0, 50_000, 500, _published.shear_strength),
    Slider("strain", "Strain", "", 0, 0.5, 0.005, _published.strain),
    Slider("frequency_hz", "Frequency", "Hz", 0.5, 12, 0.1, _published.frequency_hz),
    Slider("gravity", "Gravity", "m/s²", -25, 0, 0.1, _published.gravity),
    Slider("tilt", "Tilt of the floor", "°", 0, 30, 0.5, 0.0),
    Slider("downhill", "Downhill towards", "°", -180, 180, 5, 0.0),
)


def _design(name: str, text: str) -> int:
    try:
        return design_of(text, (2, 2, 2)).index
    except BadInputError as error:
        raise BadRequestError(str(error).partition(", which a")[0], name) from error


def _whole(low: int, high: int) -> Callable[[str, str], int]:
    def read(name: str, text: str) -> int:
        if not re.fullmatch(r"[0-9]{1,18}", text) or not low <= int(text) <= high:
            raise BadRequestError(
                f"{name} must be a whole number from {low} to {high}, got {text[:60]!r}", name
            )
        return int(text)

    return read


def _number(most: float = np.inf) -> Callable[[str, str], float]:
    def read(name: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise BadRequestError(f"{name} must be a number, got {text[:60]!r}", name) from None
        if most < np.inf and not abs(value) <= most:
            raise BadRequestError(
                f"{name} must be between {-most:g} and {most:g} degrees, got {text[:60]}", name
            )
        return value  # the physics says what else is out of bounds

    return read


def _text(name: str, text: str) -> str:
    return text


#: What reads each parameter. A floor that stands upright holds no robot.
READERS: dict[str, Callable[[str, str], Any]] = {
    "design": _design,
    "compare": _design,
    "results": _text,
    "searcher": _text,
    "seed": _whole(0, 10**15),
    "budget": _whole(1, MOST_BUDGET),
    **{slider.name: _number() for slider in SLIDERS},
    "tilt": _number(80),
    "downhill": _number(360),
    "actuation": _text,
}
PHYSICS = (*(slider.name for slider in SLIDERS), "actuation")


def read(given: Mapping[str, str], *, needed: Iterable[str] = (), also: Iterable[str] = ()) -> Any:
    """Read the parameters of a request.

    Parameters
    ----------
    given : mapping
        Texts by name.
    needed, also : iterable of str
        The names that there must be, and those that there may be besides.

    Returns
    -------
    dict
        Values by name, of those that are given.

    Raises
    ------
    BadRequestError
        For a value that its reader refuses, or a name that is not expected.
    """
    names = (*needed, *also)
    for name in given:
        if name not in names:
            raise BadRequestError(
                f"there is no parameter {name[:60]!r}; the parameters are {', '.join(names)}", name
            )
    values = {name: given.get(name, "") for name in needed} | dict(given)
    return {name: READERS[name](name, text) for name, text in values.items()}


def physics_of(changes: Mapping[str, Any]) -> tuple[Physics, list[str]]:
    """Return the physics with some changes, and what is allowed but rarely meant.

    Parameters
    ----------
    changes : mapping
        Values by the names of `PHYSICS`; a tilted floor is a tilted gravity.

    Raises
    ------
    BadRequestError
        For a value that the physics refuses.
    """
    own = {name: value for name, value in changes.items() if name not in ("tilt", "downhill")}
    if tilt := changes.get("tilt", 0.0) * pi / 180:
        gravity = np.array([[0.0, 0.0, own.get("gravity", _published.gravity)]])
        towards = changes.get("downhill", 0.0) * pi / 180
        own["gravity"] = tilted(
            gravity, np.array([tilt]), np.array([[cos(towards)], [sin(towards)]])
        )[0]
    with _warnings, warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            physics = Physics.of({"preset": PRESET, **own})
        except (TypeError, ValueError) as error:
            raise BadRequestError(str(error), _named_in(str(error))) from error
    return physics, [str(warning.message) for warning in heard]


def _named_in(message: str) -> str | None:
    """Return the parameter that an error of the physics is about: the first that it names."""
    known = {field.name for field in fields(Physics)} & set(PHYSICS)
    return next((word for word in re.findall(r"\w+", message) if word in known), None)


def designs_of(asked: Mapping[str, Any]) -> list[Design]:
    """Return the design that a request is about, and the one to compare it with."""
    return [Design(asked[name]) for name in ("design", "compare") if name in asked]
