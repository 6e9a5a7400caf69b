"""The native vector environment: a batch of designs per step, one crossing into C."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from softvox_gym.envs.evaluator import Action, Evaluator, Filmed
from softvox_gym.envs.single import moving, pictured
from softvox_gym.realities import PhysicsLike, Reality
from softvox_gym.simulation import check_count
from softvox_gym.tasks import Task

Batch = tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
]


class SoftVoxVectorEnv(VectorEnv[NDArray[np.float64], NDArray[np.int64], NDArray[Any]]):
    """`SoftVoxEnv` for a batch of designs.

    ``reset`` and ``step`` return what those of a ``SyncVectorEnv`` of single environments do:
    observations, rewards, infos with their masks, in every autoreset mode; the seeds are the same.
    It only takes less time.

    Parameters
    ----------
    num_envs : int
        Designs per step.
    shape, physics, reality, task, heading, render_mode, from_table, phases
        As `SoftVoxEnv` takes them; one for the whole batch.
    autoreset_mode : str or AutoresetMode
        "NextStep": the step after an episode's end resets it, ignoring the action, for reward 0;
        "SameStep": the step itself resets, and info carries final_obs and final_info;
        "Disabled": the caller resets, with ``options={"reset_mask": ...}`` for some of them.
    threads : int, optional
        At most this many; all processors of the process where None.

    Raises
    ------
    TypeError, ValueError
        As `SoftVoxEnv` does, or for a num_envs that is not positive or an unknown mode.

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
        shape: Sequence[int] = (2, 2, 2),
        physics: PhysicsLike = "published",
        reality: str | Reality | None = None,
        task: str | Task = "displacement",
        heading: float | None = None,
        render_mode: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        from_table: bool = False,
        phases: int | None = None,
    ) -> None:
        check_count("num_envs", num_envs, least=1)
        if threads is not None:
            check_count("threads", threads, least=1)
        self.num_envs = num_envs = int(num_envs)
        self.evaluator = evaluator = Evaluator(
            shape,
            physics,
            render_mode,
            reality=reality,
            task=task,
            heading=heading,
            threads=threads,
            from_table=from_table,
            phases=phases,
        )
        self.physics = evaluator.physics
        self.render_mode = render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**evaluator.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_action_space = evaluator.action_space
        self.single_observation_space = evaluator.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._observations = np.zeros(self.observation_space.shape or ())
        self._seen: list[list[Filmed | None]] = [[] for _ in range(num_envs)]  # as of SoftVoxEnv
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
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Start episodes; return observations and infos.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Environment i gets seed + i, or its own of the sequence; None leaves its generator.
        options : dict, optional
            "reset_mask": a bool array of shape (num_envs,), which of them to reset.

        Raises
        ------
        TypeError, ValueError
            For a mask or a sequence of seeds that does not fit.
        ResetNeeded
            Where a mask leaves out an environment that was never reset.
        """
        n = self.num_envs
        if seed is None or isinstance(seed, (int, np.integer)):
            seeds = [None if seed is None else int(seed) + i for i in range(n)]
        elif len(seed) == n:
            seeds = list(seed)
        else:
            raise ValueError(
                f"seed must be a number or {n} of them, one per environment, got {len(seed)}"
            )
        mask = self._reset_mask(options or {})
        if not np.all(self._has_reset | mask):
            raise ResetNeeded("reset() all environments before resetting some of them by a mask")
        for i in np.flatnonzero(mask):
            if (own := seeds[i]) is not None:
                self._generators[i], _ = seeding.np_random(own)
        self._has_reset |= mask
        self._start_anew(mask)
        return self._observations.copy(), {}

    def step(self, actions: ArrayLike) -> Batch:
        """Simulate the designs; see `SoftVoxEnv` and the autoreset modes for what is returned.

        Raises
        ------
        ValueError
            For actions that are not in the action space.
        ResetNeeded
            Before the first reset.
        AssertionError
            Where autoreset is disabled and an episode that is over was not reset.
        """
        if not self._has_reset.all():
            raise ResetNeeded("cannot call step() before reset()")
        if self.autoreset_mode is AutoresetMode.DISABLED:
            assert not self._is_over.any(), f"reset these first, they are over: {self._is_over}"
        batch = Action.of(actions)
        if batch.ndim and len(batch) != self.num_envs:
            raise ValueError(f"actions must be {self.num_envs} designs, got {len(batch)}")

        steps = ~self._is_over
        rewards, infos = self._simulate(steps, batch)
        self._start_anew(~steps)
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            self._start_anew(steps)
        else:
            self._is_over = steps.copy()
        truncations = np.zeros(self.num_envs, dtype=np.bool_)
        return self._observations.copy(), rewards, steps, truncations, infos

    def render(self) -> tuple[Any, ...] | None:
        """Return every environment's picture, or list of them; None without a render mode."""
        if not self._has_reset.all():
            raise ResetNeeded("cannot call render() before reset()")
        if self.render_mode is None:
            return None
        if self.render_mode == "rgb_array":
            return tuple(pictured(seen[-1]) for seen in self._seen)
        pictures = tuple([p for film in seen for p in moving(film)] for seen in self._seen)
        self._seen = [[] for _ in self._seen]
        return pictures

    def _simulate(
        self, steps: NDArray[np.bool_], actions: Action
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Try the designs of the environments that step; return rewards and batched infos."""
        which, rewards = np.flatnonzero(steps), np.zeros(self.num_envs)
        if len(which) == 0:
            return rewards, {}
        observations, rewards[which], told, films = self.evaluator.run(
            actions[which], lambda: [self._generator(int(i)) for i in which]
        )
        self._observations[which] = observations
        for i, film in zip(which, films, strict=True):
            self._seen[i].append(film)
        infos: dict[str, Any] = batched(told, which, self.num_envs)
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            final = np.full(self.num_envs, None, dtype=object)
            for i in which:
                final[i] = self._observations[i].copy()
            infos = {"final_obs": final, "_final_obs": steps.copy(), "final_info": infos}
            infos["_final_info"] = steps.copy()
        return rewards, infos

    def _start_anew(self, which: NDArray[np.bool_]) -> None:
        """Bring environments to the state after a reset."""
        self._observations[which] = 0
        self._is_over[which] = False
        for i in np.flatnonzero(which):
            self._seen[i] = [None]

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

    def _generator(self, i: int) -> np.random.Generator:
        """Return the random generator of an environment, seeding it where nobody did."""
        if (generator := self._generators[i]) is None:
            generator, _ = seeding.np_random()
            self._generators[i] = generator
        return generator


def batched(
    columns: dict[str, NDArray[Any]], which: NDArray[np.intp], n: int
) -> dict[str, NDArray[Any]]:
    """Return infos of some environments with a row for each of n, and masks of the some."""
    infos: dict[str, NDArray[Any]] = {}
    for key, column in columns.items():
        infos[key] = np.zeros((n, *column.shape[1:]), dtype=column.dtype)
        infos[key][which] = column
        infos[f"_{key}"] = np.zeros(n, dtype=np.bool_)
        infos[f"_{key}"][which] = True
    return infos
