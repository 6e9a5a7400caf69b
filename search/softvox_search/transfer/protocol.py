"""The protocol of transfer methods: three methods, and a base class that brings two."""

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

#: Samples of a track per cycle.
SAMPLES = 4


@dataclass(frozen=True, eq=False)
class Test:
    """The result of one test in reality.

    Parameters
    ----------
    design : int
        Its number.
    reward : float
        Its reward in the task, voxel widths; 0 if it diverged.
    displacement : ndarray, shape (3,)
        dx, dy, dz as measured, voxel widths; 0 if it diverged.
    track : ndarray, shape (samples, 3), or None
        Track of the centre of mass from its start, four samples per cycle, for a method whose
        ``wants_track`` is true.
    """

    __test__: ClassVar[bool] = False  # otherwise pytest would collect it

    design: int
    reward: float
    displacement: Array
    track: Array | None = None


@runtime_checkable
class TransferMethod(Protocol):
    """A method that tests designs in a reality that it does not know, and recommends one.

    It is made as ``Class(simulator, task, rng, **options)`` with the nominal `Simulator`, the
    `softvox_gym.Task` and its own generator, from which all its random numbers come. Besides these
    three methods it may have `predict` and `models`, as `Method` describes them.
    """

    def ask(self) -> Any:
        """Return the next design to test: its number, digits or a Design; None to test no more."""
        ...

    def tell(self, test: Test) -> None:
        """Learn the result of the test of the design last asked for."""
        ...

    def recommend(self) -> Any:
        """Return the design that it would build now; called after every test."""
        ...


class Method:
    """A base that stores its tests and recommends the best tested; it lacks only `ask`.

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

    #: Whether tests should include the track.
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
        """Store the test."""
        self.tests.append(test)
        self._left[test.design] = False
        best = self._best
        if best is None or (-test.reward, test.design) < (-best.reward, best.design):
            self._best = test

    def recommend(self) -> int:
        """Return the best tested design; of ties the smallest number.

        Raises
        ------
        ValueError
            Before the first test.
        """
        if self._best is None:
            raise ValueError("nothing to recommend: no design was tested yet")
        return self._best.design

    def predict(self) -> Array | None:
        """Return its expectations for every design in reality; None if it has none.

        Either displacements, shape (6561, 3), or rewards, shape (6561,), voxel widths, finite. This
        base returns the simulator's displacements.
        """
        return self.simulator.landscape()

    def models(self) -> Array | None:
        """Return the predictions of its models for every design, shape (models, 6561, 3), finite.

        None if it has none. This base returns the nominal simulator.
        """
        return self.simulator.landscape()[np.newaxis]

    def untested(self) -> NDArray[np.bool_]:
        """Return which designs can be tested and are untested, shape (6561,)."""
        return self._left.copy()

    def leave_out(self, designs: NDArray[np.bool_]) -> None:
        """Treat designs, a mask of shape (6561,), as tested with unknown results."""
        self._left &= ~designs


def first_best(values: Array, among: NDArray[np.bool_] | None = None) -> int:
    """Return the index of the largest value, the first of ties, among some or all.

    Values that differ by less than 1e-9 are ties, as the last bits of a sum depend on the machine.
    """
    rounded = np.round(values, 9)
    return int(np.argmax(rounded if among is None else np.where(among, rounded, -np.inf)))


def after_tests(name: str, tests: Any, least: int = 1) -> frozenset[int]:
    """Return the numbers of tests after which a method does something.

    Raises
    ------
    TypeError, ValueError
        If they are not whole numbers, or one is smaller than `least`.
    """
    if isinstance(tests, str) or not isinstance(tests, Iterable):
        raise TypeError(f"{name} must be a list of numbers of tests, got {tests!r}")
    made = list(tests)
    for one in made:
        check_count(name, one, least=least)
    return frozenset(made)


def design_of(design: Any, said: str) -> int:
    """Return a design's number; SearcherError if it is no design of 2x2x2."""
    try:
        return Design(design, shape=LATTICE).index
    except (TypeError, ValueError) as error:
        raise SearcherError(f"{said} an invalid design of {LATTICE}: {error}") from error


def best_first(values: Array) -> NDArray[np.intp]:
    """Return the indices of values, largest first; ties, as in `first_best`, in order."""
    return np.argsort(-np.round(values, 9), kind="stable")


def half_best(
    values: Array, n: int, rng: np.random.Generator, among: NDArray[np.bool_] | None = None
) -> NDArray[np.intp]:
    """Return the numbers of n designs: half with the largest values, half drawn from the others.

    At most as many as there are, among some or all.
    """
    order = best_first(values)
    if among is not None:
        order = order[among[order]]
    n = min(n, len(order))
    return np.concatenate([order[: n // 2], rng.permutation(order[n // 2 :])[: n - n // 2]])
