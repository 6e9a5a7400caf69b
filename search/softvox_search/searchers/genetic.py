"""A generational genetic algorithm."""

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


class GeneticAlgorithm(Generational):
    """Tournament selection, uniform crossover, mutation; the elite goes on unchanged.

    Parameters
    ----------
    rng : numpy.random.Generator
    population : int
        Individuals in a generation, the elite included.
    elite : int
        How many of the fittest go on into the next generation.
    tournament : int
        How many take part in the tournament for one parent's place.
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
    J. H. Holland, *Adaptation in Natural and Artificial Systems*, 1975; uniform crossover:
    G. Syswerda, *Uniform crossover in genetic algorithms*, ICGA 1989.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        population: int = 50,
        elite: int = 2,
        tournament: int = 3,
        crossover: float = 0.8,
        mutation: float = 1 / 8,
    ) -> None:
        super().__init__(rng)
        self._size = whole("population", population, least=2)
        self._elite_size = whole("elite", elite, least=0)
        if self._elite_size >= self._size:
            raise ValueError(
                f"elite must be smaller than the population, {self._size}; got {elite}"
            )
        self._tournament = whole("tournament", tournament)
        self._crossover = share("crossover", crossover)
        self._mutation = share("mutation", mutation)
        self._random = PythonRandom(rng)
        self._population: list[Individual] = []
        self._elite: list[Individual] = []

    def _carried(self) -> Sequence[Individual]:
        return self._elite

    def _initial(self) -> Designs:
        return random_designs(self._size, self.rng)

    def _breed(self) -> Designs:
        self._elite = tools.selBest(self._population, self._elite_size, fit_attr="value")
        with self._random.swapped_in():
            chosen = tools.selTournament(
                self._population,
                self._size - self._elite_size,
                self._tournament,
                fit_attr="value",
            )
            children = crossed(chosen, self._crossover)
        return mutated(digits(children), self._mutation, self.rng)

    def _select(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        self._population = self._elite + individuals(designs, values)
