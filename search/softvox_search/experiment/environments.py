"""The environments of a problem, and whether everything that an experiment names can be made."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from itertools import product
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv

from softvox_gym import ENV_ID, TABLE_ENV_ID
from softvox_gym.landscapes.table import has_table
from softvox_gym.wrappers import vector
from softvox_search.experiment import transfer
from softvox_search.experiment.schema import NOISE, Experiment, Problem, UsageError, meant, tried
from softvox_search.experiment.transfer import TransferExperiment
from softvox_search.oracle import Budget, MakeEnv, Oracle
from softvox_search.policies import with_policy
from softvox_search.registry import found, make


class Environments:
    """Makes the environments of problems, and keeps them for later runs.

    An environment costs more to make than a batch from the table, and keeps no state between
    batches. A wrapper from another package may keep state, so those are made anew for every run.
    """

    def __init__(self) -> None:
        self._made: dict[tuple[str, int], VectorEnv[Any, Any, Any]] = {}

    def of(self, problem: Problem) -> MakeEnv:
        """Return a function that makes the environments of a problem."""
        is_kept = not any(":" in wrapper["name"] for wrapper in problem.wrappers)
        made = self._made if is_kept else {}

        def make_env(num_envs: int) -> VectorEnv[Any, Any, Any]:
            key = (repr(problem), num_envs)
            if key not in made:
                made[key] = _environment(problem, num_envs)
            return made[key]

        return make_env


def answers_from_table(problem: Problem) -> bool:
    """Return whether the table gives the engine's bits.

    It does unless something disturbs the simulation itself. Noise on the measurement does not, but
    what a wrapper from another package does is unknown.
    """
    return (
        problem.table
        and not problem.changes
        and has_table(problem.shape)
        and not any(
            ":" in wrapper["name"] or (wrapper["name"] == NOISE and wrapper.get("level", 1) != 0)
            for wrapper in problem.stack()
        )
    )


def check(
    experiment: Experiment | TransferExperiment, place: str, progress: Callable[[int, int], None]
) -> None:
    """Make every environment and every searcher, or every method, once, before the work.

    Raises
    ------
    If a wrapper, policy or searcher can't be made as the file says; the message begins with
    the place.
        the place.
    """
    if isinstance(experiment, TransferExperiment):
        transfer.check(experiment, place, progress)
        return
    environments, noisy = Environments(), experiment.levels is not None
    for problem in experiment.problems():
        names = ", ".join(wrapper["name"] for wrapper in problem.stack()) or "none"
        oracle = tried(
            f"{place}: [[wrappers]] {names}, on {problem.physics} {problem.shape}",
            lambda: _stepped(environments.of(problem)),  # noqa: B023, called at once
        )
        noisy = oracle.noisy or noisy
    if experiment.policies and not noisy:
        raise UsageError(
            f"{place}: [[policies]] deal with noisy evaluations, but nothing is noisy here; give "
            "levels or a wrapper with noise, or drop them"
        )
    for choice, shape in product(experiment.searcher_choices(), experiment.shapes()):
        searcher = tried(
            f"{place}: [[searchers]] {choice.label}",
            lambda: make(choice.name, np.random.default_rng(0), space=shape, **choice.options),  # noqa: B023
        )
        for policy in experiment.policies:
            tried(
                f"{place}: [[policies]] {policy.name}: with {choice.label}",
                lambda: with_policy(searcher, policy.policy, shape, choice.budget.checked()),  # noqa: B023
            )


def _environment(problem: Problem, num_envs: int) -> Any:
    env: Any
    if answers_from_table(problem):
        env = gym.make_vec(TABLE_ENV_ID, num_envs=num_envs, phases=problem.shape.phases)
    else:  # one thread: the runs themselves are in parallel
        options: dict[str, Any] = {"shape": problem.shape, "physics": problem.values, "threads": 1}
        env = gym.make_vec(ENV_ID, num_envs=num_envs, **options)
    for wrapper in problem.stack():
        env = _wrapped(env, **wrapper)
    return env


def _wrapped(env: Any, *, name: str, **options: Any) -> Any:
    if ":" in name:
        kind = found(name)
    else:
        # The oracle's actions are digits.
        known = [name for name in vector.__all__ if name not in ("DiscreteAction", "is_noisy")]
        if name not in known:
            raise ValueError(
                f"there is no wrapper {name!r}{meant(name, known)}; they are {', '.join(known)}, "
                "and your own as package.module:Class"
            )
        kind = getattr(vector, name)
    try:
        inspect.signature(kind).bind(env, **options)
    except TypeError as error:
        keys = ", ".join(list(inspect.signature(kind).parameters)[1:])
        raise TypeError(f"{name}: {error}; its keys are {keys}") from None
    return kind(env, **options)


def _stepped(make_env: MakeEnv) -> Oracle:
    """Return an oracle that has tried the empty design."""
    oracle = Oracle(make_env, Budget(evaluations=1), rng=np.random.default_rng(0))
    oracle.evaluate(np.zeros((1, oracle.space.sites), dtype=np.int64))
    return oracle
