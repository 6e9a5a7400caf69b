"""What a browser may ask for: the parameters of every request."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Iterable, Mapping
from math import cos, inf, pi, sin
from typing import Any

import numpy as np

from softvox_gym import Physics
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.noise import tilted
from softvox_gym.physics import SPECS, ParameterError

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


_SHOWN = [
    (
        spec.name,
        spec.about.partition(",")[0].capitalize(),
        spec.unit.replace("^2", "²"),
        *spec.slider,
        spec.published,
    )
    for spec in SPECS
    if spec.slider
]
_TILT = ("tilt", "Tilt of the floor", "°", 0, 30, 0.5, 0.0)
_DOWNHILL = ("downhill", "Downhill towards", "°", -180, 180, 5, 0.0)

#: The sliders of the page, in order; the number beside one takes whatever the physics takes.
SLIDERS: list[dict[str, Any]] = [
    dict(zip(("name", "label", "unit", "low", "high", "step", "default"), row, strict=True))
    for row in (*_SHOWN, _TILT, _DOWNHILL)
]

#: What changes the physics.
PHYSICS = (*(slider["name"] for slider in SLIDERS), "actuation")


#: Bounds of whole numbers, and of what the physics does not check: an upright floor holds no robot.
WHOLE = {"seed": (0, 10**15), "budget": (1, MOST_BUDGET)}
DEGREES = {"tilt": 80, "downhill": 360}


def _value(name: str, text: str) -> Any:
    """Return what a parameter's text stands for."""
    if name in ("design", "compare"):
        try:
            return design_of(text, (2, 2, 2)).index
        except BadInputError as error:
            raise BadRequestError(str(error).partition(", which a")[0], name) from error
    if name in WHOLE:
        low, high = WHOLE[name]
        if re.fullmatch(r"[0-9]{1,18}", text) and low <= int(text) <= high:
            return int(text)
        raise BadRequestError(
            f"{name} must be a whole number from {low} to {high}, got {text[:60]!r}", name
        )
    if name not in PHYSICS or name == "actuation":
        return text
    try:
        value = float(text)
    except ValueError:
        raise BadRequestError(f"{name} must be a number, got {text[:60]!r}", name) from None
    most = DEGREES.get(name, inf)
    if most < inf and not abs(value) <= most:
        raise BadRequestError(
            f"{name} must be between {-most} and {most} degrees, got {text[:60]}", name
        )
    return value


def read(
    given: Mapping[str, str], *, needed: Iterable[str] = (), also: Iterable[str] = ()
) -> dict[str, Any]:
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
        For a value that can't be, or a name that is not expected.
    """
    names = (*needed, *also)
    for name in given:
        if name not in names:
            raise BadRequestError(
                f"there is no parameter {name[:60]!r}; the parameters are {', '.join(names)}", name
            )
    texts = {name: given.get(name, "") for name in needed} | dict(given)
    return {name: _value(name, text) for name, text in texts.items()}


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
        down = own.get("gravity", Physics.preset(PRESET).gravity)
        towards = changes.get("downhill", 0.0) * pi / 180
        own["gravity"] = tilted(
            np.array([[0.0, 0.0, down]]),
            np.array([tilt]),
            np.array([[cos(towards)], [sin(towards)]]),
        )[0]
    with _warnings, warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            physics = Physics.of({"preset": PRESET, **own})
        except ParameterError as error:
            raise BadRequestError(str(error), error.parameter) from error
    return physics, [str(warning.message) for warning in heard]
