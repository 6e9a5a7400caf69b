"""The landscape under any physics, ready for the page."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Physics
from softvox_gym.engine import Progress
from softvox_gym.landscapes import Table
from softvox_gym.landscapes.table import compute

#: Landscapes that are kept, so that going back costs nothing.
KEPT = 16

#: Displacement and fitness of every design by name, None where it diverged.
Values = dict[str, list[float | None]]

_kept: dict[Physics, Values] = {}


def landscape(physics: Physics, *, threads: int | None, progress: Progress) -> Values:
    """Return the landscape under some physics; the latest are kept."""
    if physics == Physics.published():
        return values_of(softvox_gym.landscape())
    if physics not in _kept:
        values = values_of(compute(physics, threads=threads, progress=progress))
        while len(_kept) >= KEPT:
            _kept.pop(next(iter(_kept)), None)
        _kept[physics] = values
    return _kept[physics]


def values_of(table: Table) -> Values:
    """Return what the page shows of a landscape."""
    return {name: listed(table[name]) for name in ("dx", "dy", "fitness")}


def listed(numbers: NDArray[np.float64]) -> list[float | None]:
    """Return numbers ready for JSON, which knows no NaN and no infinity."""
    return [number if isfinite(number) else None for number in numbers.tolist()]
