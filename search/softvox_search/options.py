"""Options of searchers, held against what they may be."""

from __future__ import annotations

from typing import Any

import numpy as np

_REAL = (int, float, np.integer, np.floating)


def whole(name: str, value: Any, *, least: int = 1) -> int:
    """Return an option that must be a whole number.

    Parameters
    ----------
    name : str
        What the option is called, for the error.
    value
        What was given.
    least : int
        The smallest that it may be.

    Raises
    ------
    TypeError
        Where it is no whole number.
    ValueError
        Where it is smaller than `least`.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} must be a whole number, got {value!r}")
    if value < least:
        raise ValueError(f"{name} must be at least {least}, got {value}")
    return int(value)


def share(name: str, value: Any) -> float:
    """Return an option that must be a number from 0 to 1, such as a probability.

    Parameters
    ----------
    name : str
        What the option is called, for the error.
    value
        What was given.

    Raises
    ------
    TypeError
        Where it is no number.
    ValueError
        Where it is outside 0 ... 1, or NaN.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, _REAL):
        raise TypeError(f"{name} must be a number from 0 to 1, got {value!r}")
    if not 0 <= value <= 1:
        raise ValueError(f"{name} must be from 0 to 1, got {value!r}")
    return float(value)
