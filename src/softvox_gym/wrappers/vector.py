"""The wrappers of `softvox_gym.wrappers` for vector environments, under the same names.

They return what a `SyncVectorEnv` of single environments in the single wrappers does, with the same
seeds; all designs of a batch, and all their trials, go into C together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper
from numpy.typing import NDArray

from softvox_gym.envs.evaluator import Action
from softvox_gym.envs.vector import Batch, batched
from softvox_gym.wrappers.steps import (
    JakobiStep,
    MeasuredStep,
    ResampleStep,
    Wrapping,
    is_noisy,
)

__all__ = ["FitnessNoise", "JakobiNoise", "Resample", "is_noisy"]

Env = VectorEnv[NDArray[np.float64], NDArray[np.int64], NDArray[Any]]

if TYPE_CHECKING:
    _Base = VectorWrapper[
        NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[Any]
    ]
else:
    _Base = VectorWrapper  # not generic before Gymnasium 1.3


class _Wrapper(Wrapping, _Base):
    """A wrapper around a vector environment."""

    def step(self, actions: NDArray[np.int64]) -> Batch:
        """Try the designs; of those that only reset nothing changes."""
        asked = Action.of(actions)
        observations, rewards, terminated, truncated, infos = self.env.step(self.before(asked))
        told: dict[str, Any] = infos.get("final_info", infos)
        if "fitness" not in told:
            return observations, rewards, terminated, truncated, infos
        which = np.flatnonzero(told["_fitness"])
        names = [key for key in told if f"_{key}" in told]
        of_those = {key: told[key][which] for key in names}
        values, changed = self.after(asked, rewards[which], of_those, lambda: self._random(which))
        rewards = np.zeros_like(rewards)
        rewards[which] = values
        told |= batched(changed, which, self.num_envs)
        return observations, rewards, terminated, truncated, infos

    def _random(self, which: NDArray[np.intp]) -> list[np.random.Generator]:
        generators: Any = self.env.unwrapped.np_random
        return [generators[i] for i in which]


class JakobiNoise(JakobiStep, _Wrapper):
    """`softvox_gym.wrappers.JakobiNoise` for a vector environment.

    Parameters
    ----------
    env : VectorEnv
        `SoftVoxVectorEnv`, perhaps in other wrappers.
    level : float
    **amounts
        As there.

    Raises
    ------
    TypeError, ValueError
        As there.
    """

    def __init__(self, env: Env, level: float = 1.0, **amounts: float) -> None:
        VectorWrapper.__init__(self, env)
        JakobiStep.__init__(self, env, level, amounts)


class Resample(ResampleStep, _Wrapper):
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
        VectorWrapper.__init__(self, env)
        ResampleStep.__init__(self, env, n, aggregate)


class FitnessNoise(MeasuredStep, _Wrapper):
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
        VectorWrapper.__init__(self, env)
        MeasuredStep.__init__(self, env, sigma)
