"""The wrappers of `softvox_gym.wrappers` for vector environments, under the same names.

They return what a `SyncVectorEnv` of single environments in the single wrappers does, with the same
seeds; all designs of a batch, and all their trials, go into C together.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from softvox_gym.aggregates import aggregate_of, standard_error
from softvox_gym.envs.vector import Batch
from softvox_gym.noise import not_negative
from softvox_gym.portable import normal
from softvox_gym.wrappers import Disturbing, channels_of, check_resample, measured
from softvox_gym.wrappers._chain import bench_of, is_noisy

__all__ = ["FitnessNoise", "JakobiNoise", "Resample", "is_noisy"]

Env = VectorEnv[NDArray[np.float64], NDArray[np.int64], NDArray[Any]]
Wrapper = VectorWrapper[
    NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[Any]
]


class JakobiNoise(Wrapper):
    """`softvox_gym.wrappers.JakobiNoise` for a vector environment.

    Parameters
    ----------
    env : VectorEnv
        `SoftVoxVectorEnv`, perhaps in other wrappers.
    level : float
    **channels
        As there.

    Raises
    ------
    TypeError, ValueError
        As there.
    """

    def __init__(self, env: Env, level: float = 1.0, **channels: float) -> None:
        super().__init__(env)
        self.level = not_negative("level", level)
        self.channels = channels_of(channels)
        self.is_noisy = self.level > 0
        self._disturbance = Disturbing(env, self.channels.at(self.level)) if self.level else None

    def step(self, actions: NDArray[np.int64]) -> Batch:
        """Try the designs, each under conditions drawn anew."""
        if self._disturbance is None:
            return self.env.step(actions)
        with self._disturbance.bench.disturbed(self._disturbance):
            return self.env.step(actions)


class Resample(Wrapper):
    """`softvox_gym.wrappers.Resample` for a vector environment.

    Parameters
    ----------
    env : VectorEnv
        An environment of this package, normally with noise on it.
    n : int
    aggregate : {"mean", "min", "q10", "cvar25"}
        As there.

    Raises
    ------
    TypeError, ValueError
        As there.
    """

    def __init__(self, env: Env, n: int, aggregate: str = "mean") -> None:
        super().__init__(env)
        check_resample(env, n)
        self.n = int(n)
        self.aggregate = aggregate
        self._aggregate = aggregate_of(aggregate)
        self._bench = bench_of(env, "Resample")

    def step(self, actions: NDArray[np.int64]) -> Batch:
        """Try every design n times."""
        with self._bench.repeated(self.n):
            observations, rewards, terminations, truncations, infos = self.env.step(actions)
        if terminations.any():
            told = step_infos(infos)
            stepped, values = told["_values"], told["values"]
            rewards = np.where(stepped, self._aggregate(values), 0.0)
            told["fitness"] = np.where(told["status"] == "ok", rewards, told["fitness"])
            told["mean"] = np.where(stepped, values.mean(axis=1), 0.0)
            told["_mean"] = stepped.copy()
            told["standard_error"] = np.where(stepped, standard_error(values), 0.0)
            told["_standard_error"] = stepped.copy()
        return observations, rewards, terminations, truncations, infos


class FitnessNoise(Wrapper):
    """`softvox_gym.wrappers.FitnessNoise` for a vector environment.

    Parameters
    ----------
    env : VectorEnv
        An environment of this package.
    sigma : float
        As there.

    Raises
    ------
    TypeError, ValueError
        As there.
    """

    def __init__(self, env: Env, sigma: float) -> None:
        super().__init__(env)
        self.sigma = not_negative("sigma", sigma)
        self.is_noisy = self.sigma > 0
        self._bench = bench_of(env, "FitnessNoise")

    def step(self, actions: NDArray[np.int64]) -> Batch:
        """Try the designs, and measure with errors."""
        observations, rewards, terminations, truncations, infos = self.env.step(actions)
        if not self.is_noisy or not terminations.any():
            return observations, rewards, terminations, truncations, infos
        told = step_infos(infos)
        stepped = told["_fitness"]
        if self._bench.repeats is not None:
            errors = self._errors(stepped, told["values"].shape)
            told["values"] = measured(told["values"], errors, told["displacements"])
            rewards = told["values"].mean(axis=1)
        else:
            rewards = measured(rewards, self._errors(stepped, rewards.shape), told["displacement"])
        told["fitness"] = np.where(told["status"] == "ok", rewards, told["fitness"])
        return observations, rewards, terminations, truncations, infos

    def _errors(self, stepped: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.float64]:
        """Return an error for every value of the environments that stepped, 0 for the others."""
        errors = np.zeros(shape)
        generators: Any = self.env.unwrapped.np_random
        for i in np.flatnonzero(stepped):
            errors[i] = self.sigma * normal(generators[i], shape[1:] or 1).reshape(shape[1:])
        return errors


def step_infos(infos: dict[str, Any]) -> dict[str, Any]:
    """Return the part of a vector environment's infos that tells of the step just taken."""
    told: dict[str, Any] = infos.get("final_info", infos)
    return told
