"""What an environment runs: episodes side by side, one of them or a whole batch."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from softvox_gym.physics import Physics
from softvox_gym.rendering import render

METADATA: dict[str, Any] = {"render_modes": ["rgb_array", "rgb_array_list"], "render_fps": 1}

#: Pictures of a walk per second, and the speed at which they show it; 1 is real time.
WALK_FPS, WALK_SPEED = 25, 0.5

Generators = Callable[[], Sequence[np.random.Generator]]
Rows = NDArray[np.intp]
Columns = Mapping[str, NDArray[Any]]


class Film(Protocol):
    """What a step can show, drawn only on request."""

    def pictures(self) -> list[NDArray[np.uint8]]:
        """Draw every moment."""

    def last(self) -> NDArray[np.uint8]:
        """Draw the last moment."""


class Started(NamedTuple):
    """How k episodes begin.

    Attributes
    ----------
    observations : ndarray, shape (k, ...)
    infos : dict of ndarray, each of shape (k, ...)
        A row per episode, and the same keys for all of them. Only bools, ints and floats, because
        infos are turned into tensors.
    films : sequence of Film or None, k of them
        None for an empty floor; all None if `render_mode` is None.
    """

    observations: NDArray[Any]
    infos: Columns
    films: Sequence[Film | None]


class Stepped(NamedTuple):
    """How k episodes went on; observations, infos and films are as those of `Started`.

    Attributes
    ----------
    rewards : ndarray, shape (k,), or (k, m) of a vector reward
    terminated, truncated : ndarray of bool, shape (k,)
    finals : dict of ndarray
        Further infos of the episodes that are over only: a row for each of them.
    """

    observations: NDArray[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    infos: Columns
    films: Sequence[Film | None]
    finals: Columns = MappingProxyType({})


class Episodes(ABC):
    """Runs episodes, numbered from 0; each call starts or steps some of them.

    `SingleEnv` runs only number 0, `NativeVectorEnv` as many as it has environments. They handle
    seeds, autoreset, masks, the batching of infos, and pictures. This class alone defines what an
    episode is, for k of them at once. An episode must not depend on the episodes beside it: the
    vector environment equals single ones to the bit.

    To write another environment, derive from this class, and from `SingleEnv` and `NativeVectorEnv`
    with it, as `SoftVoxEnv` and `SoftVoxVectorEnv` do with `Evaluator`. Keep state between steps by
    the episode's number, for example in an array with `num_envs` rows (1 for a single environment),
    a number that the class is made with.

    Attributes
    ----------
    single_action_space, single_observation_space : gymnasium.Space
        Those of one episode. Batches of both must be single arrays: no Dict, no Tuple.
    reward_space : gymnasium.spaces.Box or None
        That of a vector reward, as in MO-Gymnasium, shape (m,); None if rewards are numbers.
    physics : Physics
    render_mode : str or None
        One of ``METADATA["render_modes"]``.

    Parameters
    ----------
    render_mode : str, optional

    Raises
    ------
    ValueError
        If the render mode is unknown.
    """

    single_action_space: gym.Space[Any]
    single_observation_space: gym.Space[Any]
    reward_space: spaces.Box | None = None
    physics: Physics

    def __init__(self, render_mode: str | None) -> None:
        if render_mode not in (None, *METADATA["render_modes"]):
            known = ", ".join(map(repr, METADATA["render_modes"]))
            raise ValueError(f"render_mode must be None or one of {known}, got {render_mode!r}")
        self.render_mode = render_mode

    @abstractmethod
    def start(self, which: Rows, generators: Generators) -> Started:
        """Start some episodes, in whatever state they are; the first call starts all.

        Parameters
        ----------
        which : ndarray of int, shape (k,)
            The numbers of the episodes, ascending, at least one.
        generators : callable () -> sequence of Generator
            Returns their generators. Call it only if you draw something, so that seeds are made
            only then.
        """

    @abstractmethod
    def step(self, which: Rows, actions: NDArray[Any], generators: Generators) -> Stepped:
        """Step some episodes. Leave the others alone: they may be over, or about to be reset.

        Parameters
        ----------
        which, generators
            As in `start`.
        actions : ndarray, shape (k, ...)
            The caller's actions, a row for each episode; only their number has been checked.

        Raises
        ------
        TypeError, ValueError
            If the actions are not in the space; nothing has been drawn or changed then.
        gymnasium.error.ResetNeeded
            If an episode was not started or is over, and the class depends on it: a single
            environment does not check.
        """

    @property
    def metadata(self) -> dict[str, Any]:
        """A copy of the environments' metadata."""
        is_film = self.render_mode == "rgb_array_list"
        return {**METADATA, "render_fps": WALK_FPS if is_film else METADATA["render_fps"]}


def pictured(film: Film | None) -> NDArray[np.uint8]:
    """Return the last picture of a step; an empty floor if there is no film."""
    return render(None) if film is None else film.last()


def moving(films: Sequence[Film | None]) -> list[NDArray[np.uint8]]:
    """Return every picture of some steps; an empty floor for a step without a film."""
    floor = [render(None)] if None in films else []
    return [p for film in films for p in (floor if film is None else film.pictures())]
