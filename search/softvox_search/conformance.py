"""What the rest of the suite relies on in a searcher, put to the test; for one's own as well."""

from __future__ import annotations

import pickle
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from softvox_gym import TABLE_ENV_ID, Design
from softvox_gym.design import N_DESIGNS, indices_of
from softvox_gym.wrappers.vector import FitnessNoise
from softvox_search.oracle import Answer, Budget, MakeEnv, Oracle, SearcherError, checked
from softvox_search.protocol import Designs, Searcher, State
from softvox_search.registry import METHODS
from softvox_search.registry import make as make_by_name
from softvox_search.replay import global_states, set_global_states
from softvox_search.run import recommended, run

MakeSearcher = Callable[[np.random.Generator], Searcher]

#: How many designs are asked for, in turn: the searcher's own batch, and parts of one.
SIZES = (None, 3, None, 1)


def check(make: MakeSearcher | str, *, evaluations: int = 200, seed: int = 0) -> None:
    """Make sure that a searcher does what the suite relies on.

    It is run on the table of the landscape a dozen times: alone and beside another, with and
    without noise, with designs that diverge, to the end of every kind of budget, and resumed at
    several points. These must hold:

    - It has the five methods of `Searcher`, asks for legal designs, at most as many as wanted, and
      recommends a legal one.
    - All its random numbers come from the generator that it was made with: alike made, it asks
      alike, whatever the global random states are and whatever other searchers do meanwhile; and
      it leaves those states alone.
    - `state_dict` can be pickled; a searcher made alike that loads it goes on with the same bits;
      going on changes neither the state taken nor the state loaded. Taking it, and `recommend`,
      don't change the course of the search.
    - It leaves the arrays that it is told alone, and stands a last batch cut short by the budget.

    Parameters
    ----------
    make : callable (numpy.random.Generator) -> Searcher, or str
        Makes the searcher anew with every call: its class will do, or its name as
        `softvox_search.make` takes it.
    evaluations : int
        The length of a run, at least 2; choose a small one where the searcher is slow.
    seed : int
        Of all random numbers.

    Raises
    ------
    AssertionError, SearcherError
        At the first rule that is broken, saying which. What the searcher itself raises passes, with
        a note.
    TypeError, ValueError
        Where make is neither callable nor such a name, or evaluations are too few.

    Examples
    --------
    >>> from softvox_search.searchers.hill_climber import HillClimber
    >>> check(HillClimber)
    """
    if evaluations < 2:
        raise ValueError(f"evaluations must be at least 2, got {evaluations}")
    if isinstance(make, str):
        make = partial(make_by_name, make)
    elif not callable(make):
        raise TypeError(
            "make must be the searcher's class, its name, or another callable (rng) -> Searcher, "
            f"got {make!r}"
        )
    subject = _Subject(make, evaluations, seed)
    with _global_states_put_back():
        for rule in _RULES:
            try:
                rule(subject)
            except Exception as error:
                error.add_note(f"The rule under test: {(rule.__doc__ or '').splitlines()[0]}")
                raise


class _Step(NamedTuple):
    size: int | None
    asked: Designs
    answer: Answer


class _Course(NamedTuple):
    """A run: its steps, the recommendation after each, and the states before some."""

    steps: list[_Step]
    recommendations: list[Design]
    states: dict[int, tuple[State, bytes]]


@dataclass(frozen=True)
class _Subject:
    """The searcher under test."""

    make: MakeSearcher
    evaluations: int
    seed: int

    def searcher(self) -> Searcher:
        return self.make(np.random.default_rng(self.seed))

    def oracle(self, make_env: MakeEnv, budget: Budget | None = None) -> Oracle:
        rng = np.random.default_rng([self.seed, 1])
        return Oracle(make_env, budget or Budget(evaluations=self.evaluations), rng=rng)

    def require(self, condition: object, message: str) -> None:
        if not condition:
            raise AssertionError(f"searcher {type(self.searcher()).__name__} {message}")

    def ask(self, searcher: Searcher, size: int | None) -> Designs:
        """Ask, and hold what comes against the protocol."""
        try:
            asked = checked(searcher.ask(size))
        except SearcherError as error:
            raise SearcherError(f"searcher {type(searcher).__name__} {error}") from error
        if size is not None:
            self.require(
                len(asked) <= size, f"returned {len(asked)} designs when asked for at most {size}"
            )
        return asked

    def tell(self, searcher: Searcher, answer: Answer) -> None:
        """Tell, and see that the arrays stay as they are."""
        before = pickle.dumps(answer)
        searcher.tell(*answer)
        self.require(pickle.dumps(answer) == before, "changed the arrays that it was told")

    def recommendation(self, searcher: Searcher) -> Design:
        try:
            return recommended(searcher.recommend())
        except SearcherError as error:
            raise SearcherError(f"searcher {type(searcher).__name__} {error}") from error

    def course(self, make_env: MakeEnv, *, states_at: Sequence[int] = ()) -> _Course:
        """Run to the end; with states_at given, take states there and recommendations throughout.

        Otherwise it is asked for no recommendation but at the end.
        """
        searcher, oracle = self.searcher(), self.oracle(make_env)
        steps: list[_Step] = []
        recommendations = []
        states = {}
        sizes = cycle(SIZES)
        while not oracle.is_exhausted:
            if len(steps) in states_at:
                state = searcher.state_dict()
                states[len(steps)] = (state, self.pickled(state))
            size = next(sizes)
            asked = self.ask(searcher, size)
            answer = oracle.evaluate(asked)
            steps.append(_Step(size, asked, answer))
            if len(asked) == 0:
                break
            self.tell(searcher, answer)
            if states_at:
                recommendations.append(self.recommendation(searcher))
        self.require(oracle.evaluations > 0, "asked for nothing at all")
        return _Course(steps, recommendations or [self.recommendation(searcher)], states)

    def pickled(self, state: State) -> bytes:
        try:
            return pickle.dumps(state)
        except Exception as error:
            raise AssertionError(
                f"searcher {type(self.searcher()).__name__} has a state_dict that can't be "
                f"pickled: {error}"
            ) from error


def _has_the_methods(subject: _Subject) -> None:
    """Look for the five methods."""
    searcher = subject.searcher()
    for method in METHODS:
        subject.require(callable(getattr(searcher, method, None)), f"has no method {method}")


def _is_deterministic(subject: _Subject) -> None:
    """Compare two runs made alike, with other global states; those must stay."""
    courses = []
    for seed in (1, 2):
        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002, it is meant
        before = pickle.dumps(global_states())
        courses.append(subject.course(_table))
        subject.require(
            pickle.dumps(global_states()) == before,
            "drew from a global random generator (random or numpy.random), or seeded it; draw from "
            "the generator that it is made with",
        )
    _require_same(
        subject,
        courses[0],
        courses[1],
        "made twice with the same generator, {}; all its random numbers must come from it",
    )


def _is_undisturbed_by_others(subject: _Subject) -> None:
    """Two searchers asked in turn do what each does alone."""
    alone = subject.course(_table)
    pair = (subject.searcher(), subject.searcher())
    for step in alone.steps:
        for searcher in pair:
            subject.require(
                np.array_equal(subject.ask(searcher, step.size), step.asked),
                "is disturbed by another one that runs beside it; it must share nothing",
            )
        for searcher in pair:
            if len(step.answer.designs):
                subject.tell(searcher, step.answer)


def _resumes(subject: _Subject) -> None:
    """Go on from states at several points, whatever became meanwhile of who gave them."""
    for make_env in (_table, _noisy):
        plain = subject.course(make_env)
        last = len(plain.steps) - 1
        points = sorted({0, min(1, last), last // 2, last})
        course = subject.course(make_env, states_at=points)
        _require_same(
            subject, plain, course, "was asked for its state and its recommendation, and then {}"
        )
        for point, (state, pickled) in course.states.items():
            where = f"at step {point} of {last + 1}"
            _resume(subject, course, point, pickle.loads(pickled), f"resumed {where}")
            _resume(subject, course, point, state, f"went on {where}, and its state went along")
            _resume(
                subject, course, point, state, f"loaded a state {where}, went on and changed it"
            )


def _resume(
    subject: _Subject, course: _Course, point: int, state: State, what_happened: str
) -> None:
    """Go on from a state and hold it against the course."""
    searcher = subject.searcher()
    searcher.load_state_dict(state)
    for number, step in enumerate(course.steps[point:], start=point):
        asked = subject.ask(searcher, step.size)
        subject.require(
            np.array_equal(asked, step.asked),
            f"{what_happened}: at step {number} it asks {_text(asked)}, uninterrupted "
            f"{_text(step.asked)}",
        )
        if len(asked) == 0:
            return
        subject.tell(searcher, step.answer)
        subject.require(
            subject.recommendation(searcher) == course.recommendations[number],
            f"{what_happened}: after step {number} it recommends another design than uninterrupted",
        )


def _keeps_budgets(subject: _Subject) -> None:
    """Run into every kind of budget; what it cost must be what the log says."""
    n = subject.evaluations
    for make_env in (_table, _noisy, _stumbling):
        for budget in (
            Budget(unique=n // 2),
            Budget(evaluations=n),
            Budget(unique=n, evaluations=n // 2 + 1),
            Budget(evaluations=n, steps=n // 2 * _STEPS),
        ):
            oracle = subject.oracle(make_env, budget)
            searcher = subject.searcher()
            run(searcher, oracle)
            _require_counted(subject, oracle)


def _require_counted(subject: _Subject, oracle: Oracle) -> None:
    """Hold the counters against the budget and the log."""
    budget, columns = oracle.budget, oracle.log.columns()
    for name in ("unique", "evaluations"):
        limit, used = getattr(budget, name), getattr(oracle, name)
        subject.require(
            limit is None or used <= limit, f"used {used} of {limit} {name} with {budget}"
        )
    subject.require(
        oracle.is_exhausted or oracle.unique >= N_DESIGNS,
        f"ended after {oracle.evaluations} evaluations with {budget} not used up",
    )
    subject.require(
        oracle.evaluations == len(columns["sequence"]) > 0
        and oracle.unique == np.count_nonzero(columns["cached"] == 0),
        f"used {oracle.evaluations} evaluations, {oracle.unique} of them unique, but the log says "
        "otherwise",
    )


def _require_same(subject: _Subject, first: _Course, second: _Course, message: str) -> None:
    """Compare two courses; the message's {} is filled with the difference."""
    for number, (one, other) in enumerate(zip(first.steps, second.steps, strict=False)):
        subject.require(
            np.array_equal(one.asked, other.asked),
            message.format(f"asks {_text(other.asked)} at step {number}, not {_text(one.asked)}"),
        )
    subject.require(
        len(first.steps) == len(second.steps),
        message.format(f"takes {len(second.steps)} steps, not {len(first.steps)}"),
    )
    subject.require(
        first.recommendations[-1] == second.recommendations[-1],
        message.format("recommends another design"),
    )


def _text(asked: Designs) -> str:
    numbers = indices_of(asked).tolist()
    return f"{numbers[:4]}"[:-1] + (", ...]" if len(numbers) > 4 else "]")


_RULES = (
    _has_the_methods,
    _is_deterministic,
    _is_undisturbed_by_others,
    _resumes,
    _keeps_budgets,
)

#: Simulated steps of a typical design.
_STEPS = 8831


def _table(n: int) -> VectorEnv[Any, Any, Any]:
    return gym.make_vec(TABLE_ENV_ID, num_envs=n)


def _noisy(n: int) -> VectorEnv[Any, Any, Any]:
    return FitnessNoise(_table(n), sigma=0.3)


def _stumbling(n: int) -> VectorEnv[Any, Any, Any]:
    return _Stumbling(_table(n))


class _Stumbling(VectorWrapper[Any, Any, Any]):
    """Every fifth design diverges."""

    is_noisy = False

    def step(self, actions: Any) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[Any], Any]:
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        diverges = infos["design"] % 5 == 0
        infos = {
            **infos,
            "status": np.where(diverges, "diverged", infos["status"]),
            "displacement": np.where(diverges[:, np.newaxis], np.nan, infos["displacement"]),
        }
        return observations, np.where(diverges, 0, rewards), terminated, truncated, infos


@contextmanager
def _global_states_put_back() -> Iterator[None]:
    states = global_states()
    try:
        yield
    finally:
        set_global_states(states)
