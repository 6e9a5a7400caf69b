"""Options of searchers, held against what they may be."""

from __future__ import annotations

from typing import Any

import numpy as np


def check_real(name: str, value: Any) -> None:
    """Refuse an option that is no number.

    Raises
    ------
    TypeError
    """
    is_number = isinstance(value, (int, float, np.integer, np.floating))
    if isinstance(value, (bool, np.bool_)) or not is_number:
        raise TypeError(f"{name} must be a number, got {value!r}")


def check_share(name: str, value: Any) -> None:
    """Refuse an option that is not a number from 0 to 1, such as a probability.

    Raises
    ------
    TypeError, ValueError
    """
    check_real(name, value)
    if not 0 <= value <= 1:
        raise ValueError(f"{name} must be from 0 to 1, got {value!r}")


def check_flag(name: str, value: Any) -> None:
    """Refuse an option that is not True or False.

    Raises
    ------
    TypeError
    """
    if not isinstance(value, bool):
        raise TypeError(f"{name} must be True or False, got {value!r}")
