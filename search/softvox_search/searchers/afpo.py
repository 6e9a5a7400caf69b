"""Age-fitness Pareto optimisation."""

from __future__ import annotations

import numpy as np
from deap import tools

from softvox_gym import Lattice
from softvox_search.evolution import Evolutionary, Individual, ValueAndCost


class Afpo(Evolutionary):
    """Age-fitness Pareto optimisation: the fit and the young survive.

    As used for soft robots: in every generation each survivor ages by one and has one mutated child
    that inherits its age, and one newcomer of age 0 is drawn at random. Of all these, the designs
    survive that no other dominates by being as fit and as young and better in one of the two; then
    the next front, until the population is full. If a front does not fit as a whole, its fittest
    survive.

    Parameters
    ----------
    population : int
        Number of survivors in every generation.
    mutation : float
        Probability that each digit of a child changes; at least one always does.

    Notes
    -----
    The fronts come from DEAP's generalisation of the sorting of Jensen, *Reducing the run-time
    complexity of multiobjective EAs*, 2003: ten times as fast for a hundred individuals as
    comparing all pairs.

    Source
    ------
    M. Schmidt, H. Lipson, *Age-fitness Pareto optimization*, Genetic Programming Theory and
    Practice VIII, 2011.
    """

    fitness = ValueAndCost

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 30,
        mutation: float = 1 / 4,
    ) -> None:
        super().__init__(space, rng, population=population, crossover=0.0, mutation=mutation)
        self.toolbox.register("select", list)  # all have a child

    def _objectives(self, individual: Individual, value: float) -> tuple[float, ...]:
        return (value, individual.age)

    def _breed(self) -> list[Individual]:
        for survivor in self.population:
            survivor.age += 1
            survivor.fitness.values = (survivor.fitness.values[0], survivor.age)
        return super()._breed() + self.random(1)

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        survivors: list[Individual] = []
        for front in tools.sortLogNondominated(offspring + self.population, self._size):
            survivors += tools.selBest(front, self._size - len(survivors))
        return survivors
