"""What the rest of the suite relies on in a searcher, put to the test; for one's own as well."""

from __future__ import annotations

import pickle
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from softvox_gym import TABLE_ENV_ID, Design, Lattice
from softvox_gym.simulation import check_count
from softvox_gym.wrappers.vector import FitnessNoise
from softvox_search.function import FunctionSearcher, is_function
from softvox_search.global_random import global_states, set_global_states
from softvox_search.oracle import Answer, Budget, MakeEnv, Oracle
from softvox_search.protocol import Designs, Searcher, SearcherError
from softvox_search.registry import METHODS
from softvox_search.registry import make as make_by_name
from softvox_search.run import recommended, run

MakeSearcher = Callable[[Lattice, np.random.Generator], Searcher]

#: How many designs are asked for, in turn: the searcher's own batch, and parts of one.
SIZES = (None, 3, None, 1)


def table(n: int) -> VectorEnv[Any, Any, Any]:
    """Return the environment that answers from the table, for n designs."""
    return gym.make_vec(TABLE_ENV_ID, num_envs=n)


def check(
    make: Callable[..., Any] | str,
    *,
    evaluations: int = 200,
    seed: int = 0,
    make_env: MakeEnv = table,
) -> None:
    """Make sure that a searcher does what the suite relies on.

    It is run a dozen times: alone and beside another, with and without noise, with designs that
    diverge, and to the end of every kind of budget. These must hold:

    - It has the three methods of `Searcher`, asks for legal designs, at most as many as wanted, and
      recommends a legal one. A function evaluates and recommends legal ones.
    - All its random numbers come from the generator that it was made with: alike made, it asks
      alike, whatever the global random states are and whatever other searchers do meanwhile; and
      it leaves those states alone. `recommend` doesn't change the course of the search.
    - It leaves the arrays that it is told alone, and stands a last batch cut short by the budget.

    Parameters
    ----------
    make : callable or str
        The searcher's class, another callable (space, rng) -> Searcher, a function
        ``f(evaluate, space, rng)``, or a name as `softvox_search.make` takes it.
    evaluations : int
        The length of a run, at least 2; choose a small one where the searcher is slow.
    seed : int
        Of all random numbers.
    make_env : callable (num_envs) -> VectorEnv
        What it is run on: without noise, and of any lattice.

    Raises
    ------
    AssertionError, SearcherError
        At the first rule that is broken, saying which. What the searcher itself raises passes, with
        a note.
    TypeError, ValueError
        Where make is none of these, or evaluations are too few.

    Examples
    --------
    >>> from softvox_search.searchers.hill_climber import HillClimber
    >>> check(HillClimber)
    """
    check_count("evaluations", evaluations, least=2)
    if not callable(make) and not isinstance(make, str):
        raise TypeError(
            "make must be the searcher's class, its name, a function f(evaluate, space, rng), or "
            f"another callable (space, rng) -> Searcher, got {make!r}"
        )
    space = Oracle(make_env, Budget(evaluations=1)).space
    subject = _Subject(_maker(make), space, evaluations, seed, make_env)
    with _global_states_put_back():
        for rule in _RULES:
            try:
                rule(subject)
            except Exception as error:
                error.add_note(f"The rule under test: {(rule.__doc__ or '').splitlines()[0]}")
                raise


def _maker(make: Callable[..., Any] | str) -> MakeSearcher:
    """Return what makes the searcher anew with every call."""
    if isinstance(make, str):
        return lambda space, rng: make_by_name(make, rng, space=space)
    return partial(FunctionSearcher, make) if is_function(make) else make


@dataclass(frozen=True)
class _Course:
    """A run: how many designs were asked for, which, and what was recommended in the end."""

    sizes: list[int | None]
    asked: list[Designs]
    answers: list[Answer]
    recommendation: Design


@dataclass(frozen=True)
class _Subject:
    """The searcher under test."""

    make: MakeSearcher
    space: Lattice
    evaluations: int
    seed: int
    make_env: MakeEnv

    def searcher(self) -> Searcher:
        return self.make(self.space, np.random.default_rng(self.seed))

    def oracle(self, make_env: MakeEnv, budget: Budget | None = None) -> Oracle:
        rng = np.random.default_rng([self.seed, 1])
        return Oracle(make_env, budget or Budget(evaluations=self.evaluations), rng=rng)

    @property
    def name(self) -> str:
        searcher = self.searcher()
        function = getattr(searcher, "function", None)
        return getattr(function, "__name__", type(searcher).__name__)

    def require(self, condition: object, message: str) -> None:
        if not condition:
            raise AssertionError(f"searcher {self.name} {message}")

    @contextmanager
    def named(self) -> Iterator[None]:
        """Put the searcher's name before what an error says of it."""
        try:
            yield
        except SearcherError as error:
            raise SearcherError(f"searcher {self.name} {error}") from error

    def ask(self, searcher: Searcher, oracle: Oracle, size: int | None) -> Designs:
        """Ask, and hold what comes against the protocol."""
        with self.named():
            asked = oracle.checked(searcher.ask(size))
        self.require(
            size is None or len(asked) <= size,
            f"returned {len(asked)} designs when asked for at most {size}",
        )
        return asked

    def tell(self, searcher: Searcher, answer: Answer) -> None:
        """Tell, and see that the arrays stay as they are."""
        before = pickle.dumps(answer)
        searcher.tell(*answer)
        self.require(pickle.dumps(answer) == before, "changed the arrays that it was told")

    def course(self, make_env: MakeEnv, *, with_advice: bool = False) -> _Course:
        """Run to the end; with advice, it is asked for a recommendation after every batch."""
        searcher, oracle = self.searcher(), self.oracle(make_env)
        if isinstance(searcher, FunctionSearcher):
            advice = run(searcher, oracle, name=self.name)
            asked = oracle.space.digits(oracle.log.columns()["design"])
            return _Course([], list(asked[:, np.newaxis]), [], advice)
        course = _Course([], [], [], Design(0, shape=self.space))
        for size in cycle(SIZES):
            if oracle.is_exhausted:
                break
            course.sizes.append(size)
            course.asked.append(self.ask(searcher, oracle, size))
            course.answers.append(oracle.evaluate(course.asked[-1]))
            if len(course.asked[-1]) == 0:
                break
            self.tell(searcher, course.answers[-1])
            if with_advice:
                searcher.recommend()
        self.require(oracle.evaluations > 0, "asked for nothing at all")
        with self.named():
            advice = recommended(searcher.recommend(), self.space)
        return _Course(course.sizes, course.asked, course.answers, advice)


def _has_the_methods(subject: _Subject) -> None:
    """Look for the three methods."""
    searcher = subject.searcher()
    for method in METHODS:
        subject.require(callable(getattr(searcher, method, None)), f"has no method {method}")


def _is_deterministic(subject: _Subject) -> None:
    """Compare runs made alike, with other global states, asked for advice or not."""
    noisy = partial(_noisy, subject.make_env)
    for make_env in (subject.make_env, noisy):
        courses = []
        for seed in (1, 2):
            random.seed(seed)
            np.random.seed(seed)  # noqa: NPY002, it is meant
            before = pickle.dumps(global_states())
            courses.append(subject.course(make_env))
            subject.require(
                pickle.dumps(global_states()) == before,
                "drew from a global random generator (random or numpy.random), or seeded it; draw "
                "from the generator that it is made with",
            )
        _require_same(
            subject,
            *courses,
            "made twice with the same generator, {}; all its random numbers must come from it",
        )
    advised = subject.course(noisy, with_advice=True)
    _require_same(subject, courses[0], advised, "was asked for its recommendation, and then {}")


def _is_undisturbed_by_others(subject: _Subject) -> None:
    """Two searchers asked in turn do what each does alone."""
    pair = (subject.searcher(), subject.searcher())
    if isinstance(pair[0], FunctionSearcher):
        return  # they can't take turns
    alone = subject.course(subject.make_env)
    oracle = subject.oracle(subject.make_env)
    for size, asked, answer in zip(alone.sizes, alone.asked, alone.answers, strict=True):
        for searcher in pair:
            subject.require(
                np.array_equal(subject.ask(searcher, oracle, size), asked),
                "is disturbed by another one that runs beside it; it must share nothing",
            )
        for searcher in pair:
            if len(answer.designs):
                subject.tell(searcher, answer)


def _keeps_budgets(subject: _Subject) -> None:
    """Run into every kind of budget; what it cost must be what the log says."""
    n = subject.evaluations
    steps = subject.oracle(subject.make_env)
    steps.evaluate(np.full((1, subject.space.sites), 2))
    for wrap in (lambda make_env: make_env, _noisy_maker, _stumbling_maker):
        for budget in (
            Budget(unique=n // 2),
            Budget(evaluations=n),
            Budget(unique=n, evaluations=n // 2 + 1),
            Budget(evaluations=n, steps=n // 2 * steps.steps),
            Budget(evaluations=n, cpu_seconds=1e-3),
        ):
            oracle = subject.oracle(wrap(subject.make_env), budget)
            run(subject.searcher(), oracle, name=subject.name)
            _require_counted(subject, oracle)


def _require_counted(subject: _Subject, oracle: Oracle) -> None:
    """Hold the counters against the budget and the log."""
    budget, columns = oracle.budget, oracle.log.columns()
    for name in ("unique", "evaluations"):
        limit, used = getattr(budget, name), getattr(oracle, name)
        subject.require(
            limit is None or used <= limit, f"used {used} of {limit} {name} with {budget}"
        )
    may_end = isinstance(subject.searcher(), FunctionSearcher)
    subject.require(
        may_end or oracle.is_exhausted or oracle.unique >= subject.space.n_designs,
        f"ended after {oracle.evaluations} evaluations with {budget} not used up",
    )
    subject.require(
        oracle.evaluations == len(columns["sequence"]) > 0
        and oracle.unique == np.count_nonzero(~columns["cached"]),
        f"used {oracle.evaluations} evaluations, {oracle.unique} of them unique, but the log says "
        "otherwise",
    )


def _require_same(subject: _Subject, first: _Course, second: _Course, message: str) -> None:
    """Compare two courses; the message's {} is filled with the difference."""
    for number, (one, other) in enumerate(zip(first.asked, second.asked, strict=False)):
        subject.require(
            np.array_equal(one, other),
            message.format(f"asks {_text(other)} at step {number}, not {_text(one)}"),
        )
    subject.require(
        len(first.asked) == len(second.asked),
        message.format(f"takes {len(second.asked)} steps, not {len(first.asked)}"),
    )
    subject.require(
        first.recommendation == second.recommendation,
        message.format("recommends another design"),
    )


def _text(asked: Designs) -> str:
    shown = ["".join(map(str, row)) for row in asked[:4].tolist()]
    return f"[{', '.join(shown)}{', ...' if len(asked) > 4 else ''}]"


_RULES = (_has_the_methods, _is_deterministic, _is_undisturbed_by_others, _keeps_budgets)


def _noisy(make_env: MakeEnv, n: int) -> VectorEnv[Any, Any, Any]:
    return FitnessNoise(make_env(n), sigma=0.3)


def _noisy_maker(make_env: MakeEnv) -> MakeEnv:
    return partial(_noisy, make_env)


def _stumbling_maker(make_env: MakeEnv) -> MakeEnv:
    return lambda n: _Stumbling(make_env(n))


class _Stumbling(VectorWrapper):
    """Every fifth design diverges."""

    is_noisy = False

    def step(self, actions: Any) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[Any], Any]:
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        diverges = (actions * np.arange(1, 1 + actions.shape[1])).sum(axis=1) % 5 == 0
        infos = {
            **infos,
            "diverged": infos["diverged"] | diverges,
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
