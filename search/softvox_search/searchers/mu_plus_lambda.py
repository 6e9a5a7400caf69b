"""The (mu + lambda) evolutionary algorithm."""

from __future__ import annotations

import numpy as np
from deap import tools

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.evolution import Evolutionary, Individual


class MuPlusLambda(Evolutionary):
    """Parents are drawn uniformly; the fittest of parents and offspring together survive.

    Among equally fit designs offspring come first, so that the population can drift where mutations
    make no difference.

    Parameters
    ----------
    population : int
        Number of survivors in every generation, mu.
    offspring : int
        Number of children in every generation, lambda.
    crossover : float
        Probability that a pair of children swaps digits.
    mutation : float
        Probability that each digit of a child changes; at least one always does.

    Source
    ------
    H.-G. Beyer, H.-P. Schwefel, *Evolution strategies: a comprehensive introduction*, Natural
    Computing 1, 2002.
    """

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 20,
        offspring: int = 40,
        crossover: float = 0.5,
        mutation: float = 1 / 4,
    ) -> None:
        super().__init__(space, rng, population=population, crossover=crossover, mutation=mutation)
        check_count("offspring", offspring, least=1)
        self.toolbox.register("select", tools.selRandom, k=offspring)

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        fittest: list[Individual] = tools.selBest(offspring + self.population, self._size)
        return fittest
