"""Tests of the properties that the suite relies on in a searcher, also for your own."""

from __future__ import annotations

import pickle
import random
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle, zip_longest
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from softvox_gym import TABLE_ENV_ID, Lattice
from softvox_gym.simulation import check_count
from softvox_gym.wrappers.vector import FitnessNoise
from softvox_search.function import FunctionSearcher, is_function
from softvox_search.global_random import global_states, global_states_kept
from softvox_search.oracle import Budget, MakeEnv, Oracle, checked
from softvox_search.protocol import Searcher, naming
from softvox_search.registry import REGISTRY
from softvox_search.registry import make as make_by_name
from softvox_search.run import name_of, recommended, run

#: Numbers of designs to ask for, in turn: the searcher's own batch, and parts of one.
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
    """Check that a searcher has the properties that the suite relies on.

    The searcher runs a dozen times: alone and beside another, with and without noise, with designs
    that diverge, and to the end of every kind of budget. These rules must hold:

    - It has the three methods of `Searcher`, asks for valid designs, at most as many as requested,
      and recommends a valid one. A function evaluates and recommends valid designs.
    - All its random numbers come from its generator: with the same generator it asks for the same
      designs, whatever the global random states are and whatever other searchers do meanwhile; and
      it does not change those states. `recommend` doesn't change the course of the search.
    - It does not change the arrays that it is told, and copes with a last batch that the budget
      cuts short.

    Parameters
    ----------
    make : callable or str
        The searcher's class, another callable (space, rng) -> Searcher, a function ``f(evaluate,
        space, rng)``, or a name for `softvox_search.make`.
    evaluations : int
        The length of a run, at least 2; choose a small one if the searcher is slow.
    seed : int
        Seed of all random numbers.
    make_env : callable (num_envs) -> VectorEnv
        Makes the environment: without noise, on any lattice.

    Raises
    ------
    AssertionError, SearcherError
        At the first broken rule, which the message names. Errors of the searcher itself pass
        through, with a note.
    TypeError, ValueError
        If make is none of these, a method is missing, or there are too few evaluations.

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
    subject = _Subject(make, make_env, evaluations, seed)
    with global_states_kept():
        for rule in (_has_the_methods, _is_deterministic, _is_undisturbed, _keeps_budgets):
            try:
                rule(subject)
            except Exception as error:
                error.add_note(f"The rule under test: {(rule.__doc__ or '').splitlines()[0]}")
                raise


@dataclass(frozen=True)
class _Subject:
    """The searcher under test."""

    make: Callable[..., Any] | str
    make_env: MakeEnv
    evaluations: int
    seed: int

    @cached_property
    def space(self) -> Lattice:
        return self.oracle(self.make_env, Budget(evaluations=1)).space

    @cached_property
    def name(self) -> str:
        return name_of(self.searcher())

    def searcher(self) -> Searcher:
        rng = np.random.default_rng(self.seed)
        if isinstance(self.make, str):
            return make_by_name(self.make, rng, space=self.space)
        if is_function(self.make):
            return FunctionSearcher(self.make, self.space, rng)
        searcher: Searcher = self.make(self.space, rng)
        return searcher

    def make_noisy(self, n: int) -> VectorEnv[Any, Any, Any]:
        return FitnessNoise(self.make_env(n), sigma=0.3)

    def oracle(self, make_env: MakeEnv, budget: Budget) -> Oracle:
        return Oracle(make_env, budget, rng=np.random.default_rng([self.seed, 1]))

    def require(self, condition: object, message: str) -> None:
        if not condition:
            raise AssertionError(f"searcher {self.name} {message}")

    def course(self, make_env: MakeEnv, *, advised: bool = False) -> Iterator[NDArray[Any]]:
        """Yield what it asks for, batch by batch, and finally what it recommends.

        If `advised`, it is also asked for a recommendation after every batch. For a function, all
        that it evaluates is one batch.
        """
        oracle = self.oracle(make_env, Budget(evaluations=self.evaluations))
        searcher = self.searcher()
        told: list[tuple[Any, bytes]] = []
        if isinstance(searcher, FunctionSearcher):
            design = run(searcher, oracle)
            yield oracle.log.columns()["design"]
            yield self.space.to_rows(design.array)
            return
        with naming(f"searcher {self.name}"):
            for size in cycle(SIZES):
                if oracle.is_exhausted:
                    break
                asked = checked(searcher.ask(size), self.space)
                self.require(
                    size is None or len(asked) <= size,
                    f"returned {len(asked)} designs when asked for at most {size}",
                )
                yield asked
                if len(asked) == 0:
                    break
                answer = oracle.evaluate(asked)
                told.append((answer, pickle.dumps(answer)))
                searcher.tell(*answer)
                if advised:
                    searcher.recommend()
            self.require(oracle.evaluations > 0, "asked for nothing at all")
            yield self.space.to_rows(recommended(searcher.recommend(), self.space).array)
            self.require(
                all(pickle.dumps(answer) == before for answer, before in told),
                "changed the arrays that it was told",
            )

    def require_same(
        self, course: Iterable[NDArray[Any]], other: Iterable[NDArray[Any]], message: str
    ) -> None:
        """Compare two courses; the first difference fills the message's {}."""
        for step, (one, two) in enumerate(zip_longest(course, other, fillvalue=np.zeros(0))):
            self.require(
                np.array_equal(one, two),
                message.format(f"asks {_text(two)} at step {step}, not {_text(one)}"),
            )


@contextmanager
def global_states_of(seed: int, require: Callable[[object, str], None]) -> Iterator[None]:
    """Seed the global generators, and require that they are left so."""
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002, it is meant
    before = pickle.dumps(global_states())
    yield
    require(
        pickle.dumps(global_states()) == before,
        "drew from a global random generator (random or numpy.random), or seeded it; draw from the "
        "generator that it is made with",
    )


def _has_the_methods(subject: _Subject) -> None:
    """Check for the three methods."""
    REGISTRY.require_methods(subject.name, subject.searcher())


def _is_deterministic(subject: _Subject) -> None:
    """Compare equal runs with other global states, and with or without recommendations."""
    for make_env in (subject.make_env, subject.make_noisy):
        courses = []
        for seed in (1, 2):
            with global_states_of(seed, subject.require):
                courses.append(list(subject.course(make_env)))
        made_twice = "made twice with the same generator, {}; it must draw from that alone"
        subject.require_same(courses[0], courses[1], made_twice)
    advised = subject.course(subject.make_noisy, advised=True)
    subject.require_same(courses[0], advised, "was asked for its recommendation, and then {}")


def _is_undisturbed(subject: _Subject) -> None:
    """Check that two searchers in turn do what each does alone; functions can't take turns."""
    alone = list(subject.course(subject.make_env))
    pair = (subject.course(subject.make_env) for _ in range(2))
    in_turn = list(zip_longest(*pair, fillvalue=np.zeros(0)))
    message = "is disturbed by another one that runs beside it, and {}; it must share nothing"
    for course in zip(*in_turn, strict=True):
        subject.require_same(alone, course, message)


def _keeps_budgets(subject: _Subject) -> None:
    """Run into every kind of budget; the cost must agree with the log."""
    n, plain = subject.evaluations, subject.make_env
    typical = subject.oracle(plain, Budget(evaluations=1))
    typical.evaluate(np.full((1, subject.space.sites), 2))
    for make_env in (plain, subject.make_noisy, lambda n: _Stumbling(plain(n))):
        for budget in (
            Budget(unique=n // 2),
            Budget(evaluations=n),
            Budget(unique=n, evaluations=n // 2 + 1),
            Budget(evaluations=n, steps=n // 2 * typical.steps),
            Budget(evaluations=n, cpu_seconds=1e-3),
        ):
            oracle, searcher = subject.oracle(make_env, budget), subject.searcher()
            run(searcher, oracle, name=subject.name)
            may_end = isinstance(searcher, FunctionSearcher)
            subject.require(
                may_end or oracle.is_exhausted or oracle.unique >= subject.space.n_designs,
                f"ended after {oracle.evaluations} evaluations with {budget} not used up",
            )
            for limit in ("unique", "evaluations"):
                most, used = getattr(budget, limit), getattr(oracle, limit)
                subject.require(
                    most is None or used <= most, f"used {used} of {most} {limit} with {budget}"
                )
            cached = oracle.log.columns()["cached"]
            subject.require(
                oracle.evaluations == len(cached) and oracle.unique == np.count_nonzero(~cached),
                f"used {oracle.evaluations} evaluations, {oracle.unique} of them unique, but the "
                "log has other numbers",
            )


def _text(asked: NDArray[Any]) -> str:
    shown = ["".join(map(str, np.atleast_1d(row).tolist())) for row in asked[:4]]
    return f"[{', '.join(shown)}{', ...' if len(asked) > 4 else ''}]"


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
