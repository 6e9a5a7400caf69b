"""One run of an experiment: its identity, its random streams and its result."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib import metadata
from typing import Any

import numpy as np

from softvox_gym.manifest import engine_probe
from softvox_search.experiment.environments import Environments
from softvox_search.experiment.schema import LIBRARIES, Run, sha256
from softvox_search.experiment.transfer import TransferTask, cross
from softvox_search.log import Columns, digest
from softvox_search.log import identity as design_identity
from softvox_search.oracle import Oracle
from softvox_search.policies import Policy, with_policy
from softvox_search.registry import make
from softvox_search.run import believed
from softvox_search.run import run as search


@lru_cache(maxsize=2)
def made_with(libraries: tuple[str, ...] = LIBRARIES) -> dict[str, Any]:
    """Return what every run's result depends on besides the experiment, ready for JSON.

    These are the versions of Python and of some libraries, None if not installed, and a digest of
    the loaded engine's results for some designs.
    """
    versions = {
        "python": ".".join(platform.python_version_tuple()[:2]),
        **dict(_versions(libraries)),
    }
    return {"versions": versions, "engine_probe": engine_probe()}


def _versions(libraries: Iterable[str]) -> Iterator[tuple[str, str | None]]:
    for library in libraries:
        try:
            yield library, metadata.version(library)
        except metadata.PackageNotFoundError:
            yield library, None


def identity(run: Run | TransferTask, made_with: dict[str, Any]) -> str:
    """Return the SHA-256 of everything that a run's result depends on."""
    return sha256({**run.to_dict(), **made_with}).hex()


def streams(run: Run) -> tuple[np.random.Generator, np.random.Generator]:
    """Return a run's own generators: for its searcher, and for its noise seeds.

    They are keyed by the names of searcher, physics, shape, level and policy and by the seed. So a
    run does not depend on what else an experiment has.
    """
    words = np.frombuffer(sha256(run.names()), dtype="<u4").tolist()
    of_searcher, of_noise = np.random.SeedSequence(run.entropy, spawn_key=words).spawn(2)
    return np.random.default_rng(of_searcher), np.random.default_rng(of_noise)


def do(run: Run | TransferTask, environments: Environments) -> tuple[dict[str, Any], Columns]:
    """Do a run in reused environments; pass on any error of the searcher or method.

    Returns
    -------
    summary : dict
        A row of `Results.runs` without the columns run and file; None for what has no value.
    columns : dict of ndarray
        The log.
    """
    if isinstance(run, TransferTask):
        return cross(run)
    rng, noise = streams(run)
    choice, problem, budget = run.searcher, run.problem, run.searcher.budget.checked()
    # Level 0 counts repeated evaluations as other levels do, so that budgets are equal.
    noisy = True if problem.level is not None else None
    oracle = Oracle(environments.of(problem), budget, rng=noise, noisy=noisy)
    searcher = make(choice.name, rng, space=problem.shape, **choice.options)
    if oracle.noisy:
        policy = run.policy.policy if run.policy else Policy()
        searcher = with_policy(searcher, policy, problem.shape, budget)
    recommended = search(searcher, oracle, name=choice.label)
    columns = oracle.log.columns()
    summary = {
        **run.names(),
        "status": "ok",
        "unique": oracle.unique,
        "evaluations": oracle.evaluations,
        "steps": oracle.steps,
        "recommended": design_identity(recommended),
        "believed": believed(searcher, recommended, columns),
        "digest": digest(columns),
    }
    return summary, columns
