"""The wrappers of `softvox_gym.wrappers` for vector environments, under the same names.

They return what a `SyncVectorEnv` of single environments in the single wrappers does, with the same
seeds; one call into C runs all designs of a batch with all their trials.

Examples
--------
>>> import gymnasium as gym
>>> from softvox_gym.wrappers.vector import JakobiNoise, Resample
>>> envs = gym.make_vec("SoftVox2x2x2-v0", num_envs=2, autoreset_mode="SameStep")
>>> envs = Resample(JakobiNoise(envs, level=1.0), n=64)
>>> _ = envs.reset(seed=0)
>>> print(envs.step([[0, 0, 0, 2, 1, 2, 2, 2], [2] * 8])[1].round(1))
[3.2 0.8]
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from gymnasium.wrappers.vector import TransformAction
from numpy.typing import NDArray

from softvox_gym.envs.evaluator import Action
from softvox_gym.envs.vector import Batch, batched
from softvox_gym.wrappers.steps import (
    JakobiStep,
    MeasuredStep,
    ResampleStep,
    Wrapping,
    is_noisy,
    numbered,
)

__all__ = ["DiscreteAction", "FitnessNoise", "JakobiNoise", "Resample", "is_noisy"]

Env = VectorEnv[NDArray[np.float64], NDArray[np.int64], NDArray[Any]]


class DiscreteAction(TransformAction):
    """`softvox_gym.wrappers.DiscreteAction` for a vector, ``DiscreteAction(env)``."""

    def __init__(self, env: Env) -> None:
        func, space = numbered(env.single_action_space)
        super().__init__(env, func, single_action_space=space)


class _Wrapper(Wrapping, VectorWrapper):  # typed only since Gymnasium 1.3
    """A wrapper around a vector environment."""

    def wrap(self, env: Env, **options: Any) -> None:
        """Initialise the wrapper; the spec of a vector has no wrappers."""
        VectorWrapper.__init__(self, env)

    def step(self, actions: NDArray[np.int64]) -> Batch:
        """Evaluate the designs; environments that only reset are left unchanged."""
        asked = Action.of(actions)
        within = self.before(asked)
        observations, rewards, terminated, truncated, infos = self.env.step(within)
        told: dict[str, Any] = infos.get("final_info", infos)
        if "fitness" not in told:
            return observations, rewards, terminated, truncated, infos
        self.check(within)
        which = np.flatnonzero(told["_fitness"])
        # Others' infos may be dicts, as the episode of RecordEpisodeStatistics.
        own = {k: v for k, v in told.items() if f"_{k}" in told and isinstance(v, np.ndarray)}
        of_those = {key: column[which] for key, column in own.items()}
        values, changed = self.after(asked, rewards[which], of_those, lambda: self._random(which))
        rewards = rewards.copy()
        rewards[which] = values
        told |= batched([(which, changed)], self.num_envs)
        return observations, rewards, terminated, truncated, infos

    def _random(self, which: NDArray[np.intp]) -> list[np.random.Generator]:
        generators: Any = self.env.unwrapped.np_random
        return [generators[i] for i in which]


class JakobiNoise(JakobiStep, _Wrapper):
    """`softvox_gym.wrappers.JakobiNoise` for a vector, ``JakobiNoise(env, level)``."""


class Resample(ResampleStep, _Wrapper):
    """`softvox_gym.wrappers.Resample` for a vector, ``Resample(env, n, aggregate)``."""


class FitnessNoise(MeasuredStep, _Wrapper):
    """`softvox_gym.wrappers.FitnessNoise` for a vector, ``FitnessNoise(env, sigma)``."""
