"""What the suite relies on in a transfer method, put to the test; for one's own as well."""

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
from softvox_search.protocol import SearcherError
from softvox_search.transfer.methods.simple import Oracle
from softvox_search.transfer.protocol import Test
from softvox_search.transfer.registry import make, name_of
from softvox_search.transfer.run import World, design_of, naming
from softvox_search.transfer.simulator import Simulator

#: A heading between the four that are told, so that a method must read it.
HEADING = 30.0


def check(
    method: str | Callable[..., Any], *, tests: int = 12, seed: int = 0, **options: Any
) -> None:
    """Make sure that a transfer method does what the suite relies on.

    It is run in made-up realities, whose displacements are drawn at random and are those of no
    physics. These must hold:

    - It has the three methods of `TransferMethod`, asks for legal designs, none a second time, and
      recommends legal ones. A function tests and recommends legal ones.
    - All its random numbers come from the generator that it was made with: alike made, it acts
      alike, whatever the global random states are, and it leaves those alone. `recommend` doesn't
      change its course.
    - It knows of a reality what tests show, and nothing else: in two realities that differ only in
      a design, it acts alike until it tests that design.
    - It changes neither what it was told nor the simulator's tables.

    Parameters
    ----------
    method : str, class or function
        As `make` takes it.
    tests : int
        The length of a run, at least 2.
    seed : int
        Of all random numbers.
    **options
        Of the method.

    Raises
    ------
    AssertionError, SearcherError
        At the first rule that is broken, saying which. What the method itself raises passes.
    TypeError, ValueError
        Where method is none, or tests are too few.
    """
    check_count("tests", tests, least=2)
    name = name_of(method)

    def require(condition: object, message: str) -> None:
        if not condition:
            raise AssertionError(f"method {name} {message}")

    states = global_states()
    try:
        with naming(name):
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
    courses = []
    for of_globals, advised in ((1, True), (2, True), (2, False)):
        random.seed(of_globals)
        np.random.seed(of_globals)  # noqa: NPY002, it is meant
        before = pickle.dumps(global_states())
        courses.append(_course(method, truth, tests, seed, options, advised=advised))
        require(
            pickle.dumps(global_states()) == before,
            "drew from a global random generator (random or numpy.random), or seeded it; draw from "
            "the generator that it is made with",
        )
    first, again, unadvised = courses
    require(first == again, "made twice with the same generator acts in two ways")
    require(
        [asked for asked, _ in first] == [asked for asked, _ in unadvised],
        "was asked for its recommendation, and then asks for other designs",
    )
    # In a reality that differs in one design it may only act otherwise once that was tested.
    at = len(first) // 2
    other = truth.copy()
    other[first[at][0]] *= -1
    elsewhere = _course(method, other, tests, seed, options, advised=True)
    same = [asked for asked, _ in elsewhere[: at + 1]] == [asked for asked, _ in first[: at + 1]]
    require(
        same and elsewhere[:at] == first[:at],
        "acts on what it has not tested: it must know of reality only what tests show",
    )


def _course(
    method: str | Callable[..., Any],
    truth: NDArray[np.float64],
    tests: int,
    seed: int,
    options: dict[str, Any],
    *,
    advised: bool,
) -> list[tuple[int, int]]:
    """Return what is tested and recommended, test by test; -1 for what is not asked."""
    where = Reality("made up")
    simulator, task = Simulator(where.nominal), Task("directed", HEADING)
    world = World(where, task, 0.0, np.random.default_rng(0), displacement=truth)
    made = make(method, simulator, task, np.random.default_rng(seed), **options)
    before = simulator.landscape().copy()
    if isinstance(made, Oracle):
        made.truth = world.rewards
    course: list[tuple[int, int]] = []

    def test(design: int) -> Test:
        if any(asked == design for asked, _ in course):
            raise SearcherError(f"asked for design {design} a second time")
        course.append((design, -1))
        return world.test(design)

    if hasattr(made, "run"):
        advice = made.run(test, tests)
        course = [
            (asked, design_of(one, "recommended"))
            for (asked, _), one in zip(course, advice, strict=True)
        ]
    else:
        while len(course) < tests and (asked := made.ask()) is not None:
            told = test(design_of(asked, "asked for"))
            kept = pickle.dumps(told)
            made.tell(told)
            if pickle.dumps(told) != kept:
                raise SearcherError("changed the test that it was told")
            if advised:
                course[-1] = course[-1][0], design_of(made.recommend(), "recommended")
    if not course:
        raise SearcherError("tested no design at all")
    if not np.array_equal(simulator.landscape(), before):
        raise SearcherError("changed the simulator's table")
    return course
