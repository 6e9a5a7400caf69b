"""Finding out before the work whether an experiment's runs can be made at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from softvox_gym.wrappers import is_noisy
from softvox_search.experiment.config import Experiment, SearcherChoice
from softvox_search.experiment.environment import Environments, WrapperError, check_infos
from softvox_search.experiment.job import evaluations
from softvox_search.experiment.toml_table import ConfigError
from softvox_search.policies import Guarded
from softvox_search.registry import make


def check(experiment: Experiment, path: Path) -> None:
    """Make every environment and every searcher once.

    Parameters
    ----------
    experiment : Experiment
    path : Path
        Of its file, for errors.

    Raises
    ------
    ConfigError
        For a wrapper, a policy or a searcher that can't be made as the file says.
    """
    environments = Environments(experiment)
    noisy = experiment.levels is not None
    for level in experiment.levels or (None,):
        try:
            env = environments.at(level)(1)
            noisy = is_noisy(env) or noisy
            if any(":" in wrapper.name for wrapper in experiment.wrappers):
                check_infos(env)  # made anew for every run, so this one is nobody else's
        except WrapperError as error:
            raise ConfigError(f"{path}: [[wrappers]] {error}") from error
    if experiment.policies and not noisy:
        raise ConfigError(
            f"{path}: [[policies]] are against the luck of noisy evaluations, and nothing is noisy "
            "here; give levels or a wrapper with noise, or drop them"
        )
    for searcher in experiment.searchers:
        try:
            _check_searcher(searcher, experiment)
        except ConfigError as error:
            raise ConfigError(f"{path}: {error}") from error


def _check_searcher(choice: SearcherChoice, experiment: Experiment) -> None:
    try:
        searcher = make(choice.name, np.random.default_rng(0), **choice.options)
    except (ImportError, TypeError, ValueError) as error:
        raise ConfigError(f"[[searchers]] {choice.label}: {error}") from error
    except (Exception, SystemExit) as error:  # one's own searcher may raise anything
        raise ConfigError(
            f"[[searchers]] {choice.label}: can't be made: {type(error).__name__}: {error}"
        ) from error
    for policy in experiment.policies:
        if policy.policy.final_stage and choice.budget.steps is not None:
            raise ConfigError(
                f"[[policies]] {policy.name}: final_stage needs a budget that ends at a known "
                f"evaluation, and {choice.label} has one in steps; drop steps or final_stage"
            )
        try:
            Guarded(searcher, policy.policy, evaluations=evaluations(choice.budget))
        except ValueError as error:
            raise ConfigError(
                f"[[policies]] {policy.name}: with {choice.label}: {error}"
            ) from error
