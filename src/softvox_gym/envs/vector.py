"""Native vector environments: for any episodes, and for a batch of designs in one call into C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from softvox_gym.envs.episodes import Episodes, Film, Rows, Started, moving, pictured
from softvox_gym.envs.evaluator import Evaluator
from softvox_gym.simulation import check_count

Batch = tuple[
    NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
]


#: Infos of some environments: their numbers, and for each key an array with a row for each.
Part = tuple[NDArray[np.intp], dict[str, Any]]


def batched(parts: Sequence[Part], n: int) -> dict[str, Any]:
    """Return infos of some of n environments as arrays of n rows, with masks of which have them.

    Keys are in the order in which the environments, one after another, introduce them.
    """
    infos: dict[str, Any] = {}
    told = [part for part in parts if len(part[0])]
    for which, columns in sorted(told, key=lambda part: int(part[0][0])):
        for key, column in columns.items():
            if isinstance(column, dict):
                infos[key] = batched([(which, column)], n)
            else:
                none = None if column.dtype == object else 0
                blank = np.full((n, *column.shape[1:]), none, dtype=column.dtype)
                infos.setdefault(key, blank)[which] = column
            infos.setdefault(f"_{key}", np.zeros(n, dtype=np.bool_))[which] = True
    return infos


class NativeVectorEnv(VectorEnv[NDArray[Any], NDArray[Any], NDArray[Any]]):
    """A vector environment that runs its episodes side by side.

    It returns what a ``SyncVectorEnv`` of single environments does; see `SoftVoxVectorEnv`.
    """

    def __init__(
        self, episodes: Episodes, num_envs: int, autoreset_mode: str | AutoresetMode
    ) -> None:
        check_count("num_envs", num_envs, least=1)
        self.episodes = episodes
        self.num_envs = num_envs = int(num_envs)
        self.physics = episodes.physics
        self.render_mode = episodes.render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**episodes.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_action_space = episodes.single_action_space
        self.single_observation_space = episodes.single_observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._reward_shape: tuple[int, ...] = ()
        if episodes.reward_space is not None:
            self.reward_space = episodes.reward_space
            self._reward_shape = episodes.reward_space.shape

        self._generators: list[np.random.Generator | None] = [None] * num_envs
        space = self.observation_space
        self._observations = np.zeros(space.shape or (), space.dtype)
        self._seen: list[list[Film | None]] = [[] for _ in range(num_envs)]  # as of SingleEnv
        self._has_reset = np.zeros(num_envs, dtype=np.bool_)
        self._is_over = np.zeros(num_envs, dtype=np.bool_)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generator of every environment."""
        return tuple(map(self._generator, range(self.num_envs)))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seed of every environment."""
        sequences: Any = [generator.bit_generator.seed_seq for generator in self.np_random]
        return tuple(sequence.entropy for sequence in sequences)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Start episodes; return observations and infos.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Environment i gets seed + i, or item i of the sequence; None keeps its generator.
        options : dict, optional
            "reset_mask": a bool array of shape (num_envs,), which environments to reset.

        Raises
        ------
        TypeError, ValueError
            If the mask or the sequence of seeds does not fit.
        ResetNeeded
            If the mask leaves out an environment that was never reset.
        """
        n = self.num_envs
        seeds = _seeds(seed, n)
        mask = self._reset_mask(options or {})
        if not np.all(self._has_reset | mask):
            raise ResetNeeded("reset() all environments before resetting some of them by a mask")
        for i in np.flatnonzero(mask):
            if (own := seeds[i]) is not None:
                self._generators[i], _ = seeding.np_random(own)
        self._has_reset |= mask
        told = self._start_anew(mask)
        return self._observations.copy(), batched(told, n)

    def step(self, actions: ArrayLike) -> Batch:
        """Make a step; the single environment and the autoreset modes define what is returned.

        Raises
        ------
        ValueError
            If the actions are not in the action space.
        ResetNeeded
            Before the first reset.
        AssertionError
            If autoreset is disabled and an episode that is over was not reset.
        """
        n, over = self.num_envs, self._is_over
        if not self._has_reset.all():
            raise ResetNeeded("cannot call step() before reset()")
        if self.autoreset_mode is AutoresetMode.DISABLED:
            assert not over.any(), f"reset these first, they are over: {over}"
        batch = np.asanyarray(actions)
        if batch.shape[:1] != (n,):
            raise ValueError(f"actions must be {n}, one per environment, got shape {batch.shape}")

        which = np.flatnonzero(~over)
        rewards, ends = np.zeros((n, *self._reward_shape)), np.zeros((2, n), dtype=np.bool_)
        told: list[Part] = []
        if len(which):
            observations, rewards[which], *ended, columns, films, finals = self.episodes.step(
                which, batch[which], lambda: self._generators_of(which)
            )
            self._observations[which], ends[:, which] = observations, ended
            for i, film in zip(which, films, strict=True):
                self._seen[i].append(film)
            last = np.flatnonzero(ends.any(axis=0))
            told += [(which, dict(columns)), (last, dict(finals))]
        is_over = ends[0] | ends[1]
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            told = self._told_finally(is_over, told)
            told += self._start_anew(is_over)
        else:
            told += self._start_anew(over)
            self._is_over = is_over
        return self._observations.copy(), rewards, *ends, batched(told, n)

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture, or a list of them, per environment; None without a render mode."""
        if not self._has_reset.all():
            raise ResetNeeded("cannot call render() before reset()")
        if self.render_mode is None:
            return None
        if self.render_mode == "rgb_array":
            return tuple(pictured(seen[-1]) for seen in self._seen)
        pictures = tuple(map(moving, self._seen))
        self._seen = [[] for _ in self._seen]
        return pictures

    def _start_anew(
        self, which: NDArray[np.bool_], start: Callable[[Rows], Started] | None = None
    ) -> list[Part]:
        """Start episodes, by their own `start` or the given one; return their infos."""
        rows = np.flatnonzero(which)
        if len(rows) == 0:
            return []
        observations, infos, films = (
            self.episodes.start(rows, lambda: self._generators_of(rows))
            if start is None
            else start(rows)
        )
        self._observations[rows] = observations
        self._is_over[rows] = False
        for i, film in zip(rows, films, strict=True):
            self._seen[i] = [film]
        return [(rows, dict(infos))]

    def _told_finally(self, is_over: NDArray[np.bool_], told: list[Part]) -> list[Part]:
        """Return all infos, with those of finished episodes under final_info."""
        [(_, columns), (_, finals)] = told
        going, over = np.flatnonzero(~is_over), np.flatnonzero(is_over)
        last = np.empty(len(over), dtype=object)
        for k, i in enumerate(over):
            last[k] = self._observations[i].copy()
        rows = {key: column[over] for key, column in columns.items()} | finals
        kept = {key: column[going] for key, column in columns.items()}
        return [(going, kept), (over, {"final_obs": last, "final_info": rows})]

    def _reset_mask(self, options: dict[str, Any]) -> NDArray[np.bool_]:
        """Return which environments to reset."""
        mask = options.get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError(f"options['reset_mask'] must be a numpy array of bool, got {mask!r}")
        if mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"options['reset_mask'] must have shape ({self.num_envs},) and one True or more, "
                f"got {mask}"
            )
        return mask

    def _generators_of(self, which: NDArray[np.intp]) -> list[np.random.Generator]:
        return [self._generator(int(i)) for i in which]

    def _generator(self, i: int) -> np.random.Generator:
        """Return the random generator of an environment; seed it if nobody has."""
        if (generator := self._generators[i]) is None:
            generator, _ = seeding.np_random()
            self._generators[i] = generator
        return generator


def _seeds(seed: Any, n: int) -> list[int | None]:
    """Return the seed of each of n environments; None keeps a generator."""
    if seed is None:
        return [None] * n
    given = np.asarray(seed, dtype=object)
    if given.shape not in ((), (n,)):
        raise ValueError(f"seed must be a number or {n} of them, one per environment, got {seed!r}")
    for own in given.ravel().tolist():
        if own is not None and not (isinstance(own, (int, np.integer)) and own >= 0):
            raise ValueError(
                f"seed must be a whole number of at least 0, or {n} of them, got {seed!r}"
            )
    if given.ndim == 0:
        return [int(seed) + i for i in range(n)]
    return [None if own is None else int(own) for own in given]


class SoftVoxVectorEnv(NativeVectorEnv):
    """`SoftVoxEnv` for a batch of designs.

    ``reset`` and ``step`` return what a ``SyncVectorEnv`` of single environments does, in less
    time: observations, rewards, and infos with their masks, in every autoreset mode, for the same
    seeds.

    Parameters
    ----------
    num_envs : int
        Designs per step.
    shape, physics, reality, task, heading, objectives, render_mode, from_table, phases
        As in `SoftVoxEnv`; one for the whole batch.
    autoreset_mode : str or AutoresetMode
        "NextStep": the step after an episode's end resets it, ignoring the action, with reward 0;
        "SameStep": the step itself resets, and info has final_obs and final_info; "Disabled": the
        caller resets, with ``options={"reset_mask": ...}`` for some environments.
    threads : int, optional
        At most this many; by default all processors available to the process.

    Raises
    ------
    TypeError, ValueError
        As `SoftVoxEnv` does, or if num_envs is not positive or the mode is unknown.

    Examples
    --------
    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> envs = gym.make_vec("SoftVox2x2x2-v0", num_envs=2, autoreset_mode="SameStep")
    >>> tracks, infos = envs.reset(seed=0)
    >>> _, rewards, _, _, infos = envs.step([[0, 0, 0, 2, 1, 2, 2, 2], [2] * 8])
    >>> print(rewards.round(2), infos["final_info"]["n_voxels"])
    [4.66 0.01] [5 8]
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        self.evaluator = Evaluator(**options)
        super().__init__(self.evaluator, num_envs, autoreset_mode)
