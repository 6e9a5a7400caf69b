"""The known landscapes that runs are held against, without noise and with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Physics
from softvox_gym.landscapes.analysis import symmetry_classes

Array = NDArray[np.float64]

#: The lattice whose designs are all known.
SHAPE = (2, 2, 2)

#: Two ways to count: every design for itself; or a robot turned or mirrored as the same robot.
TERMS = ("raw", "class")

#: What `Physics.of` takes.
AnyPhysics = str | Mapping[str, Any] | Physics


def exact_fitness(terms: str = "raw", physics: AnyPhysics = "published") -> Array:
    """Return the noise-free fitness of every 2x2x2 design, shape (6561,), voxel widths; read-only.

    Parameters
    ----------
    terms : "raw" or "class"
        In class terms a design is worth the best of its symmetry class (turned about the vertical,
        mirrored): the model is not symmetric, and whoever found 5757 (3.90) has found the best
        robot, 6453 (4.66), turned by a quarter.
    physics : str, dict or Physics

    Raises
    ------
    ValueError
        For other terms.
    """
    if terms not in TERMS:
        raise ValueError(f"terms must be one of {', '.join(TERMS)}, got {terms!r}")
    return _exact_fitness(terms, Physics.of(physics))


@lru_cache(maxsize=64)
def _exact_fitness(terms: str, physics: Physics) -> Array:
    fitness = np.nan_to_num(np.array(_landscape(physics), dtype=np.float64))
    if terms == "class":
        classes = symmetry_classes(reflections=True)
        best = np.full(len(fitness), -np.inf)
        np.maximum.at(best, classes, fitness)
        fitness = best[classes]
    fitness.flags.writeable = False
    return fitness


def _landscape(physics: Physics) -> Any:
    if physics == Physics.published():
        return softvox_gym.landscape()["fitness"]
    return softvox_gym.simulate(np.arange(3**8), physics).fitness


class Truth(NamedTuple):
    """What designs are worth in a problem.

    value : ndarray, shape (6561,)
        Mean fitness of every design at the level of noise, voxel widths; NaN where it was not
        measured; empty where nothing is known.
    best : int
        The number of the design with the largest; -1 where nothing is known.
    optimum : float
        Its value.
    error : float
        Standard error of that; 0 where it is exact.
    note : str
        Why nothing is known.
    """

    value: Array
    best: int
    optimum: float
    error: float
    note: str = ""


def truth_at(
    level: float, physics: AnyPhysics = "published", shape: Sequence[int] = SHAPE
) -> Truth:
    """Return what designs are worth at a level of noise, as far as anybody knows.

    Level 0 is exact on the 2x2x2 lattice under any physics. The other levels are means over many
    draws, and have their standard error; they are known under the published physics.
    """
    if tuple(shape) != SHAPE:
        return _unknown(f"nobody has simulated every design of {'x'.join(map(str, shape))}")
    if level == 0:
        value = exact_fitness("raw", physics)
        return Truth(value, int(value.argmax()), float(value.max()), 0.0)
    if Physics.of(physics) != Physics.published():
        return _unknown("under noise only the published physics was measured")
    try:
        table = softvox_gym.noisy_landscape(level)
    except ValueError as unknown:
        return _unknown(str(unknown))
    value = np.asarray(table["mean"], dtype=np.float64)
    best = int(np.nanargmax(value))
    error = float(table["std"][best] / np.sqrt(table["draws"][best]))
    return Truth(value, best, float(value[best]), error)


def _unknown(note: str) -> Truth:
    return Truth(np.zeros(0), -1, np.nan, np.nan, note)
