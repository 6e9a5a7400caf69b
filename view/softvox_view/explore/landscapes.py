"""The landscape under any physics, and what changed against the published one."""

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

#: How many of the fittest are compared.
TOP = 100

#: Landscapes that are kept, so that going back costs nothing.
KEPT = 16

#: Whose mean the map of noise shows.
NOISE_LEVEL = 1.0


class Landscapes:
    """Computes landscapes and keeps the latest; safe to use from several threads."""

    def __init__(self) -> None:
        self._kept: dict[Physics, dict[str, Any]] = {}

    def at(
        self, physics: Physics, *, threads: int, progress: Progress | None = None
    ) -> dict[str, Any]:
        """Return the values and the changes under some physics, ready for JSON."""
        kept = self._kept
        if physics not in kept:
            is_published = physics == Physics.published()
            table = (
                softvox_gym.landscape()
                if is_published
                else compute(physics, threads=threads, progress=progress)
            )
            while len(kept) >= KEPT:
                kept.pop(next(iter(kept)), None)
            kept[physics] = {"values": values(table), "changes": changes(table)}
        return kept[physics]


def listed(numbers: NDArray[np.float64]) -> list[float | None]:
    """Return numbers ready for JSON, which knows no NaN and no infinity."""
    return [number if isfinite(number) else None for number in numbers.tolist()]


def values(table: Table) -> dict[str, list[float | None]]:
    """Return displacement and fitness of every design ready for JSON; None where diverged."""
    return {name: listed(table[name]) for name in ("dx", "dy", "fitness")}


def ranking(fitness: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return all designs, fittest first; of equals the lower number, and what diverged last."""
    return np.argsort(-np.nan_to_num(fitness, nan=-1.0), kind="stable")


def changes(table: Table) -> dict[str, Any]:
    """Return what changed against the published landscape, ready for JSON.

    Returns
    -------
    dict
        top : of how many of the fittest; stayed : how many of these are the same; best : the design
        that is now best, and best_before : the one that was, each with design, fitness,
        fitness_before, rank and rank_before; diverged : how many; mean_difference : over all
        designs that did not, voxel widths.
    """
    before, now = softvox_gym.landscape()["fitness"], table["fitness"]
    order, order_before = ranking(now), ranking(before)
    rank, rank_before = np.argsort(order), np.argsort(order_before)

    def standing(design: int) -> dict[str, Any]:
        return {
            "design": design,
            "fitness": listed(now[[design]])[0],
            "fitness_before": float(before[design]),
            "rank": int(rank[design]) + 1,
            "rank_before": int(rank_before[design]) + 1,
        }

    is_ok = np.isfinite(now)
    difference = (now - before)[is_ok]
    return {
        "top": TOP,
        "stayed": len(set(order[:TOP].tolist()) & set(order_before[:TOP].tolist())),
        "best": standing(int(order[0])),
        "best_before": standing(int(order_before[0])),
        "diverged": int((~is_ok).sum()),
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
    table = softvox_gym.landscape()
    row, column = np.divmod(np.arange(len(table)), SIDE)
    return {
        "side": SIDE,
        "cells": np.asarray(design_at(row, column)).tolist(),
        **{name: table[name].tolist() for name in ("n_voxels", "n_active", "is_connected")},
        "noise": listed(noisy_landscape(NOISE_LEVEL)["mean"]),
        "noise_level": NOISE_LEVEL,
        **values(table),
    }
