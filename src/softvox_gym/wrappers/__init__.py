"""Gymnasium wrappers that add noise, average it out, number the actions, or make films.

The wrappers for vector environments are in `softvox_gym.wrappers.vector`, under the same names. The
same seed gives the same noise in both: environment i of a vector that was reset with ``seed`` draws
what a single environment reset with ``seed + i`` draws.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from gymnasium.wrappers import RecordVideo, TransformAction
from numpy.typing import NDArray

from softvox_gym.envs.evaluator import Action
from softvox_gym.envs.single import Observation, plain
from softvox_gym.wrappers.steps import (
    JakobiStep,
    MeasuredStep,
    ResampleStep,
    Wrapping,
    is_noisy,
    numbered,
    silent,
)

__all__ = [
    "DiscreteAction",
    "FitnessNoise",
    "JakobiNoise",
    "RecordWalk",
    "Resample",
    "is_noisy",
    "silent",
]

Env = gym.Env[Observation, NDArray[np.int64]]
Step = tuple[Observation, Any, bool, bool, dict[str, Any]]


class RecordWalk(RecordVideo):
    """Gymnasium's `RecordVideo`, with its options, for ``render_mode="rgb_array_list"``.

    It films every picture that an environment renders after a step, not only the last: the whole
    walk of a robot. Needs moviepy.

    Raises
    ------
    ValueError
        If the render mode is another.

    Examples
    --------
    >>> env = gym.make("SoftVox2x2x2-v0", render_mode="rgb_array_list")  # doctest: +SKIP
    >>> env = RecordWalk(env, "films", episode_trigger=lambda episode: True)  # doctest: +SKIP
    """

    def __init__(self, env: Env, video_folder: str, **options: Any) -> None:
        if env.render_mode != "rgb_array_list":
            raise ValueError(
                "RecordWalk films an environment made with render_mode='rgb_array_list', got "
                f"{env.render_mode!r}"
            )
        super().__init__(env, video_folder, **options)

    def _capture_frame(self) -> None:
        pictures: Any = self.env.render()
        self.recorded_frames += pictures


class DiscreteAction(TransformAction[Any, Any, Any], RecordConstructorArgs):
    """Takes a design's number as action: ``Discrete(6561)`` on the 2x2x2 lattice.

    Parameters
    ----------
    env : gym.Env
        Its action must be a row of digits, ``MultiDiscrete``: those of the number, lowest first.

    Raises
    ------
    TypeError, ValueError
        If the actions are others, or more than int64 can count (a lattice of 40 sites); by `step`
        if the number is none of these.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from softvox_gym.wrappers import DiscreteAction
    >>> env = DiscreteAction(gym.make("SoftVox2x2x2-v0"))
    >>> _ = env.reset(seed=0)
    >>> print(env.action_space, round(env.step(6453)[1], 2))
    Discrete(6561) 4.66
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)  # first, so that no function gets into the spec
        TransformAction.__init__(self, env, *numbered(env.action_space))


class _Wrapper(
    Wrapping,
    gym.Wrapper[Observation, NDArray[np.int64], Observation, NDArray[np.int64]],
    RecordConstructorArgs,
):
    """A wrapper around a single environment: a batch of one."""

    def wrap(self, env: Env, **options: Any) -> None:
        """Keep the options for the spec."""
        RecordConstructorArgs.__init__(self, **options)
        gym.Wrapper.__init__(self, env)

    def step(self, action: NDArray[np.int64]) -> Step:
        """Evaluate the design; a step that only resets passes through."""
        asked = Action.of(action)
        within = self.before(asked)
        observation, reward, terminated, truncated, info = self.env.step(within)
        if "fitness" not in info:
            return observation, reward, terminated, truncated, info
        self.check(within)
        columns = {key: np.asarray(value)[np.newaxis] for key, value in info.items()}
        rewards, changed = self.after(
            asked, np.array([reward], dtype=np.float64), columns, lambda: [self.np_random]
        )
        told = {**info, **{key: plain(column[0]) for key, column in changed.items()}}
        return observation, plain(rewards[0]), terminated, truncated, told


class JakobiNoise(JakobiStep, _Wrapper):
    """Noise on the properties of a real robot and its floor that vary from run to run.

    Every evaluation draws from the environment's ``np_random``, source by source in the order of
    `softvox_gym.noise.SOURCES`.

    Parameters
    ----------
    env : gym.Env
        A `SoftVoxEnv`, possibly in other wrappers.
    level, **amounts
        As in `softvox_gym.noise.Jakobi`.

    Raises
    ------
    TypeError, ValueError
        As `Jakobi` does, or if the environment is not this package's or answers from the table.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from softvox_gym.wrappers import JakobiNoise
    >>> env = JakobiNoise(gym.make("SoftVox2x2x2-v0"), level=1.0)
    >>> _ = env.reset(seed=0)
    >>> print([round(env.step([0, 0, 0, 2, 1, 2, 2, 2])[1], 1) for _ in range(3)])
    [2.8, 2.9, 2.9]
    """


class Resample(ResampleStep, _Wrapper):
    """Tries every design n times; the reward is an aggregate of the values.

    One call into C runs all trials of a step. A trial that diverged has the value 0. The
    observation is the mean track. In the info, ``displacement`` is the mean of the trials that did
    not diverge, ``diverged`` is true only if all did, and ``steps`` counts all trials. Added are

    ============== ======= =====================================================
    key            shape
    ============== ======= =====================================================
    values         (n,)    the fitness of every trial, voxel widths
    objectives     (n, m)  of every trial, where the environment has objectives
    displacements  (n, 3)  of every trial, voxel widths; NaN where it diverged
    mean           float   of the values
    standard_error float   of the mean; NaN for n = 1
    ============== ======= =====================================================

    Parameters
    ----------
    env : gym.Env
        An environment of this package, normally with noise.
    n : int
        Trials per step.
    aggregate : {"mean", "min", "q10", "cvar25"}
        The mean, the smallest, the 10 % quantile, or the mean of the worst quarter of the values.

    Raises
    ------
    TypeError, ValueError
        If the environment is another or already resampled, n is not a positive whole number, or the
        aggregate is unknown.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from softvox_gym.wrappers import JakobiNoise, Resample
    >>> env = Resample(JakobiNoise(gym.make("SoftVox2x2x2-v0"), level=1.0), n=64, aggregate="q10")
    >>> _ = env.reset(seed=0)
    >>> info = env.step([0, 0, 0, 2, 1, 2, 2, 2])[4]
    >>> print(info["values"].shape, round(info["mean"], 1), round(info["fitness"], 1))
    (64,) 3.2 1.8
    """


class FitnessNoise(MeasuredStep, _Wrapper):
    """Noise on the measured fitness only; the robot's motion is unchanged.

    Adds a normally distributed error to the reward and to ``info["fitness"]``, drawn from the
    environment's ``np_random``; a design that diverged keeps its reward of 0. Around a `Resample`
    it adds one error to the aggregate, inside one an error of its own to every trial.

    Parameters
    ----------
    env : gym.Env
        An environment of this package.
    sigma : float
        Standard deviation, voxel widths.

    Raises
    ------
    TypeError, ValueError
        As `softvox_gym.noise.MeasurementNoise` does, or if the environment is another.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from softvox_gym.wrappers import FitnessNoise
    >>> env = FitnessNoise(gym.make("SoftVox2x2x2-v0"), sigma=0.1)
    >>> _ = env.reset(seed=0)
    >>> print([round(env.step([0, 0, 0, 2, 1, 2, 2, 2])[1], 2) for _ in range(3)])
    [4.67, 4.64, 4.72]
    """
