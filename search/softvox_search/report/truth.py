"""The known landscapes with which runs are compared, without noise and with."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Lattice, Physics, Reality
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.landscapes.analysis.phased import best_of_class
from softvox_gym.landscapes.table import LATTICE, known

Array = NDArray[np.float64]

#: Each design counts by itself; or a robot turned or mirrored counts as the same robot.
TERMS = ("raw", "class")

#: Anything that `Physics.of` accepts.
AnyPhysics = str | Mapping[str, Any] | Physics


def exact_fitness(
    physics: AnyPhysics = "published", lattice: Lattice = LATTICE
) -> dict[str, Array] | None:
    """Return the noise-free fitness of every 2x2x2 design in each of `TERMS`.

    None if it is not known: for several phases only what ships, or was computed here before.

    In class terms a design has the best fitness of its symmetry class (turned about the vertical,
    mirrored). The model is not symmetric: a searcher that found 5757 (3.90) has found the best
    robot, 6453 (4.66), turned by a quarter. Voxel widths, shape (6561,); 0 if a design diverges.
    """
    if lattice == LATTICE:
        return _exact_fitness(Physics.of(physics))
    reality = Reality.of(physics)
    if lattice[:] != LATTICE or known(reality, lattice) is None:
        return None
    return _phased_fitness(reality, lattice)


@lru_cache(maxsize=2)
def _phased_fitness(reality: Reality, lattice: Lattice) -> dict[str, Array]:
    found = known(reality, lattice)
    assert found is not None
    x, y, _ = np.nan_to_num(found.displacement.T)
    raw = np.sqrt(x * x + y * y)
    return dict(zip(TERMS, (raw, best_of_class(raw, lattice)), strict=True))


@lru_cache(maxsize=64)
def _exact_fitness(physics: Physics) -> dict[str, Array]:
    raw = np.nan_to_num(np.asarray(softvox_gym.landscape(physics)["fitness"]))
    classes = symmetry_classes(reflections=True)
    best = np.zeros(len(raw))
    np.maximum.at(best, classes, raw)
    return dict(zip(TERMS, (raw, best[classes]), strict=True))


def truth_at(level: float, physics: AnyPhysics, lattice: Lattice) -> tuple[Array | None, str]:
    """Return the true values of designs at a level of noise, as far as they are known.

    Level 0 is exact on the 2x2x2 lattice under any physics. Values at other levels are means over
    many draws, with their standard error; they are known only under the published physics.

    Returns
    -------
    value : ndarray, shape (6561,), or None
        Mean fitness of every design, voxel widths; NaN where it was not measured. None if no value
        is known.
    note : str
        Which design is best, or why no value is known, in words.
    """
    if (found := exact_fitness(physics, lattice)) is None:
        return None, "no true values (not every design of this lattice was simulated)"
    exactly = "(exact)"
    if level == 0:
        value = found["raw"]
    elif lattice.phases > 1:
        return None, "no true values (noise was measured on designs of one phase)"
    elif Physics.of(physics) != Physics.published():
        return None, "no true values (noise was measured under the published physics)"
    else:
        try:
            table = softvox_gym.noisy_landscape(level)
        except ValueError as unknown:
            return None, f"no true values ({unknown})"
        value = np.asarray(table["mean"], dtype=np.float64)
        row = table[np.nanargmax(value)]
        exactly = f"± {row['std'] / np.sqrt(row['draws']):.4f} (standard error)"
    best = int(np.nanargmax(value))
    return value, f"the best is design {best}, {value[best]:.4f} {exactly}"
