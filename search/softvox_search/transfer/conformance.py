"""Tests of the properties that the suite relies on in a transfer method, also for your own."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Reality, Task
from softvox_gym.landscapes.table import N_DESIGNS
from softvox_gym.simulation import check_count
from softvox_search.conformance import global_states_of
from softvox_search.global_random import global_states_kept
from softvox_search.transfer.protocol import Test
from softvox_search.transfer.registry import make, name_of
from softvox_search.transfer.run import World, beliefs
from softvox_search.transfer.simulator import Simulator

#: A heading other than the four standard ones, so that a method must read it.
HEADING = 30.0


def check(
    method: str | Callable[..., Any], *, tests: int = 12, seed: int = 0, **options: Any
) -> None:
    """Check that a transfer method has the properties that the suite relies on.

    It runs in made-up realities, whose displacements are random and follow no physics. These rules
    must hold:

    - It has the three methods of `TransferMethod`, asks for valid designs, none of them twice, and
      recommends valid ones. A function tests and recommends valid designs.
    - All its random numbers come from its generator: with the same generator it acts the same,
      whatever the global random states are, and it does not change those. `recommend` doesn't
      change its course.
    - It knows only what tests show of a reality: in two realities that agree on some designs, it
      acts the same until it tests another design, and predicts the same if it tests none.
    - `predict` and `models`, if it has them, return what `Method` describes.
    - It does not change what it is told. (The simulator's tables are read-only.)

    Parameters
    ----------
    method : str, class or function
        As in `make`.
    tests : int
        The length of a run, at least 2.
    seed : int
        Seed of all random numbers.
    **options
        Options of the method.

    Raises
    ------
    AssertionError, SearcherError
        At the first broken rule, which the message names. Errors of the method itself pass through.
    TypeError, ValueError
        If it is no method, or there are too few tests.
    """
    check_count("tests", tests, least=2)
    subject = _Subject(method, tests, seed, options)
    truth = np.random.default_rng([seed, 1]).normal(size=(N_DESIGNS, 3))
    courses = []
    with global_states_kept():
        for of_globals, is_advised in ((1, True), (2, True), (2, False)):
            with global_states_of(of_globals, subject.require):
                courses.append(subject.course(truth, is_advised=is_advised))
        first, again, unadvised = courses
        subject.require(
            first == again,
            "made twice with the same generator acts in two ways; it must draw from that alone, "
            "and share nothing",
        )
        tested, advice, held = first
        subject.require(
            tested == unadvised[0],
            "was asked for its recommendation, and then asks for other designs",
        )
        # In a second reality, equal to the first in the first few tested designs only, it may act
        # differently only once it has tested one design more.
        for known in (len(tested) // 2, len(tested)):
            other = -truth
            other[tested[:known]] = truth[tested[:known]]
            asked, advised, now_held = subject.course(other)
            subject.require(
                asked[: known + 1] == tested[: known + 1]
                and advised[:known] == advice[:known]
                and (known < len(tested) or now_held == held),
                "acts on what it has not tested: it must know of reality only what tests show",
            )


@dataclass(frozen=True)
class _Subject:
    """The method under test."""

    method: str | Callable[..., Any]
    tests: int
    seed: int
    options: dict[str, Any]

    def require(self, condition: object, message: str) -> None:
        if not condition:
            raise AssertionError(f"method {name_of(self.method)} {message}")

    def course(
        self, truth: NDArray[np.float64], *, is_advised: bool = True
    ) -> tuple[list[int], list[int], list[bytes | None]]:
        """Return the tests, the recommendation after each, and the `beliefs` at the end."""
        where = Reality("made up")
        simulator, task = Simulator(where.nominal), Task("directed", HEADING)
        world = _Recording(where, task, 0.0, np.random.default_rng(0), displacement=truth)
        rng = np.random.default_rng(self.seed)
        made = make(self.method, simulator, task, rng, **self.options)
        course = world.crossed_by(made, self.tests, is_advised=is_advised)
        held = [None if one is None else one.tobytes() for one in beliefs(made)]
        self.require(
            all(pickle.dumps(one) == shown for one, shown in world.shown),
            "changed the test that it was told",
        )
        return [one.design for one, _ in course], [design for _, design in course], held


class _Recording(World):
    """A world that keeps every test with its bytes at the time it was shown."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.shown: list[tuple[Test, bytes]] = []

    def test(self, design: int, *, track: bool = False) -> Test:
        one = super().test(design, track=track)
        self.shown.append((one, pickle.dumps(one)))
        return one
