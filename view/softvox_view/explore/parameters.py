"""What a browser may ask for, read and checked as the command line does."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from math import cos, isfinite, pi, sin
from typing import Any

import numpy as np

from softvox_gym import Design, Physics
from softvox_gym.design import N_DESIGNS, N_SITES
from softvox_gym.noise import tilted
from softvox_gym.physics import ACTUATIONS, SPECS

#: The physics that all changes start from.
PRESET = "published"

#: Degrees. A floor that stands upright holds no robot.
STEEPEST = 80.0


class BadRequestError(ValueError):
    """A request that can't be met.

    Parameters
    ----------
    message : str
        What was given, what was expected, and how to mend it.
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


def sliders() -> list[Slider]:
    """Return the sliders, in the order of the page."""
    preset = Physics.preset(PRESET)
    shown = [
        Slider(
            spec.name,
            spec.about.partition(",")[0].capitalize(),
            spec.unit.replace("^2", "²"),
            *spec.slider,
            default=float(getattr(preset, spec.name)),
        )
        for spec in SPECS
        if spec.slider
    ]
    tilt = Slider("tilt", "Tilt of the floor", "°", 0, 30, 0.5, 0.0)
    downhill = Slider("downhill", "Downhill towards", "°", -180, 180, 5, 0.0)
    return [*shown, tilt, downhill]


def about_sliders() -> list[dict[str, Any]]:
    """Return the sliders ready for JSON."""
    return [asdict(slider) for slider in sliders()]


_FLOOR = ("tilt", "downhill")
_NUMBERS = tuple(slider.name for slider in sliders())
NAMES = (*_NUMBERS, "actuation")


@dataclass(frozen=True)
class Conditions:
    """The physics that a request asks for.

    Parameters
    ----------
    physics : Physics
    changes : dict
        What differs from the preset, by name, numbers as float.
    warnings : tuple of str
        What the physics allows but thinks is rarely meant.
    """

    physics: Physics
    changes: dict[str, float | str]
    warnings: tuple[str, ...]

    @property
    def is_preset(self) -> bool:
        """Whether nothing is changed."""
        return not self.changes


def conditions(given: Mapping[str, Any]) -> Conditions:
    """Read the physics of a request.

    Parameters
    ----------
    given : mapping
        Numbers, or their text, by the names of `NAMES`; what is missing is as published.

    Raises
    ------
    BadRequestError
        For a name that is none of these, or a value that the physics refuses.
    """
    for name in given:
        if name not in NAMES:
            raise BadRequestError(
                f"there is no parameter {_shown(name)}; the parameters are {', '.join(NAMES)}", name
            )
    changes: dict[str, Any] = {
        name: given[name] if name == "actuation" else number(name, given[name])
        for name in NAMES
        if name in given
    }
    _check_actuation(changes)
    _check_floor(changes)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            physics = Physics.of({"preset": PRESET, **_engine_changes(changes)})
        except (TypeError, ValueError) as error:
            raise BadRequestError(str(error), _named_in(str(error))) from error
    return Conditions(physics, changes, tuple(str(one.message) for one in heard))


def _check_actuation(changes: Mapping[str, Any]) -> None:
    value = changes.get("actuation", ACTUATIONS[0])
    if value not in ACTUATIONS:
        raise BadRequestError(
            f"actuation must be one of {', '.join(ACTUATIONS)}, got {_shown(value)}", "actuation"
        )


def _check_floor(changes: Mapping[str, Any]) -> None:
    tilt, downhill = changes.get("tilt", 0.0), changes.get("downhill", 0.0)
    if not abs(tilt) <= STEEPEST:
        raise BadRequestError(
            f"tilt must be between {-STEEPEST:g} and {STEEPEST:g} degrees, got {tilt:g}", "tilt"
        )
    if not isfinite(downhill) or abs(downhill) > 360:
        raise BadRequestError(
            f"downhill must be between -360 and 360 degrees, got {downhill:g}", "downhill"
        )


def _engine_changes(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the changes as fields of the physics: a tilted floor is a tilted gravity."""
    own = {name: value for name, value in changes.items() if name not in _FLOOR}
    tilt = changes.get("tilt", 0.0) * pi / 180
    if tilt:
        gravity = own.get("gravity", Physics.preset(PRESET).gravity)
        towards = changes.get("downhill", 0.0) * pi / 180
        own["gravity"] = tilted(
            np.array([[0.0, 0.0, gravity]]),
            np.array([tilt]),
            np.array([[cos(towards)], [sin(towards)]]),
        )[0]
    return own


def _named_in(message: str) -> str | None:
    """Return the parameter that an error of the physics is about: the first that it names."""
    known = {f.name for f in fields(Physics)} & set(NAMES)
    return next((word for word in re.findall(r"\w+", message) if word in known), None)


def number(name: str, value: Any) -> float:
    """Read a number; whether it is finite and in bounds is for others to say.

    Raises
    ------
    BadRequestError
        For what is none.
    """
    if isinstance(value, (int, float, str)) and not isinstance(value, bool):
        try:
            return float(value)
        except (ValueError, OverflowError):
            pass
    raise BadRequestError(f"{name} must be a number, got {_shown(value)}", name)


def design(value: Any, name: str = "design") -> Design:
    """Read a design: a number, or eight digits.

    Raises
    ------
    BadRequestError
        For what is neither.
    """
    text = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
    if isinstance(text, str):
        if len(text) == N_SITES and not set(text) - set("012"):
            return Design(text)
        if re.fullmatch(r"0|[1-9][0-9]{0,3}", text) and int(text) < N_DESIGNS:
            return Design(int(text))
    raise BadRequestError(
        f"design {_shown(value)} is neither a number from 0 to {N_DESIGNS - 1} nor {N_SITES} "
        "digits 0, 1, 2",
        name,
    )


def whole(name: str, value: Any, *, least: int, most: int) -> int:
    """Read a whole number within bounds.

    Raises
    ------
    BadRequestError
        For anything else.
    """
    text = str(value) if not isinstance(value, bool) else ""
    if not re.fullmatch(r"[0-9]{1,18}", text) or not least <= int(text) <= most:
        raise BadRequestError(
            f"{name} must be a whole number from {least} to {most}, got {_shown(value)}", name
        )
    return int(text)


def client(value: Any) -> str:
    """Read the name that a browser tab gave itself.

    Raises
    ------
    BadRequestError
        For a name that is too long or odd.
    """
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z0-9-]{1,64}", value):
        return value
    raise BadRequestError(
        f"client must be 1 to 64 letters, digits or hyphens, got {_shown(value)}", "client"
    )


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
