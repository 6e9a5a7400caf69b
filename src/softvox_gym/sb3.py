"""Stable-Baselines3 on this package's vector environments; needs the extra ``learn``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers.vector import DictInfoToList
from numpy.typing import NDArray

from softvox_gym.envs.single import plain
from softvox_gym.wrappers.steps import chain

try:
    from stable_baselines3.common.vec_env import VecEnv
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "softvox_gym.sb3 needs stable-baselines3: pip install 'softvox-gym[learn]'", name=error.name
    ) from None

Indices = None | int | Iterable[int]


class SB3VecEnv(VecEnv):  # type: ignore[misc]  # untyped where it is not installed
    """A vector environment of this package with the interface of Stable-Baselines3.

    It returns what a `DummyVecEnv` of single environments does, but simulates the whole batch at
    once. You can put Stable-Baselines3's own wrappers around it, such as `VecMonitor`, which logs
    episodes, and those of `softvox_gym.wrappers.vector` and `gymnasium.wrappers.vector` inside it.

    Parameters
    ----------
    envs : VectorEnv
        Made with ``autoreset_mode="Disabled"``.

    Raises
    ------
    TypeError, ValueError
        If it is no vector environment, or resets itself.

    Examples
    --------
    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> from softvox_gym.sb3 import SB3VecEnv
    >>> envs = gym.make_vec("SoftVox2x2x2-v0", num_envs=2, autoreset_mode="Disabled")
    >>> env = SB3VecEnv(envs)
    >>> _ = env.seed(0), env.reset()
    >>> _, rewards, _, infos = env.step([[0, 0, 0, 2, 1, 2, 2, 2], [2] * 8])
    >>> print(rewards.round(2), infos[0]["design"])
    [4.66 0.01] 6453
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any]) -> None:
        if not isinstance(envs, VectorEnv):
            raise TypeError(f"envs must be a vector environment, of gym.make_vec, got {envs}")
        if envs.metadata.get("autoreset_mode") is not AutoresetMode.DISABLED:
            raise ValueError(
                "SB3VecEnv resets finished episodes itself; make the environments with "
                'gym.make_vec(..., autoreset_mode="Disabled")'
            )
        self.envs: Any = DictInfoToList(envs)  # its type allows no seed per environment
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)
        self.metadata = envs.metadata

    def reset(self) -> Any:
        """Start all episodes with the seeds and options that were set; return observations."""
        options = self._options[0]
        if any(other != options for other in self._options):
            raise ValueError("options must be the same for all environments")
        observations, infos = self.envs.reset(seed=list(self._seeds), options=options or None)
        self.reset_infos = [_plain(info) for info in infos]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Store the actions of the next step."""
        self.actions = actions

    def step_wait(
        self,
    ) -> tuple[NDArray[Any], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Make the step, reset finished episodes; return observations, rewards, dones, infos."""
        observations, rewards, terminated, truncated, told = self.envs.step(self.actions)
        if np.ndim(rewards) > 1:
            raise ValueError("a reward must be one number: make the batch without objectives")
        infos, dones = [_plain(info) for info in told], terminated | truncated
        for i, info in enumerate(infos):
            info["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
            if dones[i]:
                info["terminal_observation"] = observations[i].copy()
        if dones.any():
            observations, begun = self.envs.reset(options={"reset_mask": dones})
            for i in np.flatnonzero(dones).tolist():
                self.reset_infos[i] = _plain(begun[i])
        return observations, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Close the environments."""
        self.envs.close()

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Return the picture of every environment."""
        pictures: Any = self.envs.render() if self.render_mode == "rgb_array" else None
        return list(pictures or [None] * self.num_envs)

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Return an attribute per environment: its item of a tuple, or the value that all share."""
        value = getattr(self._owner(attr_name), attr_name)
        return self._dealt(value, indices, of=(tuple,))

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Set an attribute of the vector environment; ValueError for a part of the batch."""
        if len(set(self._get_indices(indices))) < self.num_envs:
            raise ValueError(f"{attr_name} is one for the whole batch: leave out indices")
        has = self.has_attr(attr_name)
        setattr(self._owner(attr_name) if has else self.envs.unwrapped, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: Indices = None, **options: Any
    ) -> list[Any]:
        """Call a method of the vector environment once; return its result for each environment.

        A result that does not have one item per environment counts for all of them.
        """
        answer = getattr(self._owner(method_name), method_name)(*args, **options)
        return self._dealt(answer, indices, of=(tuple, list, np.ndarray))

    def env_is_wrapped(self, wrapper_class: type, indices: Indices = None) -> list[bool]:
        """Return for each environment whether the vector has a wrapper of this class."""
        is_wrapped = any(isinstance(link, wrapper_class) for link in chain(self.envs.env))
        return [is_wrapped for _ in self._get_indices(indices)]

    def _dealt(self, value: Any, indices: Indices, *, of: tuple[type[Any], ...]) -> list[Any]:
        """Return each environment's item if there is one for each, else the value itself."""
        is_each = isinstance(value, of) and len(value) == self.num_envs
        return [value[i] if is_each else value for i in self._get_indices(indices)]

    def _owner(self, name: str) -> Any:
        """Return the outermost of the vector environment and its wrappers with this attribute."""
        for link in chain(self.envs.env):
            if hasattr(link, name):
                return link
        raise AttributeError(f"{self.envs.env} has no attribute {name!r}", name=name)


def _plain(info: dict[str, Any]) -> dict[str, Any]:
    """Return an info with Python numbers, as a single environment returns it."""
    return {key: plain(value) for key, value in info.items()}
