"""The (mu + lambda) evolutionary algorithm."""

from __future__ import annotations

import numpy as np
from deap import algorithms, tools

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.evolution import Evolutionary, Individual
from softvox_search.options import check_share


class MuPlusLambda(Evolutionary):
    """Parents are drawn by lot; the fittest of parents and offspring together survive.

    Of equally fit ones offspring come first, so that the population can drift where mutations make
    no difference.

    Parameters
    ----------
    space : Lattice
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
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 20,
        offspring: int = 40,
        crossover: float = 0.5,
        mutation: float = 1 / 4,
    ) -> None:
        check_count("population", population, least=1)
        check_count("offspring", offspring, least=1)
        check_share("crossover", crossover)
        check_share("mutation", mutation)
        super().__init__(space, rng, population=population, mutation=mutation)
        self.toolbox.register("select", tools.selRandom, k=offspring)
        self._crossover = crossover

    def _breed(self) -> list[Individual]:
        chosen = self.toolbox.select(self.population)
        children: list[Individual] = algorithms.varAnd(chosen, self.toolbox, self._crossover, 1.0)
        return children

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        fittest: list[Individual] = tools.selBest(offspring + self.population, self._size)
        return fittest
