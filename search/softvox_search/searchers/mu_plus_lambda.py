"""The (mu + lambda) evolutionary algorithm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from deap import tools
from numpy.typing import NDArray

from softvox_search.generational import Generational
from softvox_search.options import share, whole
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


class MuPlusLambda(Generational):
    """Parents are drawn by lot; the fittest of parents and offspring together survive.

    DEAP's `varOr` passes some parents on uncloned, so that changing a child may change its parent;
    here every child is a copy. Of equally fit ones offspring come first, so that the population
    can drift where mutations make no difference.

    Parameters
    ----------
    rng : numpy.random.Generator
    population : int
        Survivors of every generation, mu.
    offspring : int
        Children in every generation, lambda.
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
    H.-G. Beyer, H.-P. Schwefel, *Evolution strategies: a comprehensive introduction*, Natural
    Computing 1, 2002.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        population: int = 20,
        offspring: int = 40,
        crossover: float = 0.5,
        mutation: float = 1 / 4,
    ) -> None:
        super().__init__(rng)
        self._size = whole("population", population)
        self._offspring = whole("offspring", offspring)
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
            chosen = tools.selRandom(self._population, self._offspring)
            children = crossed(chosen, self._crossover)
        return mutated(digits(children), self._mutation, self.rng)

    def _select(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        pool = individuals(designs, values) + self._population
        self._population = tools.selBest(pool, self._size, fit_attr="value")
