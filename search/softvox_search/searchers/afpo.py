"""Age-fitness Pareto optimisation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from deap import tools
from numpy.typing import NDArray

from softvox_search.generational import Generational
from softvox_search.options import share, whole
from softvox_search.pareto import Objectives, fronts
from softvox_search.protocol import Designs, Info
from softvox_search.variation import Individual, digits, individuals, mutated, random_designs


class Afpo(Generational):
    """Young designs are spared the competition with old ones: the fit and the young survive.

    As the field of soft robots uses it: in every generation each survivor ages by one and has one
    mutated child that inherits its age, and one newcomer of age 0 is drawn at random. Of them all
    those survive that no other dominates by being as fit and as young and better in one of the
    two; then the next front, until the population is full. Of the front that does not fit as a
    whole the fittest survive.

    Parameters
    ----------
    rng : numpy.random.Generator
    population : int
        Survivors of every generation.
    mutation : float
        Probability of each digit of a child to change; at least one always does.

    Raises
    ------
    TypeError, ValueError
        For an option that is not what it must be.

    Source
    ------
    M. Schmidt, H. Lipson, *Age-fitness Pareto optimization*, Genetic Programming Theory and
    Practice VIII, 2011.
    """

    def __init__(
        self, rng: np.random.Generator, *, population: int = 30, mutation: float = 1 / 4
    ) -> None:
        super().__init__(rng)
        self._size = whole("population", population)
        self._mutation = share("mutation", mutation)
        self._population: list[Individual] = []
        self._ages: list[int] = []

    def _carried(self) -> Sequence[Individual]:
        return self._population

    def _initial(self) -> Designs:
        self._ages = [0] * self._size
        return random_designs(self._size, self.rng)

    def _breed(self) -> Designs:
        for survivor in self._population:
            survivor.age += 1
        self._ages = [*(survivor.age for survivor in self._population), 0]
        children = mutated(digits(self._population), self._mutation, self.rng)
        return np.concatenate([children, random_designs(1, self.rng)])

    def _select(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        pool = individuals(designs, values, self._ages) + self._population
        for individual in pool:
            individual.fitness = Objectives((individual.value, individual.age))
        self._population = []
        for front in fronts(pool, self._size):
            left = self._size - len(self._population)
            self._population += tools.selBest(front, left, fit_attr="value")
