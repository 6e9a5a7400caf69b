"""Gymnasium wrappers that make an environment noisy, and that average the noise out.

Those for vector environments are in `softvox_gym.wrappers.vector`, under the same names. The same
seed gives the same noise in both: environment i of a vector that was reset with ``seed`` draws what
a single one reset with ``seed + i`` draws.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from softvox_gym.aggregates import aggregate_of, standard_error
from softvox_gym.conditions import Conditions
from softvox_gym.envs.single import Observation
from softvox_gym.noise import Channels, not_negative
from softvox_gym.portable import normal
from softvox_gym.simulation import check_count
from softvox_gym.wrappers._chain import (
    bench_of,
    chain,
    disturbable_bench_of,
    is_noisy,
    silent,
)

__all__ = ["FitnessNoise", "JakobiNoise", "Resample", "is_noisy", "silent"]

Action = NDArray[np.int64]
Step = tuple[Observation, Any, bool, bool, dict[str, Any]]
Wrapper = gym.Wrapper[Observation, Action, Observation, Action]


class JakobiNoise(Wrapper, RecordConstructorArgs):
    """Noise on what a real robot and its floor have differently each time.

    Every evaluation draws from the environment's ``np_random``, in this order: a factor on every
    voxel's strain, leaks, phases, frequency, the two frictions, stiffness, density, the floor's
    tilt and its direction, and a factor on the strain of every voxel and cycle.

    Parameters
    ----------
    env : gym.Env
        `SoftVoxEnv`, perhaps in other wrappers.
    level : float
        0 is exactly the bare environment, 1 the assumed real variability, 2 double it.
    **channels
        The amounts at level 1; see `softvox_gym.noise.Channels`:

        ================= ======= ======================================================
        channel           default meaning
        ================= ======= ======================================================
        strain            0.10    standard deviation per active voxel, share of the strain
        strain_per_cycle  0.10    the same, drawn anew per cycle and voxel
        phase             0.02    standard deviation per voxel, cycles
        frequency         0.02    standard deviation, share of the frequency
        friction          0.2     of the logarithm, static and kinetic; kinetic <= static
        stiffness         0.05    of the logarithm of Young's modulus
        density           0.05    of the logarithm
        tilt              1.0     standard deviation, degrees, in a random direction
        leak              0.01    probability per active voxel that it stays passive
        ================= ======= ======================================================

    Raises
    ------
    TypeError, ValueError
        For an environment that is not this package's or answers from the table, an unknown
        channel, or an amount or a level that is not a finite number of at least 0.

    Notes
    -----
    The duration of a run stays, so that a faster actuation has more cycles. A track has as many
    samples as the nominal: one that is longer is cut, one that is shorter stays where it ended.

    Source: Jakobi, Husbands & Harvey, "Noise and the reality gap", ECAL 1995.
    """

    def __init__(
        self, env: gym.Env[Observation, Action], level: float = 1.0, **channels: Any
    ) -> None:
        RecordConstructorArgs.__init__(self, level=level, **channels)
        super().__init__(env)
        self.level = not_negative("level", level)
        self.channels = channels_of(channels)
        self.is_noisy = self.level > 0
        self._disturbance = Disturbing(env, self.channels.at(self.level)) if self.level else None

    def step(self, action: Action) -> Step:
        """Try the design under conditions drawn anew."""
        if self._disturbance is None:
            return self.env.step(action)
        with self._disturbance.bench.disturbed(self._disturbance):
            return self.env.step(action)


class Resample(Wrapper, RecordConstructorArgs):
    """Tries every design n times, and rewards an aggregate of its values.

    All trials of a step go into C together. A trial that diverged has the value 0. The observation
    is the mean track; in the info, ``displacement`` is the mean of the trials that did not diverge,
    ``status`` is "diverged" only where all did, ``steps`` counts all trials, and there are also

    ============== ======= =====================================================
    key            shape
    ============== ======= =====================================================
    values         (n,)    the fitness of every trial, voxel widths
    displacements  (n, 3)  of every trial, voxel widths; NaN where it diverged
    mean           float   of the values
    standard_error float   of the mean; NaN for n = 1
    ============== ======= =====================================================

    Parameters
    ----------
    env : gym.Env
        An environment of this package, normally with noise on it.
    n : int
        Trials per step.
    aggregate : {"mean", "min", "q10", "cvar25"}
        The mean, the smallest, the 10 % quantile, or the mean of the worst quarter of the values.

    Raises
    ------
    TypeError, ValueError
        For another environment, one that is resampled already, an n that is not a positive whole
        number, or an unknown aggregate.
    """

    def __init__(self, env: gym.Env[Observation, Action], n: int, aggregate: str = "mean") -> None:
        RecordConstructorArgs.__init__(self, n=n, aggregate=aggregate)
        super().__init__(env)
        check_resample(env, n)
        self.n = int(n)
        self.aggregate = aggregate
        self._aggregate = aggregate_of(aggregate)
        self._bench = bench_of(env, "Resample")

    def step(self, action: Action) -> Step:
        """Try the design n times."""
        with self._bench.repeated(self.n):
            observation, _, terminated, truncated, info = self.env.step(action)
        values = info["values"]
        reward = float(self._aggregate(values))
        if info["status"] == "ok":
            info["fitness"] = reward
        info["mean"] = float(values.mean())
        info["standard_error"] = float(standard_error(values))
        return observation, reward, terminated, truncated, info


class FitnessNoise(Wrapper, RecordConstructorArgs):
    """Noise on the measurement of the fitness alone; the robot travels as it would.

    Adds a normal error to the reward and to ``info["fitness"]``, drawn from the environment's
    ``np_random``; a design that diverged keeps its reward of 0. Inside a `Resample` every trial is
    measured with an error of its own, around one the aggregate is.

    Parameters
    ----------
    env : gym.Env
        An environment of this package.
    sigma : float
        Standard deviation, voxel widths.

    Raises
    ------
    TypeError, ValueError
        For another environment, or a sigma that is not a finite number of at least 0.
    """

    def __init__(self, env: gym.Env[Observation, Action], sigma: float) -> None:
        RecordConstructorArgs.__init__(self, sigma=sigma)
        super().__init__(env)
        self.sigma = not_negative("sigma", sigma)
        self.is_noisy = self.sigma > 0
        self._bench = bench_of(env, "FitnessNoise")

    def step(self, action: Action) -> Step:
        """Try the design, and measure with an error."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        if not self.is_noisy:
            return observation, reward, terminated, truncated, info
        if self._bench.repeats is not None:
            errors = self.sigma * normal(self.np_random, len(info["values"]))
            info["values"] = measured(info["values"], errors, info["displacements"])
            reward = float(info["values"].mean())
        else:
            error = self.sigma * normal(self.np_random, 1)[0]
            reward = float(measured(reward, error, info["displacement"]))
        if info["status"] == "ok":
            info["fitness"] = reward
        return observation, reward, terminated, truncated, info


class Disturbing:
    """The disturbance of an environment by noise of some amounts."""

    def __init__(self, env: Any, amounts: Channels) -> None:
        self.bench = disturbable_bench_of(env, "JakobiNoise")
        self._amounts = amounts
        self._cycles = amounts.cycles_to_draw(self.bench.physics)
        self._settle_time = self.bench.physics.settle_time

    def __call__(self, conditions: Conditions, rng: np.random.Generator) -> Conditions:
        """Return the conditions, disturbed."""
        return self._amounts.disturb(
            conditions, rng, cycles=self._cycles, settle_time=self._settle_time
        )


def channels_of(amounts: dict[str, float]) -> Channels:
    """Return the channels of the given names.

    Raises
    ------
    TypeError, ValueError
        For an unknown name, listing the known ones, or a bad amount.
    """
    known = Channels.__dataclass_fields__
    for name in amounts:
        if name not in known:
            raise ValueError(f"JakobiNoise has no channel {name!r}; they are {', '.join(known)}")
    return Channels(**amounts)


def check_resample(env: Any, n: int) -> None:
    """Make sure that an environment can be resampled n times per step.

    Raises
    ------
    TypeError, ValueError
        Where it is resampled already, or n is no positive whole number.
    """
    check_count("n", n, least=1)
    if any(type(link).__name__ == "Resample" for link in chain(env)):
        raise ValueError("the environment is resampled already; raise that n instead")


def measured(values: Any, errors: Any, displacement: NDArray[np.float64]) -> Any:
    """Return values with errors added, but for those that diverged.

    Parameters
    ----------
    values, errors : float or ndarray, shape (...)
    displacement : ndarray, shape (..., 3)
        NaN where it diverged.
    """
    return np.where(np.isnan(displacement[..., 0]), values, values + errors)
