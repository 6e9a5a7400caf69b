"""A generational genetic algorithm."""

from __future__ import annotations

import numpy as np
from deap import tools

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.evolution import Evolutionary, Individual


class GeneticAlgorithm(Evolutionary):
    """Tournament selection, uniform crossover and mutation; the elite survives unchanged.

    Parameters
    ----------
    population : int
        Number of individuals in a generation, the elite included.
    elite : int
        Number of the fittest that survive into the next generation.
    tournament : int
        Number of individuals in the tournament for one parent.
    crossover : float
        Probability that a pair of children swaps digits.
    mutation : float, optional
        Probability that each digit of a child changes; at least one always does. By default one
        over the number of sites.

    Source
    ------
    J. H. Holland, *Adaptation in Natural and Artificial Systems*, 1975; uniform crossover:
    G. Syswerda, *Uniform crossover in genetic algorithms*, ICGA 1989.
    """

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 50,
        elite: int = 2,
        tournament: int = 3,
        crossover: float = 0.8,
        mutation: float | None = None,
    ) -> None:
        super().__init__(
            space, rng, population=population, crossover=crossover, mutation=mutation, least=2
        )
        check_count("elite", elite, least=0)
        if elite >= population:
            raise ValueError(
                f"elite must be smaller than the population, {population}; got {elite}"
            )
        check_count("tournament", tournament, least=1)
        self.toolbox.register(
            "select", tools.selTournament, k=population - elite, tournsize=tournament
        )
        self._elite_size = elite
        self._elite: list[Individual] = []

    def _carried(self) -> list[Individual]:
        return self._elite

    def _breed(self) -> list[Individual]:
        self._elite = tools.selBest(self.population, self._elite_size)
        return super()._breed()

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        return self._elite + offspring
