"""NSGA-II: far travel against few active voxels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from deap import tools
from numpy.typing import NDArray

from softvox_gym.design import ACTIVE
from softvox_search.generational import Generational
from softvox_search.options import share, whole
from softvox_search.pareto import Objectives
from softvox_search.protocol import Designs, Info
from softvox_search.python_random import PythonRandom
from softvox_search.variation import (
    Individual,
    crossed,
    digits,
    individuals,
    mutated,
    random_designs,
)


class Nsga2(Generational):
    """Fitness is maximised and the number of active voxels minimised, both at once.

    Its recommendation is the fittest all the same, so that it can be compared with the others.

    Parameters
    ----------
    rng : numpy.random.Generator
    population : int
        Survivors of every generation, and children; a multiple of 4, as the tournament by
        dominance and crowding distance takes four at a time.
    crossover : float
        Probability that a pair of children swaps digits.
    mutation : float
        Probability of each digit of a child to change; at least one always does.

    Raises
    ------
    TypeError, ValueError
        For an option that is not what it must be.

    Source
    ------
    K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, *A fast and elitist multiobjective genetic
    algorithm: NSGA-II*, IEEE Transactions on Evolutionary Computation 6(2), 2002.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        population: int = 32,
        crossover: float = 0.8,
        mutation: float = 1 / 4,
    ) -> None:
        super().__init__(rng)
        self._size = whole("population", population, least=4)
        if self._size % 4:
            raise ValueError(f"population must be a multiple of 4, got {population}")
        self._crossover = share("crossover", crossover)
        self._mutation = share("mutation", mutation)
        self._random = PythonRandom(rng)
        self._population: list[Individual] = []

    def _carried(self) -> Sequence[Individual]:
        return self._population

    def _initial(self) -> Designs:
        return random_designs(self._size, self.rng)

    def _breed(self) -> Designs:
        with self._random.swapped_in():
            chosen = tools.selTournamentDCD(self._population, self._size)
            children = crossed(chosen, self._crossover)
        return mutated(digits(children), self._mutation, self.rng)

    def _select(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        pool = individuals(designs, values) + self._population
        for individual in pool:
            individual.fitness = Objectives((individual.value, individual.count(ACTIVE)))
        self._population = tools.selNSGA2(pool, self._size, nd="log")
