"""What a browser may ask for: the parameters of every request."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterable, Mapping
from math import cos, pi, sin
from typing import Any

import numpy as np

from softvox_gym import Physics
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.noise import tilted
from softvox_gym.physics import SPECS, Bounds, ParameterError, ParameterSpec

#: Python's filters of warnings are one for all threads.
_warnings = threading.Lock()


class _Whole(Bounds):
    def hold(self, value: Any) -> Any:
        return super().hold(value) & (np.trunc(value) == value)


def _degrees(name: str, most: int, about: str, slider: tuple[float, float, float]) -> ParameterSpec:
    bounds = Bounds(f"between {-most} and {most} degrees", -most, most, "[]")
    return ParameterSpec(0.0, "°", bounds, about, 0.0, slider, name=name)


def _whole(name: str, low: int, high: int) -> ParameterSpec:
    bounds = _Whole(f"a whole number from {low} to {high}", low, high, "[]")
    return ParameterSpec(low, "", bounds, name, name=name)


#: What has a slider; an upright floor holds no robot.
_SHOWN = [
    *(spec for spec in SPECS if spec.slider),
    _degrees("tilt", 80, "tilt of the floor", (0, 30, 0.5)),
    _degrees("downhill", 360, "downhill towards", (-180, 180, 5)),
]

#: More than 2000 evaluations would hide the map.
_NUMBERS = {
    spec.name: spec for spec in (*_SHOWN, _whole("seed", 0, 10**15), _whole("budget", 1, 2000))
}

#: The sliders of the page, in order; the number beside one takes whatever the physics takes.
SLIDERS: list[dict[str, Any]] = [
    {
        "name": spec.name,
        "label": spec.about.partition(",")[0].capitalize(),
        "unit": spec.unit.replace("^2", "²"),
        **dict(zip(("min", "max", "step"), spec.slider or (), strict=True)),
        "standard": f"{spec.published:.5g}",
    }
    for spec in _SHOWN
]

#: What changes the physics.
PHYSICS = (*(spec.name for spec in _SHOWN), "actuation")


def _value(name: str, text: str) -> Any:
    """Return what a parameter's text stands for."""
    if name in ("design", "compare"):
        try:
            return design_of(text, (2, 2, 2)).index
        except BadInputError:
            must = "is neither a number from 0 to 6560 nor 8 digits 0, 1, 2"
            raise ParameterError(name, f"{text[:40]!r} {must}") from None
    if name not in _NUMBERS:
        return text
    try:
        number = float(text)
    except ValueError:
        raise ParameterError(name, f"must be a number, got {text[:60]!r}") from None
    return _NUMBERS[name].checked(number)


def read(
    given: Mapping[str, str], *, needed: Iterable[str] = (), also: Iterable[str] = ()
) -> dict[str, Any]:
    """Return the values of a request by name: those needed, and those that there may be besides.

    Raises
    ------
    ParameterError
        For a value that can't be, or a name that is not expected.
    """
    texts = {**dict.fromkeys(needed, ""), **given}
    names = (*needed, *also)
    for name in texts:
        if name not in names:
            known = ", ".join(names)
            raise ParameterError(name[:60], f"is no parameter; the parameters are {known}")
    return {name: _value(name, text) for name, text in texts.items()}


def physics_of(changes: Mapping[str, Any]) -> tuple[Physics, list[str]]:
    """Return the physics with some changes, and what is allowed but rarely meant.

    Parameters
    ----------
    changes : mapping
        Values by the names of `PHYSICS`; a tilted floor is a tilted gravity.

    Raises
    ------
    ParameterError
        For a value that the physics refuses.
    """
    own = {name: value for name, value in changes.items() if name not in ("tilt", "downhill")}
    if tilt := changes.get("tilt", 0.0) * pi / 180:
        down = own.get("gravity", Physics.published().gravity)
        towards = changes.get("downhill", 0.0) * pi / 180
        own["gravity"] = tilted(
            np.array([[0.0, 0.0, down]]),
            np.array([tilt]),
            np.array([[cos(towards)], [sin(towards)]]),
        )[0]
    with _warnings, warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        physics = Physics.of({"preset": "published", **own})
    return physics, [str(warning.message) for warning in heard]
