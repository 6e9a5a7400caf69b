"""The landscape under any physics, and what changed against the published one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Physics, noisy_landscape, simulate
from softvox_gym.design import N_DESIGNS
from softvox_gym.outcome import body_facts
from softvox_view.tessellation import SIDE, design_at

#: How many of the fittest are compared.
TOP = 100

#: Landscapes that are kept, so that going back costs nothing.
KEPT = 16

#: Whose mean the map of noise shows.
NOISE_LEVEL = 1.0

COLUMNS = ("dx", "dy", "fitness")

#: dx, dy and fitness of every design, voxel widths, by name; NaN where diverged.
Values = Mapping[str, NDArray[np.float64]]

Progress = Callable[[int, int], None]


class Landscapes:
    """Computes landscapes and keeps the latest; safe to use from several threads."""

    def __init__(self) -> None:
        self._kept: dict[Physics, dict[str, Any]] = {}

    def at(self, physics: Physics, *, threads: int, progress: Progress | None) -> dict[str, Any]:
        """Return the values and the changes under some physics, ready for JSON."""
        kept = self._kept
        if physics not in kept:
            values = published()
            if physics != Physics.published():
                result = simulate(np.arange(N_DESIGNS), physics, threads=threads, progress=progress)
                columns = (*result.displacement.T[:2], result.fitness)
                values = dict(zip(COLUMNS, columns, strict=True))
            while len(kept) >= KEPT:
                kept.pop(next(iter(kept)), None)
            kept[physics] = {"values": as_lists(values), "changes": changes(values)}
        return kept[physics]


@lru_cache(maxsize=1)
def published() -> Values:
    """Return the landscape as published."""
    table = softvox_gym.landscape()
    return {name: np.ascontiguousarray(table[name]) for name in COLUMNS}


def listed(values: NDArray[np.float64]) -> list[float | None]:
    """Return numbers ready for JSON, which knows no NaN and no infinity."""
    return [value if isfinite(value) else None for value in values.tolist()]


def as_lists(values: Values) -> dict[str, list[float | None]]:
    """Return values ready for JSON; None where diverged."""
    return {name: listed(column) for name, column in values.items()}


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
    before, now = published()["fitness"], values["fitness"]
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
        **as_lists(published()),
    }
