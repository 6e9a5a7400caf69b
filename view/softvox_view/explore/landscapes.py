"""The landscape under any physics, and what changed against the published one."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Physics, noisy_landscape, simulate
from softvox_gym.design import N_DESIGNS
from softvox_gym.outcome import body_facts
from softvox_view.explore.parameters import Conditions

#: How many of the fittest are compared.
TOP = 100

#: Landscapes that are kept, so that going back costs nothing.
KEPT = 16

#: Whose mean the map of noise shows.
NOISE_LEVEL = 1.0

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Values:
    """What became of every design.

    Parameters
    ----------
    dx, dy, fitness : ndarray, shape (6561,)
        Voxel widths; NaN where diverged.
    """

    dx: NDArray[np.float64]
    dy: NDArray[np.float64]
    fitness: NDArray[np.float64]

    def to_dict(self) -> dict[str, list[float | None]]:
        """Return it ready for JSON; None where diverged."""
        return {name: listed(values) for name, values in vars(self).items()}


class Landscapes:
    """Computes landscapes and keeps the latest; safe to use from several threads."""

    def __init__(self) -> None:
        self._kept: OrderedDict[Physics, Values] = OrderedDict()
        self._lock = threading.Lock()

    def at(self, wanted: Conditions, *, threads: int, progress: Progress | None = None) -> Values:
        """Return the landscape under some conditions; see `softvox_gym.simulate` for progress."""
        if wanted.is_preset:
            return published()
        with self._lock:
            if wanted.physics in self._kept:
                self._kept.move_to_end(wanted.physics)
                return self._kept[wanted.physics]
        result = simulate(np.arange(N_DESIGNS), wanted.physics, threads=threads, progress=progress)
        values = Values(result.displacement[:, 0], result.displacement[:, 1], result.fitness)
        with self._lock:
            self._kept[wanted.physics] = values
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return values


@lru_cache(maxsize=1)
def published() -> Values:
    """Return the landscape as published."""
    table = softvox_gym.landscape()
    return Values(*(np.ascontiguousarray(table[name]) for name in ("dx", "dy", "fitness")))


def listed(values: NDArray[np.float64]) -> list[float | None]:
    """Return numbers ready for JSON, which knows no NaN and no infinity."""
    return [value if isfinite(value) else None for value in values.tolist()]


def ranking(fitness: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return all designs, fittest first; of equals the lower number, and what diverged last."""
    return np.argsort(-np.nan_to_num(fitness, nan=-1.0), kind="stable")


def changes(values: Values) -> dict[str, Any]:
    """Return what changed against the published landscape, ready for JSON.

    Returns
    -------
    dict
        top : of how many of the fittest; stayed : how many of these are the same; best : the design
        that is now best, and best_before : the one that was, each with design, fitness,
        fitness_before, rank and rank_before; diverged : how many; mean_difference : over all
        designs that did not, voxel widths.
    """
    before = published().fitness
    order, order_before = ranking(values.fitness), ranking(before)
    rank, rank_before = np.argsort(order), np.argsort(order_before)

    def standing(design: int) -> dict[str, Any]:
        return {
            "design": design,
            "fitness": listed(values.fitness[[design]])[0],
            "fitness_before": float(before[design]),
            "rank": int(rank[design]) + 1,
            "rank_before": int(rank_before[design]) + 1,
        }

    is_ok = np.isfinite(values.fitness)
    difference = (values.fitness - before)[is_ok]
    return {
        "top": TOP,
        "stayed": len(set(order[:TOP].tolist()) & set(order_before[:TOP].tolist())),
        "best": standing(int(order[0])),
        "best_before": standing(int(order_before[0])),
        "diverged": int(N_DESIGNS - is_ok.sum()),
        "mean_difference": float(difference.mean()) if len(difference) else None,
    }


@lru_cache(maxsize=1)
def atlas() -> dict[str, Any]:
    """Return all that the page knows from the start, ready for JSON.

    Returns
    -------
    dict
        cells : the design of every cell of the map, row by row from the bottom; n_voxels, n_active,
        is_connected, noise (mean fitness under noise) and dx, dy, fitness, by design.
    """
    from softvox_view.tessellation import SIDE, design_at

    bodies = body_facts()
    row, column = np.divmod(np.arange(N_DESIGNS), SIDE)
    return {
        "side": SIDE,
        "cells": np.asarray(design_at(row, column)).tolist(),
        "n_voxels": bodies.n_voxels.tolist(),
        "n_active": bodies.n_active.tolist(),
        "is_connected": bodies.is_connected.tolist(),
        "noise": listed(noisy_landscape(NOISE_LEVEL)["mean"]),
        "noise_level": NOISE_LEVEL,
        **published().to_dict(),
    }
