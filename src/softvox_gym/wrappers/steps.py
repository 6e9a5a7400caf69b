"""The wrappers' work on a batch of n designs; a single environment is a batch of one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import prod
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from softvox_gym.envs.evaluator import Action, Evaluator
from softvox_gym.evaluation import MOST_TRIALS, aggregate_of, measure, standard_error
from softvox_gym.noise import Jakobi, MeasurementNoise
from softvox_gym.simulation import check_count

Array = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]
Generators = Callable[[], Sequence[np.random.Generator]]


class Wrapping:
    """What a wrapper does before and after the step of the environment inside it.

    It keeps no state between steps, so threads may step environments side by side.
    """

    #: Whether two steps of one design may differ.
    is_noisy = False

    def wrap(self, env: Any, **options: Any) -> None:
        """Become a wrapper around an environment, made with options."""
        raise NotImplementedError

    def before(self, action: Action) -> Action:
        """Return the action with added requests."""
        return action

    def check(self, asked: Action) -> None:
        """Check that the environment received the requests for the step that it made.

        Raises
        ------
        TypeError
            If it did not.
        """
        if asked.heard == []:
            raise TypeError(
                f"the requests of {type(self).__name__} don't reach the environment: a wrapper "
                "inside it makes a new array or list of the action; put that wrapper around "
                f"{type(self).__name__} instead"
            )

    def after(
        self, action: Action, rewards: Array, infos: Columns, generators: Generators
    ) -> tuple[Array, Columns]:
        """Return rewards, shape (n,) or (n, m), and the infos that change, each of shape (n, ...).

        The action is the one from outside; the generators are those of the n environments.
        """
        return rewards, {}


class JakobiStep(Wrapping):
    """`Jakobi` noise on every trial."""

    def __init__(self, env: Any, level: float = 1.0, **amounts: float) -> None:
        self.wrap(env, level=level, **amounts)
        self.noise = Jakobi(level, **amounts)
        self.level = self.noise.level
        self.is_noisy = self.level > 0
        if evaluator_of(env, "JakobiNoise").from_table and self.is_noisy:
            raise ValueError(
                "JakobiNoise can't disturb results that come from a table; "
                "make SoftVox2x2x2-v0 instead"
            )

    def before(self, action: Action) -> Action:
        """Ask for the noise."""
        return action.asking(self.noise) if self.is_noisy else action


class ResampleStep(Wrapping):
    """Several trials, and an aggregate of them."""

    def __init__(self, env: Any, n: int, aggregate: str = "mean") -> None:
        self.wrap(env, n=n, aggregate=aggregate)
        check_count("n", n, least=1, most=MOST_TRIALS)
        self.n = int(n)
        self.aggregate = aggregate
        self._aggregate = aggregate_of(aggregate)
        evaluator_of(env, "Resample")
        if any(isinstance(link, ResampleStep) for link in chain(env)):
            raise ValueError("the environment is resampled already; increase n there instead")

    def before(self, action: Action) -> Action:
        """Ask for the trials."""
        return action.asking(trials=self.n)

    def after(
        self, action: Action, rewards: Array, infos: Columns, generators: Generators
    ) -> tuple[Array, Columns]:
        """Aggregate the values, and the objectives."""
        values = infos["values"]
        fitness = rewards = self._aggregate(values)
        if "objectives" in infos:
            rewards = self._aggregate(np.moveaxis(infos["objectives"], 1, -1))
        return rewards, {
            "fitness": np.where(infos["diverged"], infos["fitness"], fitness),
            "mean": values.mean(axis=1),
            "standard_error": standard_error(values),
        }


class MeasuredStep(Wrapping):
    """Noise on the measured fitness: on every trial if a wrapper outside asks for several."""

    def __init__(self, env: Any, sigma: float) -> None:
        self.wrap(env, sigma=sigma)
        self.noise = MeasurementNoise(sigma)
        self.sigma = self.noise.sigma
        self.is_noisy = self.sigma > 0
        if evaluator_of(env, "FitnessNoise").asked:
            raise ValueError(
                "FitnessNoise measures one number, but the environment has objectives; "
                "evaluate(..., objectives=..., perturbations=[MeasurementNoise(sigma)]) takes both"
            )

    def after(
        self, action: Action, rewards: Array, infos: Columns, generators: Generators
    ) -> tuple[Array, Columns]:
        """Measure."""
        if not self.is_noisy:
            return rewards, {}
        is_each = action.trials is not None
        values = (infos["values"] if is_each else rewards[:, np.newaxis]).copy()
        diverged = np.isnan(infos["displacements"][..., 0]) if is_each else infos["diverged"]
        measure(values, diverged.reshape(values.shape), [self.noise], generators())
        rewards = values.mean(axis=1) if is_each else values[:, 0]
        fitness = np.where(infos["diverged"], infos["fitness"], rewards)
        return rewards, {"fitness": fitness, **({"values": values} if is_each else {})}


def numbered(
    space: gym.Space[Any],
) -> tuple[Callable[[ArrayLike], Action], spaces.Discrete]:
    """Return a function from numbers to the digits of a space, lowest first, and their space.

    Raises
    ------
    TypeError, ValueError
        If the space is no row of digits, or has more actions than int64 can count.
    """
    if not isinstance(space, spaces.MultiDiscrete) or space.nvec.ndim != 1:
        raise TypeError(f"DiscreteAction needs a MultiDiscrete action of one row, got {space}")
    bases = [int(base) for base in space.nvec]
    if (n := prod(bases)) > np.iinfo(np.int64).max:
        raise ValueError(
            f"DiscreteAction needs an action space that int64 can count, at most 39 sites with "
            f"three digits; got {len(bases)} sites"
        )
    weights = np.cumprod([1, *bases[:-1]], dtype=np.int64)
    return partial(_digits, weights, np.array(bases)), spaces.Discrete(n)


def _digits(weights: NDArray[np.int64], bases: NDArray[np.int64], numbers: ArrayLike) -> Action:
    """Return the digits of numbers, keeping the requests for the step."""
    asked = Action.of(numbers)
    n = prod(bases.tolist())
    if asked.dtype.kind not in "iu" or (asked.size and not 0 <= asked.min() <= asked.max() < n):
        raise ValueError(
            f"an action must be a whole number from 0 to {n - 1}, got {asked.tolist()!r}"
        )
    return Action.of(asked[..., np.newaxis].astype(np.int64) // weights % bases)


def evaluator_of(env: Any, wrapper: str) -> Evaluator:
    """Return the evaluator of an environment; TypeError if it is not this package's."""
    evaluator = getattr(env.unwrapped, "evaluator", None)
    if not isinstance(evaluator, Evaluator):
        raise TypeError(
            f"{wrapper} works on this package's environments whose action is a design, got "
            f"{env.unwrapped}; put it around single ones before they are made one vector, "
            "gym.make_vec(..., wrappers=[...])"
        )
    return evaluator


def chain(env: Any) -> Iterator[Any]:
    """Yield an environment and those inside it, outermost first."""
    while env is not None:
        yield env
        inner = getattr(env, "env", None)
        env = inner if inner is not None else next(iter(getattr(env, "envs", ())), None)


def is_noisy(env: Any) -> bool:
    """Return whether two steps of one design may differ.

    Any wrapper with a true attribute `is_noisy` makes them differ; this package's wrappers have it.
    """
    return any(getattr(link, "is_noisy", False) for link in chain(env))


def silent(env: Any) -> Any | None:
    """Return the outermost foreign wrapper that doesn't declare whether it is noisy, if any.

    Gymnasium's wrappers and this package's are known.
    """
    for link in chain(env):
        package = type(link).__module__.partition(".")[0]
        if package not in ("gymnasium", "softvox_gym") and not hasattr(link, "is_noisy"):
            return link
    return None
