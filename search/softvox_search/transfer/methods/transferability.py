"""The transferability approach: search the simulator for fit, transferable and diverse designs."""

from __future__ import annotations

import numpy as np
from deap import base
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.landscapes.table import LATTICE, N_DESIGNS
from softvox_gym.simulation import check_count
from softvox_search.evolution import Individual, rows
from softvox_search.searchers.nsga2 import Nsga2
from softvox_search.transfer.protocol import Method, Test, first_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]


class _Three(base.Fitness):  # type: ignore[misc]  # DEAP has no type hints
    """Reward to be maximised, disparity to be minimised, diversity to be maximised."""

    weights = (1.0, -1.0, 1.0)


class _Front(Nsga2):
    """NSGA-II on the reward in the simulator, the expected disparity, and diversity."""

    fitness = _Three

    def __init__(self, rng: np.random.Generator, population: int, reward: Array) -> None:
        super().__init__(LATTICE, rng, population=population)
        self.reward = reward
        self.disparity = np.zeros(N_DESIGNS)

    def advance(self) -> NDArray[np.int64]:
        """Breed a generation and select; return the numbers of the population."""
        asked = self.ask()
        numbers = LATTICE.numbers(asked)
        zeros = np.zeros(len(asked))
        self.tell(
            asked,
            self.reward[numbers],
            {
                "displacement": np.zeros((len(asked), 3)),
                "diverged": zeros > 0,
                "standard_error": zeros,
            },
        )
        return np.asarray(LATTICE.numbers(rows(self.population, LATTICE)))

    def _objectives(self, individual: Individual, value: float) -> tuple[float, ...]:
        return (value, 0.0, 0.0)  # until `_survivors` knows the others

    def _survivors(self, offspring: list[Individual]) -> list[Individual]:
        pool = offspring + self.population
        digits = rows(pool, LATTICE)
        numbers = LATTICE.numbers(digits)
        # The mean share of sites in which a design differs from the others: for every site, the
        # number of others with another digit there.
        alike = (digits[:, :, np.newaxis] == np.arange(3)).sum(axis=0)
        diversity = 1 - alike[np.arange(LATTICE.sites), digits].mean(axis=1) / len(pool)
        columns = self.reward[numbers], self.disparity[numbers], diversity
        for individual, *values in zip(pool, *(column.tolist() for column in columns), strict=True):
            individual.fitness.values = values
        return super()._survivors(offspring)


class Transferability(Method):
    """Evolves designs in the simulator for reward, low disparity from reality, and diversity.

    The disparity of a tested design is the distance between its displacements in simulator and
    reality. That of the others is interpolated from the tested ones, weighted by the inverse
    squared distance in the behaviour in the simulator: distance travelled, mean height, heading.
    After some generations the next test is the design of the population that behaves least like the
    tested ones; the first test is the fittest. Recommends the best tested design.

    Parameters
    ----------
    population : int
        A multiple of 4.
    generations : int
        Number of generations between tests.

    Notes
    -----
    Source: S. Koos, J.-B. Mouret, S. Doncieux, "The transferability approach: crossing the reality
    gap in evolutionary robotics", IEEE TEVC 17(1), 2013, with about ten tests.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        population: int = 40,
        generations: int = 5,
    ) -> None:
        super().__init__(simulator, task, rng)
        check_count("generations", generations, least=1)
        moved = simulator.landscape()
        self._moved = moved
        self._behaviour = _behaviour(moved, simulator.mean_height())
        self._front = _Front(rng, population, task.reward(moved))
        self._generations = generations
        # For every design: squared distance to the nearest tested; weights; weighted disparities.
        self._apart = np.full(N_DESIGNS, np.inf)
        self._weight, self._weighted = np.zeros(N_DESIGNS), np.zeros(N_DESIGNS)

    def ask(self) -> int:
        """Evolve, and return the design that behaves least like the tested ones."""
        for _ in range(self._generations):
            population = self._front.advance()
        among = np.zeros(N_DESIGNS, dtype=bool)
        among[population] = True
        among &= self.untested()
        if not among.any():
            among = self.untested()
        if not self.tests:
            return first_best(self._front.reward, among)
        return first_best(self._apart, among)

    def tell(self, test: Test) -> None:
        """Learn the disparity of the test, and what it implies for the others."""
        super().tell(test)
        off = self._moved[test.design, :2] - test.displacement[:2]
        apart = np.square(self._behaviour - self._behaviour[test.design]).sum(axis=1)
        weight = 1 / np.maximum(apart, 1e-9)
        self._apart = np.minimum(self._apart, apart)
        self._weight += weight
        self._weighted += weight * float(np.sqrt(np.square(off).sum()))
        self._front.disparity = self._weighted / self._weight


def _behaviour(moved: Array, height: Array) -> Array:
    """Return the behaviour of designs, (6561, 4): distance, height, half a heading vector."""
    distance = np.sqrt(np.square(moved[:, :2]).sum(axis=1))
    heading = moved[:, :2] / np.maximum(distance, 1e-9)[:, np.newaxis] / 2
    spread = max(float(np.ptp(height)), 1e-9)
    farthest = max(float(distance.max()), 1e-9)
    return np.column_stack([distance / farthest, (height - height.min()) / spread, heading])
