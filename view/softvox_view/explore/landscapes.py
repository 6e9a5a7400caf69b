"""The landscape under any physics, ready for the page."""

from __future__ import annotations

from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Physics, noisy_landscape
from softvox_gym.engine import Progress
from softvox_gym.landscapes import Table
from softvox_gym.landscapes.table import compute
from softvox_view.tessellation import SIDE, design_at

#: Landscapes that are kept, so that going back costs nothing.
KEPT = 16

#: Whose mean the map of noise shows.
NOISE_LEVEL = 1.0

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


@lru_cache(maxsize=1)
def atlas() -> dict[str, Any]:
    """Return all that the page knows from the start.

    Returns
    -------
    dict
        cells : the design of every cell of the map, row by row from the bottom; n_voxels, n_active,
        is_connected, noise (mean fitness under noise) and dx, dy, fitness, by design.
    """
    table = softvox_gym.landscape()
    row, column = np.divmod(np.arange(len(table)), SIDE)
    return {
        "side": SIDE,
        "cells": design_at(row, column).tolist(),
        **{name: table[name].tolist() for name in ("n_voxels", "n_active", "is_connected")},
        "noise": listed(noisy_landscape(NOISE_LEVEL)["mean"]),
        "noise_level": NOISE_LEVEL,
        **values_of(table),
    }
