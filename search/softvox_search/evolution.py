"""What the evolutionary searchers share: DEAP's individuals and toolbox, fed in pieces."""

from __future__ import annotations

import random
from collections.abc import Iterable
from typing import Any

import numpy as np
from deap import algorithms, base, tools
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_gym.noise import not_negative
from softvox_gym.simulation import check_count
from softvox_search.global_random import GlobalRandom
from softvox_search.protocol import Designs, Info, SearcherBase, keys_of


class Value(base.Fitness):  # type: ignore[misc]  # DEAP has no type hints
    """A value to be maximised."""

    weights = (1.0,)


class ValueAndCost(base.Fitness):  # type: ignore[misc]
    """A value to be maximised, and something to be minimised."""

    weights = (1.0, -1.0)


class Individual(list[int]):
    """The digits of a design, a list as DEAP's operators want it.

    A class of its own: those that `deap.creator` makes are global, so that two programs that
    create one of the same name get in each other's way.

    Attributes
    ----------
    fitness : Value or ValueAndCost
        Invalid until the design is evaluated.
    age : int
        Generations since its oldest ancestor was drawn at random; where ages are kept.
    """

    def __init__(self, digits: Iterable[int], fitness: base.Fitness, age: int = 0) -> None:
        super().__init__(digits)
        self.fitness = fitness
        self.age = age

    def clone(self) -> Individual:
        """Return a copy that can be varied without touching this one; not evaluated yet."""
        return Individual(self, type(self.fitness)(), self.age)


class Evolutionary(SearcherBase):
    """Hands out a generation in pieces as asked, and selects when the last piece is told.

    A subclass registers "select" in its `toolbox`, or says itself how a generation is bred of the
    population (`_breed`), and what survives of population and offspring (`_survivors`). What it
    draws within these comes from Python's global `random`, as DEAP's operators do it; the run's
    own state is in its place meanwhile.

    Asking again before telling gives the same designs again. Where fewer are told than were asked
    for, the next `ask` begins with those left.

    Parameters
    ----------
    space : Lattice
    rng : numpy.random.Generator
        The run's own.
    population : int
        Individuals of the first generation.
    crossover : float
        Probability that a pair of children swaps digits: each site with probability 1/2.
    mutation : float, optional
        Probability of each digit of a child to change; at least one always does. One in so many as
        there are sites where None.
    least : int
        The smallest population that makes sense.

    Attributes
    ----------
    population : list of Individual
        Evaluated; empty before the first selection.
    toolbox : deap.base.Toolbox
        With clone, mate and mutate.

    Raises
    ------
    TypeError, ValueError
        For an option that is not what it must be.
    """

    fitness: type[base.Fitness] = Value

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int,
        crossover: float,
        mutation: float | None,
        least: int = 1,
    ) -> None:
        super().__init__(space, rng)
        check_count("population", population, least=least)
        check_share("crossover", crossover)
        self.population: list[Individual] = []
        self.toolbox: Any = base.Toolbox()
        self.toolbox.register("clone", Individual.clone)
        self.toolbox.register("mate", tools.cxUniform, indpb=0.5)
        self.toolbox.register("mutate", mutate, indpb=mutation_rate(mutation, space))
        self._size = population
        self._crossover = crossover
        self._offspring: list[Individual] = []
        self._n_told = 0
        self._random = GlobalRandom(rng)

    def ask(self, n: int | None = None) -> Designs:
        """Return what is left of the generation, at most n; of the next where none is left."""
        if not self._offspring:
            with self._random.swapped_in():
                self._offspring = self._breed() if self.population else self.random(self._size)
        return rows(self._offspring[self._n_told :][:n], self.space)

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Remember the values, and select once all of the generation is told.

        Raises
        ------
        ValueError
            For designs that were not asked for, or a value that is NaN: it is neither better nor
            worse than any other, so that no selection would ever remove it.
        """
        told = self._offspring[self._n_told :][: len(designs)]
        if not np.array_equal(designs, rows(told, self.space)):
            raise ValueError("tell must get the designs that ask returned, in that order")
        if np.isnan(values).any():
            raise ValueError("values told must be numbers, got NaN; a diverged design is worth 0")
        super().tell(designs, values, info)
        for individual, value in zip(told, values.tolist(), strict=True):
            individual.fitness.values = self._objectives(individual, value)
        self._n_told += len(told)
        if self._n_told == len(self._offspring):
            offspring, self._offspring, self._n_told = self._offspring, [], 0
            with self._random.swapped_in():
                self.population = self._survivors(offspring)

    def parents(self) -> Designs:
        """Return the designs whose values the next selection relies on beside the offspring's.

        Returns
        -------
        ndarray of int64, shape (m, sites)
            Each once.
        """
        return rows(dict.fromkeys(map(tuple, self._carried())), self.space)

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Take newer values for parents, as `tell` does for offspring; no selection follows."""
        super().tell(designs, values, info)
        newer = dict(zip(keys_of(designs), values.tolist(), strict=True))
        for individual in self._carried():
            if (key := bytes(individual)) in newer:
                individual.fitness.values = self._objectives(individual, newer[key])

    def random(self, n: int) -> list[Individual]:
        """Return n individuals, each digit drawn uniformly from 0, 1, 2."""
        sites = range(self.space.sites)
        return [Individual([random.randrange(3) for _ in sites], self.fitness()) for _ in range(n)]

    def _carried(self) -> list[Individual]:
        """Return the individuals that compete again in the next selection."""
        return self.population

    def _objectives(self, individual: Individual, value: float) -> tuple[float, ...]:
        """Return what an individual of some value is selected by."""
        return (value,)

    def _breed(self) -> list[Individual]:
        """Return the next generation, not evaluated yet."""
        chosen = self.toolbox.select(self.population)
        children: list[Individual] = algorithms.varAnd(chosen, self.toolbox, self._crossover, 1.0)
        return children

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        """Return the next population, of this one and its offspring."""
        raise NotImplementedError(f"{type(self).__name__} must have a _survivors(...)")


def mutation_rate(mutation: float | None, space: Lattice) -> float:
    """Return the probability of a digit to change; one in so many as there are sites where None."""
    rate = 1 / space.sites if mutation is None else mutation
    check_share("mutation", rate)
    return rate


def check_share(name: str, value: float) -> None:
    """Raise TypeError or ValueError for what is no number from 0 to 1."""
    if not_negative(name, value) > 1:
        raise ValueError(f"{name} must be from 0 to 1, got {value!r}")


def mutate(individual: list[int], indpb: float) -> tuple[list[int]]:
    """Change each digit, with a probability of indpb, to one of the two others, in place.

    Where that changes none, one drawn uniformly does after all. DEAP's `mutUniformInt` draws the
    new digit from all three, so that it stays what it was in one case out of three.

    Returns
    -------
    tuple of one individual
        The same, as DEAP's operators return it.
    """
    sites = [site for site in range(len(individual)) if random.random() < indpb]
    for site in sites or [random.randrange(len(individual))]:
        individual[site] = (individual[site] + random.choice((1, 2))) % 3
    return (individual,)


def rows(population: Iterable[Iterable[int]], space: Lattice) -> Designs:
    """Return a population as rows of digits, shape (n, sites)."""
    return np.array(list(map(tuple, population)), dtype=np.int64).reshape(-1, space.sites)
