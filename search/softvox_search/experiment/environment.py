"""The environments of an experiment, one stack of wrappers per level of noise."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper

from softvox_gym import TABLE_ENV_ID
from softvox_gym.design import N_SITES
from softvox_gym.wrappers import silent, vector
from softvox_search.experiment.config import NOISE, Experiment, WrapperChoice
from softvox_search.experiment.toml_table import unknown
from softvox_search.oracle import MakeEnv

#: What the oracle reads of the infos of a step.
NEEDED = ("displacement", "status", "steps")


class WrapperError(Exception):
    """A wrapper that can't be put around the environment; one line, beginning with its name."""


class Environments:
    """Makes the environments of an experiment, and keeps them for the runs that follow.

    An environment costs more to make than a batch from the table, and holds nothing from one batch
    to the next: every reset seeds its noise. A wrapper from elsewhere may hold something, so those
    are made anew for every run.

    Parameters
    ----------
    experiment : Experiment
    """

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._made: dict[tuple[float | None, int], VectorEnv[Any, Any, Any]] = {}

    def at(self, level: float | None) -> MakeEnv:
        """Return what makes the environments at a level of noise."""
        experiment = self._experiment
        wrappers = stack(experiment, level)
        made = self._made if all(":" not in wrapper.name for wrapper in wrappers) else {}
        if answers_from_table(experiment, level):
            base: Callable[[int], Any] = _table
        else:
            base = _engine(experiment)

        def make(num_envs: int) -> VectorEnv[Any, Any, Any]:
            key = (level, num_envs)
            if key not in made:
                env = base(num_envs)
                for wrapper in wrappers:
                    env = wrapped(env, wrapper)
                made[key] = env
            return made[key]

        return make


def stack(experiment: Experiment, level: float | None) -> tuple[WrapperChoice, ...]:
    """Return the wrappers from the environment outward, at a level of noise."""
    if level is None:
        return experiment.wrappers
    noise = WrapperChoice(name=NOISE, options={"level": level})
    if not any(wrapper.name == NOISE for wrapper in experiment.wrappers):
        return (noise, *experiment.wrappers)
    return tuple(
        WrapperChoice(name=NOISE, options={**wrapper.options, **noise.options})
        if wrapper.name == NOISE
        else wrapper
        for wrapper in experiment.wrappers
    )


def answers_from_table(experiment: Experiment, level: float | None) -> bool:
    """Return whether the table gives the engine's bits at a level of noise.

    It does where nothing disturbs the simulation itself: noise on the measurement may, but what a
    wrapper from elsewhere does is not known.
    """
    return (
        experiment.table
        and experiment.is_published
        and not any(
            ":" in wrapper.name or (wrapper.name == NOISE and wrapper.options.get("level", 1) != 0)
            for wrapper in stack(experiment, level)
        )
    )


def wrapped(env: Any, wrapper: WrapperChoice) -> Any:
    """Return an environment in a wrapper.

    Raises
    ------
    WrapperError
        For a wrapper that can't be found, or arguments that it doesn't take.
    """
    try:
        kind = _imported(wrapper.name) if ":" in wrapper.name else getattr(vector, wrapper.name)
        _check_options(wrapper.options, inspect.signature(kind).parameters)
        made = kind(env, **wrapper.options)
        if silent(made) is not None:
            raise TypeError(
                "doesn't say whether two evaluations of one design may differ; give it an "
                "attribute is_noisy, True or False"
            )
        return made
    except (ImportError, TypeError, ValueError) as error:
        raise WrapperError(f"{wrapper.name}: {error}") from error
    except (Exception, SystemExit) as error:  # one's own wrapper may raise anything
        raise WrapperError(
            f"{wrapper.name}: can't be made: {type(error).__name__}: {error}"
        ) from error


def check_infos(env: Any) -> None:
    """Try one design, and make sure that every wrapper passes on what the oracle needs.

    Raises
    ------
    WrapperError
        Naming the innermost wrapper that drops some of it.
    """
    layers = [env]
    while isinstance(layers[-1], VectorWrapper):
        layers.append(layers[-1].env)
    for layer in reversed(layers):
        try:
            layer.reset(seed=0)
            infos = layer.step(np.zeros((layer.num_envs, N_SITES), dtype=np.int64))[4]
        except Exception as error:  # one's own wrapper may raise anything
            raise WrapperError(
                f"{type(layer).__name__}: can't be stepped: {type(error).__name__}: {error}"
            ) from error
        if lacks := [name for name in NEEDED if name not in infos]:
            raise WrapperError(
                f"{type(layer).__name__}: its step drops {', '.join(lacks)} from the infos; pass "
                "on all that the environment within gives"
            )


def _check_options(options: dict[str, Any], parameters: Mapping[str, inspect.Parameter]) -> None:
    named = list(parameters.values())[1:]
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in named):
        return
    names = [parameter.name for parameter in named]
    for option in options:
        if option not in names:
            raise TypeError(unknown(option, names))
    for parameter in named:
        if parameter.default is parameter.empty and parameter.name not in options:
            raise TypeError(f"lacks the key {parameter.name}; its keys are {', '.join(names)}")


def _imported(name: str) -> Any:
    module, _, attribute = name.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except AttributeError:
        raise ImportError(f"module {module} has no {attribute}") from None


def _table(num_envs: int) -> Any:
    return gym.make_vec(TABLE_ENV_ID, num_envs=num_envs)


def _engine(experiment: Experiment) -> Callable[[int], Any]:
    def make(num_envs: int) -> Any:  # one thread: the runs themselves are in parallel
        return gym.make_vec(
            experiment.env_id, num_envs=num_envs, physics=experiment.physics, threads=1
        )

    return make
