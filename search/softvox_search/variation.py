"""What makes new designs: chance, crossover and mutation."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from deap import tools
from numpy.typing import NDArray

from softvox_gym.design import N_SITES
from softvox_search.protocol import Designs


class Individual(list[int]):
    """The digits of an evaluated design, a list as DEAP's operators want it.

    A class of its own: those that `deap.creator` makes are global, so that two programs that
    create one of the same name, or unpickle one, get in each other's way.

    Attributes
    ----------
    value : float
        What it was told to be worth, voxel widths; NaN for a child not evaluated yet.
    age : int
        Generations since its oldest ancestor was drawn at random; where ages are kept.
    fitness : Objectives
        Where it competes for more than one thing.
    """

    __slots__ = ("age", "fitness", "value")

    age: int
    fitness: Any
    value: float

    def __init__(self, digits: Iterable[int], *, value: float = np.nan, age: int = 0) -> None:
        super().__init__(digits)
        self.value = value
        self.age = age

    def child(self) -> Individual:
        """Return a copy that can be varied without touching this one."""
        return Individual(self, age=self.age)


def individuals(
    designs: Designs, values: NDArray[np.float64], ages: Sequence[int] | None = None
) -> list[Individual]:
    """Return evaluated designs as individuals; of age 0 where no ages are given."""
    rows, worths = designs.tolist(), values.tolist()
    return [
        Individual(row, value=value, age=age)
        for row, value, age in zip(rows, worths, ages or [0] * len(rows), strict=True)
    ]


def digits(population: Sequence[Individual]) -> Designs:
    """Return a population as rows of digits, shape (n, 8)."""
    return np.array(population, dtype=np.int64).reshape(len(population), N_SITES)


def random_designs(n: int, rng: np.random.Generator) -> Designs:
    """Return n designs, shape (n, 8), every digit drawn uniformly from 0, 1, 2."""
    return rng.integers(3, size=(n, N_SITES))


def crossed(parents: Sequence[Individual], probability: float) -> list[Individual]:
    """Return one child for each parent; neighbours in the list may have crossed.

    Parameters
    ----------
    parents : sequence of Individual
        They are copied, not changed.
    probability : float
        That the first and second, third and fourth, ... swap digits: each site with
        probability 1/2 (uniform crossover).

    Notes
    -----
    Draws from the global `random`, as DEAP does: call it within `PythonRandom.swapped_in`.
    """
    children = [parent.child() for parent in parents]
    for first, second in zip(children[::2], children[1::2], strict=False):
        if random.random() < probability:
            tools.cxUniform(first, second, 0.5)
    return children


def mutated(designs: Designs, rate: float, rng: np.random.Generator) -> Designs:
    """Return mutants of designs, each different from the design that it comes from.

    DEAP's `mutUniformInt` draws the new digit from all, so that a site hit keeps its digit in one
    case out of three. Here it gets one of the two others.

    Parameters
    ----------
    designs : ndarray of int64, shape (n, 8)
    rate : float
        Probability of each site to change. Where no site of a design does, one drawn uniformly
        does after all.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of int64, shape (n, 8)
    """
    is_hit = rng.random(designs.shape) < rate
    spared = np.flatnonzero(~is_hit.any(axis=1))
    is_hit[spared, rng.integers(N_SITES, size=len(spared))] = True
    mutants: Designs = (designs + is_hit * rng.integers(1, 3, size=designs.shape)) % 3
    return mutants
