"""Tests of the properties that the suite relies on in a transfer method, also for your own."""

from __future__ import annotations

import pickle
import random
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Reality, Task
from softvox_gym.landscapes.table import N_DESIGNS
from softvox_gym.simulation import check_count
from softvox_search.global_random import global_states, set_global_states
from softvox_search.transfer.methods.simple import Oracle
from softvox_search.transfer.protocol import Test
from softvox_search.transfer.registry import make, name_of
from softvox_search.transfer.run import World
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
      acts the same until it tests another design.
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
    name = name_of(method)

    def require(condition: object, message: str) -> None:
        if not condition:
            raise AssertionError(f"method {name} {message}")

    states = global_states()
    try:
        _check(method, tests, seed, options, require)
    finally:
        set_global_states(states)


def _check(
    method: str | Callable[..., Any],
    tests: int,
    seed: int,
    options: dict[str, Any],
    require: Callable[[object, str], None],
) -> None:
    truth = np.random.default_rng([seed, 1]).normal(size=(N_DESIGNS, 3))

    def course(
        world: NDArray[np.float64], *, is_advised: bool = True
    ) -> tuple[list[int], list[int]]:
        return _course(method, world, tests, seed, options, require, is_advised=is_advised)

    courses = []
    for of_globals, is_advised in ((1, True), (2, True), (2, False)):
        random.seed(of_globals)
        np.random.seed(of_globals)  # noqa: NPY002, it is meant
        before = pickle.dumps(global_states())
        courses.append(course(truth, is_advised=is_advised))
        require(
            pickle.dumps(global_states()) == before,
            "drew from a global random generator (random or numpy.random), or seeded it; draw from "
            "the generator that it is made with",
        )
    first, again, unadvised = courses
    require(
        first == again,
        "made twice with the same generator acts in two ways; it must draw from that alone, and "
        "share nothing",
    )
    tested, advice = first
    require(
        tested == unadvised[0],
        "was asked for its recommendation, and then asks for other designs",
    )
    # In a reality that differs except for the first few tests, it may act differently only once it
    # has tested one design more.
    for known in (len(tested) // 2, len(tested)):
        other = -truth
        other[tested[:known]] = truth[tested[:known]]
        asked, advised = course(other)
        require(
            asked[: known + 1] == tested[: known + 1] and advised[:known] == advice[:known],
            "acts on what it has not tested: it must know of reality only what tests show",
        )


def _course(
    method: str | Callable[..., Any],
    truth: NDArray[np.float64],
    tests: int,
    seed: int,
    options: dict[str, Any],
    require: Callable[[object, str], None],
    *,
    is_advised: bool,
) -> tuple[list[int], list[int]]:
    """Return the tested designs, and the recommendations after each test."""
    where = Reality("made up")
    simulator, task = Simulator(where.nominal), Task("directed", HEADING)
    world = World(where, task, 0.0, np.random.default_rng(0), displacement=truth)
    made = make(method, simulator, task, np.random.default_rng(seed), **options)
    if isinstance(made.method, Oracle):
        made.method.truth = world.rewards
    shown: list[tuple[Test, bytes]] = []

    def test(design: int) -> Test:
        one = world.test(design, track=bool(getattr(made, "wants_track", False)))
        shown.append((one, pickle.dumps(one)))
        return one

    course = made.course(test, tests, is_advised=is_advised)
    require(
        all(pickle.dumps(one) == kept for one, kept in shown), "changed the test that it was told"
    )
    return [one.design for one, _ in course], [design for _, design in course]
