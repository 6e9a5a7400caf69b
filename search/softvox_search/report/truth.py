"""The known landscape that runs are held against, without noise and with."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym.design import N_DESIGNS
from softvox_gym.landscapes.analysis import symmetry_classes

#: Two ways to count: every design for itself; or a robot turned or mirrored as the same robot.
TERMS = ("raw", "class")


@lru_cache(maxsize=2)
def exact_fitness(terms: str) -> NDArray[np.float64]:
    """Return the noise-free fitness of every design, shape (6561,), voxel widths; read-only.

    Parameters
    ----------
    terms : "raw" or "class"
        In class terms a design is worth the best of its symmetry class (turned about the vertical,
        mirrored): the model is not symmetric, and whoever found 5757 (3.90) has found the best
        robot, 6453 (4.66), turned by a quarter.

    Raises
    ------
    ValueError
        For other terms.
    """
    if terms not in TERMS:
        raise ValueError(f"terms must be one of {', '.join(TERMS)}, got {terms!r}")
    fitness = np.asarray(softvox_gym.landscape()["fitness"], dtype=np.float64)
    if terms == "class":
        classes = symmetry_classes(reflections=True)
        best = np.full(N_DESIGNS, -np.inf)
        np.maximum.at(best, classes, fitness)
        fitness = best[classes]
    fitness.flags.writeable = False
    return fitness


def optimum() -> float:
    """Return the best noise-free fitness, voxel widths; the same in raw and in class terms."""
    return float(exact_fitness("raw").max())


class Truth(NamedTuple):
    """What designs are worth at a level of noise.

    value : ndarray, shape (6561,)
        Mean fitness of every design at that level, voxel widths; NaN where it was not measured.
    best : int
        The number of the design with the largest; -1 where none was measured.
    optimum : float
        Its value.
    error : float
        Standard error of that; 0 where it is exact.
    note : str
        Why values are missing, where all are.
    """

    value: NDArray[np.float64]
    best: int
    optimum: float
    error: float
    note: str = ""


def truth_at(level: float) -> Truth:
    """Return what designs are worth at a level of noise; all NaN where nobody measured that.

    Level 0 is exact; the other levels are means over many draws, and have their standard error.
    """
    if level == 0:
        return Truth(exact_fitness("raw"), int(exact_fitness("raw").argmax()), optimum(), 0.0)
    try:
        table = softvox_gym.noisy_landscape(level)
    except ValueError as unknown:
        return Truth(np.full(N_DESIGNS, np.nan), -1, np.nan, np.nan, str(unknown))
    value = np.asarray(table["mean"], dtype=np.float64)
    best = int(np.nanargmax(value))
    error = float(table["std"][best] / np.sqrt(table["draws"][best]))
    return Truth(value, best, float(value[best]), error)
