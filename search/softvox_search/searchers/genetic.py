"""A generational genetic algorithm."""

from __future__ import annotations

import numpy as np
from deap import tools

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.evolution import Evolutionary, Individual


class GeneticAlgorithm(Evolutionary):
    """Tournament selection, uniform crossover, mutation; the elite goes on unchanged.

    Parameters
    ----------
    population : int
        Individuals in a generation, the elite included.
    elite : int
        How many of the fittest go on into the next generation.
    tournament : int
        How many take part in the tournament for one parent's place.
    crossover : float
        Probability that a pair of children swaps digits.
    mutation : float, optional
        Probability of each digit of a child to change; at least one always does. One in so many as
        there are sites where None.

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
