"""The base of the evolutionary searchers: DEAP's individuals and toolbox, fed in pieces."""

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
    """A value to be maximised, and a cost to be minimised."""

    weights = (1.0, -1.0)


class Individual(list[int]):
    """The digits of a design, as the list that DEAP's operators need.

    A class of its own, because those that `deap.creator` makes are global, and two programs that
    create one of the same name interfere.

    Attributes
    ----------
    fitness : Value or ValueAndCost
        Invalid until the design is evaluated.
    age : int
        Generations since its oldest ancestor was drawn at random, if ages are recorded.
    """

    def __init__(self, digits: Iterable[int], fitness: base.Fitness, age: int = 0) -> None:
        super().__init__(digits)
        self.fitness = fitness
        self.age = age

    def clone(self) -> Individual:
        """Return an independent copy, not yet evaluated."""
        return Individual(self, type(self.fitness)(), self.age)


class Evolutionary(SearcherBase):
    """Hands out a generation in pieces of any size, and selects when the last value is told.

    A subclass registers "select" in its `toolbox`, or defines how to breed a generation from the
    population (`_breed`), and which of population and offspring survive (`_survivors`). Random
    numbers within these come from Python's global `random`, as in DEAP's operators; meanwhile the
    run's own state replaces the global one.

    Asking again before telling gives the same designs again. If fewer are told than were asked for,
    the next `ask` begins with the others.

    Parameters
    ----------
    space : Lattice
    rng : numpy.random.Generator
        The generator of the run.
    population : int
        Number of individuals in the first generation.
    crossover : float
        Probability that a pair of children swaps digits: each site with probability 1/2.
    mutation : float, optional
        Probability that each digit of a child changes; at least one always does. By default one
        over the number of sites.
    least : int
        The smallest population that makes sense.

    Attributes
    ----------
    population : list of Individual
        Evaluated individuals; empty before the first selection.
    toolbox : deap.base.Toolbox
        With clone, mate and mutate.

    Raises
    ------
    TypeError, ValueError
        If an option has an invalid value.
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
        rate = mutation_rate(mutation, space)
        self.toolbox.register("mutate", mutate, indpb=rate, states=space.states)
        self._size = population
        self._crossover = crossover
        self._offspring: list[Individual] = []
        self._n_told = 0
        self._random = GlobalRandom(rng)

    def ask(self, n: int | None = None) -> Designs:
        """Return the rest of the generation, at most n; or the next generation if none is left."""
        if not self._offspring:
            with self._random.swapped_in():
                self._offspring = self._breed() if self.population else self.random(self._size)
        return rows(self._offspring[self._n_told :][:n], self.space)

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Store the values, and select once the whole generation is told.

        Raises
        ------
        ValueError
            If designs were not asked for, or a value is NaN: it is neither better nor worse than
            any other, so no selection would ever remove it.
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
        """Return the designs, besides the offspring, whose values the next selection relies on.

        Returns
        -------
        ndarray of int64, shape (m, sites)
            Each once.
        """
        return rows(dict.fromkeys(map(tuple, self._carried())), self.space)

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Store newer values of parents, as `tell` does for offspring, without a selection."""
        super().tell(designs, values, info)
        newer = dict(zip(keys_of(designs), values.tolist(), strict=True))
        for individual in self._carried():
            if (key := bytes(individual)) in newer:
                individual.fitness.values = self._objectives(individual, newer[key])

    def random(self, n: int) -> list[Individual]:
        """Return n individuals, each digit drawn uniformly from the possible ones."""
        sites, states = range(self.space.sites), self.space.states
        return [
            Individual([random.randrange(states) for _ in sites], self.fitness()) for _ in range(n)
        ]

    def _carried(self) -> list[Individual]:
        """Return the individuals that compete again in the next selection."""
        return self.population

    def _objectives(self, individual: Individual, value: float) -> tuple[float, ...]:
        """Return the objectives by which an individual with this value is selected."""
        return (value,)

    def _breed(self) -> list[Individual]:
        """Return the next generation, not yet evaluated."""
        chosen = self.toolbox.select(self.population)
        children: list[Individual] = algorithms.varAnd(chosen, self.toolbox, self._crossover, 1.0)
        return children

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        """Return the next population, from this one and its offspring."""
        raise NotImplementedError(f"{type(self).__name__} must have a _survivors(...)")


def mutation_rate(mutation: float | None, space: Lattice) -> float:
    """Return the probability that a digit changes; by default one over the number of sites."""
    rate = 1 / space.sites if mutation is None else mutation
    check_share("mutation", rate)
    return rate


def check_share(name: str, value: float) -> None:
    """Raise TypeError or ValueError if a value is no number from 0 to 1."""
    if not_negative(name, value) > 1:
        raise ValueError(f"{name} must be from 0 to 1, got {value!r}")


def mutate(individual: list[int], indpb: float, states: int = 3) -> tuple[list[int]]:
    """Change each digit, with a probability of indpb, to one of the others, in place.

    If that changes none, one drawn uniformly changes. DEAP's `mutUniformInt` draws the new digit
    from all of them, so with three digits it stays the same in one case out of three.

    Returns
    -------
    tuple of one individual
        The same individual, in the form that DEAP's operators return.
    """
    sites = [site for site in range(len(individual)) if random.random() < indpb]
    for site in sites or [random.randrange(len(individual))]:
        individual[site] = (individual[site] + random.choice(range(1, states))) % states
    return (individual,)


def rows(population: Iterable[Iterable[int]], space: Lattice) -> Designs:
    """Return a population as rows of digits, shape (n, sites)."""
    return np.array(list(map(tuple, population)), dtype=np.int64).reshape(-1, space.sites)
