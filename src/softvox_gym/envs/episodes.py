"""What an environment plays: episodes side by side, one of them or a whole batch."""

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
    """What there is to see of a step, drawn only where somebody asks."""

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
        A row per episode, and the same keys for each of them. Bools, ints and floats only: tensors
        are made of infos.
    films : sequence of Film or None, k of them
        None for the empty floor; all None where `render_mode` is None.
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
        Infos, too, but only of those that are over: a row for each of them.
    """

    observations: NDArray[Any]
    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    infos: Columns
    films: Sequence[Film | None]
    finals: Columns = MappingProxyType({})


class Episodes(ABC):
    """Plays episodes, numbered from 0, of which some are started or stepped at a time.

    `SingleEnv` plays number 0 of them, `NativeVectorEnv` as many as it has environments. Those see
    to seeds, autoreset, masks, the batching of infos, and pictures; what an episode is, is said
    here alone, for k of them at once. An episode must not notice who is played beside it: the
    vector environment equals single ones to the bit.

    To write another environment: a class like this, and `SingleEnv` and `NativeVectorEnv` of it,
    as `SoftVoxEnv` and `SoftVoxVectorEnv` are of `Evaluator`. What has to be kept from step to step
    is kept by the episode's number, e.g. in an array with a row for each of a `num_envs` that the
    class is made with (1 for a single environment).

    Attributes
    ----------
    single_action_space, single_observation_space : gymnasium.Space
        Of one episode. Batches of both are single arrays: no Dict, no Tuple.
    reward_space : gymnasium.spaces.Box or None
        Of a vector reward, as MO-Gymnasium has it, shape (m,); None where rewards are numbers.
    physics : Physics
    render_mode : str or None
        One of ``METADATA["render_modes"]``.

    Parameters
    ----------
    render_mode : str, optional

    Raises
    ------
    ValueError
        For an unknown render mode.
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
        """Start some episodes, whatever state they are in; the first call starts all.

        Parameters
        ----------
        which : ndarray of int, shape (k,)
            Their numbers, ascending, one or more.
        generators : callable () -> sequence of Generator
            Theirs. Only called where something is drawn, so that seeds are only made then.
        """

    @abstractmethod
    def step(self, which: Rows, actions: NDArray[Any], generators: Generators) -> Stepped:
        """Step some episodes. Others are not to be touched: they may be over, or reset next.

        Parameters
        ----------
        which, generators
            As of `start`.
        actions : ndarray, shape (k, ...)
            As the caller gave them, a row for each: nothing has been checked but their number.

        Raises
        ------
        TypeError, ValueError
            For actions that are not in the space; nothing was drawn or changed then.
        gymnasium.error.ResetNeeded
            Where an episode was not started or is over, if that makes a difference: a single
            environment does not look.
        """

    @property
    def metadata(self) -> dict[str, Any]:
        """What the environments tell of themselves; a copy."""
        is_film = self.render_mode == "rgb_array_list"
        return {**METADATA, "render_fps": WALK_FPS if is_film else METADATA["render_fps"]}


def pictured(film: Film | None) -> NDArray[np.uint8]:
    """Return the last moment of a step; the empty floor where there is none."""
    return render(None) if film is None else film.last()


def moving(films: Sequence[Film | None]) -> list[NDArray[np.uint8]]:
    """Return every moment of some steps; the empty floor where there is none."""
    floor = [render(None)] if None in films else []
    return [p for film in films for p in (floor if film is None else film.pictures())]
