"""What a transfer method is: anything with these three methods; and a base that brings two."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design, Task
from softvox_gym.landscapes.table import LATTICE
from softvox_gym.simulation import check_count
from softvox_search.protocol import SearcherError
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Of a track, per cycle.
SAMPLES = 4


@dataclass(frozen=True, eq=False)
class Test:
    """What one test in reality showed.

    Parameters
    ----------
    design : int
        Its number.
    reward : float
        What it was worth in the task, voxel widths; 0 where it diverged.
    displacement : ndarray, shape (3,)
        dx, dy, dz as measured, voxel widths; 0 where it diverged.
    track : ndarray, shape (samples, 3), or None
        Of the centre of mass from its start, four samples per cycle, for a method whose
        ``wants_track`` is true.
    """

    __test__: ClassVar[bool] = False  # or pytest would collect it

    design: int
    reward: float
    displacement: Array
    track: Array | None = None


@runtime_checkable
class TransferMethod(Protocol):
    """What tries designs in a reality that it does not know, and recommends one.

    It is made as ``Class(simulator, task, rng, **options)`` with the nominal `Simulator`, the
    `softvox_gym.Task` and its own generator, from which all its random numbers come. It may have,
    beside these three methods, `predict` and `models` as `Method` describes them.
    """

    def ask(self) -> Any:
        """Return the next design to test: its number, digits or a Design; None to test no more."""
        ...

    def tell(self, test: Test) -> None:
        """Learn what the test of the design last asked for showed."""
        ...

    def recommend(self) -> Any:
        """Return the design that it would build now; called after every test."""
        ...


class Method:
    """A method that keeps its tests and recommends the best tested; it lacks only `ask`.

    Parameters
    ----------
    simulator : Simulator
    task : softvox_gym.Task
    rng : numpy.random.Generator

    Attributes
    ----------
    simulator, task, rng
    tests : list of Test
    """

    #: Whether a test is to show the track as well.
    wants_track: ClassVar[bool] = False

    #: Parameters of `softvox_gym.Physics` that its models vary.
    varied: frozenset[str] = frozenset()

    def __init__(self, simulator: Simulator, task: Task, rng: np.random.Generator) -> None:
        self.simulator = simulator
        self.task = task
        self.rng = rng
        self.tests: list[Test] = []
        self._left = simulator.testable.copy()
        self._best: Test | None = None

    def tell(self, test: Test) -> None:
        """Keep the test."""
        self.tests.append(test)
        self._left[test.design] = False
        best = self._best
        if best is None or (-test.reward, test.design) < (-best.reward, best.design):
            self._best = test

    def recommend(self) -> int:
        """Return the best design tested, of equal ones the first by number.

        Raises
        ------
        ValueError
            Before the first test.
        """
        if self._best is None:
            raise ValueError("nothing to recommend: no design was tested yet")
        return self._best.design

    def predict(self) -> Array | None:
        """Return what it expects of every design in reality; None where it expects nothing.

        Either displacements, shape (6561, 3), or rewards, shape (6561,), voxel widths. Here that is
        what the simulator says.
        """
        return self.simulator.landscape()

    def models(self) -> Array | None:
        """Return what the models that it holds say of every design, shape (models, 6561, 3).

        None where it has none. Here the nominal simulator.
        """
        return self.simulator.landscape()[np.newaxis]

    def untested(self) -> NDArray[np.bool_]:
        """Return which designs can be tested and were not yet, shape (6561,)."""
        return self._left.copy()

    def leave_out(self, designs: NDArray[np.bool_]) -> None:
        """Take designs, a mask of shape (6561,), for tested ones, of which nothing is told."""
        self._left &= ~designs


def first_best(values: Array, among: NDArray[np.bool_] | None = None) -> int:
    """Return the number of the largest value, of equal ones the first, among some or all.

    Values that differ by less than 1e-9 are equal, as the last bits of a sum are the machine's.
    """
    rounded = np.round(values, 9)
    return int(np.argmax(rounded if among is None else np.where(among, rounded, -np.inf)))


def after_tests(name: str, tests: Any, least: int = 1) -> frozenset[int]:
    """Return the numbers of tests after which a method does something.

    Raises
    ------
    TypeError, ValueError
        For what are no whole numbers, or a smaller one.
    """
    if isinstance(tests, str) or not isinstance(tests, Iterable):
        raise TypeError(f"{name} must be a list of numbers of tests, got {tests!r}")
    made = list(tests)
    for one in made:
        check_count(name, one, least=least)
    return frozenset(made)


def design_of(design: Any, said: str) -> int:
    """Return a design's number; SearcherError for what is none of 2x2x2."""
    try:
        return Design(design, shape=LATTICE).index
    except (TypeError, ValueError) as error:
        raise SearcherError(f"{said} what is no design of {LATTICE}: {error}") from error


def best_first(values: Array) -> NDArray[np.intp]:
    """Return where values are, largest first; of equal ones, as `first_best` has it, the first."""
    return np.argsort(-np.round(values, 9), kind="stable")


def half_best(
    values: Array, n: int, rng: np.random.Generator, among: NDArray[np.bool_] | None = None
) -> NDArray[np.intp]:
    """Return the numbers of n designs: half those of the largest values, half drawn of the others.

    At most as many as there are, among some or all.
    """
    order = best_first(values)
    if among is not None:
        order = order[among[order]]
    n = min(n, len(order))
    return np.concatenate([order[: n // 2], rng.permutation(order[n // 2 :])[: n - n // 2]])
