"""NSGA-II: far travel against few active voxels."""

from __future__ import annotations

import numpy as np
from deap import tools

from softvox_gym import Lattice
from softvox_gym.design import ACTIVE
from softvox_search.evolution import Evolutionary, Individual, ValueAndCost


class Nsga2(Evolutionary):
    """Maximises fitness and minimises the number of active voxels at once.

    It still recommends the fittest design, so that it can be compared with the others.

    Parameters
    ----------
    population : int
        Number of survivors, and of children, in every generation; a multiple of 4, because the
        tournament by dominance and crowding distance takes four at a time.
    crossover : float
        Probability that a pair of children swaps digits.
    mutation : float
        Probability that each digit of a child changes; at least one always does.

    Source
    ------
    K. Deb, A. Pratap, S. Agarwal, T. Meyarivan, *A fast and elitist multiobjective genetic
    algorithm: NSGA-II*, IEEE Transactions on Evolutionary Computation 6(2), 2002.
    """

    fitness = ValueAndCost

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 32,
        crossover: float = 0.8,
        mutation: float = 1 / 4,
    ) -> None:
        super().__init__(
            space, rng, population=population, crossover=crossover, mutation=mutation, least=4
        )
        if population % 4:
            raise ValueError(f"population must be a multiple of 4, got {population}")
        self.toolbox.register("select", tools.selTournamentDCD, k=population)

    def _objectives(self, individual: Individual, value: float) -> tuple[float, ...]:
        return (value, sum(digit >= ACTIVE for digit in individual))

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        pool = offspring + self.population
        survivors: list[Individual] = tools.selNSGA2(pool, self._size, nd="log")
        return survivors
