"""One run of an experiment: its identity, its random streams, and what comes of it."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Callable
from functools import lru_cache
from importlib import metadata
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from softvox_gym import ENV_ID, Design
from softvox_gym.design import digits_of
from softvox_gym.manifest import digest as bits_digest
from softvox_gym.wrappers.vector import JakobiNoise
from softvox_search.experiment.environments import Environments, evaluations
from softvox_search.experiment.schema import Run
from softvox_search.log import digest
from softvox_search.oracle import Answer, Oracle
from softvox_search.policies import Guarded, Policy
from softvox_search.registry import make
from softvox_search.run import run as search

Columns = dict[str, NDArray[Any]]

Progress = Callable[[int, int], None]

#: Libraries that draw for searchers, or compute for them; a version may change the bits.
LIBRARIES = ("cmaes", "deap", "gymnasium", "nevergrad", "numpy", "optuna", "ribs", "scipy")

#: Columns of runs.csv, behind the identity of the run.
SUMMARY = (
    "searcher",
    "physics",
    "shape",
    "level",
    "policy",
    "seed",
    "status",
    "unique",
    "evaluations",
    "steps",
    "recommended",
    "believed",
    "digest",
)

#: Designs of which the engine's bits are looked at, nominally and disturbed.
_PROBED = np.arange(40, 6561, 163)


@lru_cache(maxsize=1)
def made_with() -> dict[str, Any]:
    """Return what every run's result depends on besides the experiment, ready for JSON.

    The versions of Python and of the libraries, None for one that is not installed; and a digest
    of what the loaded engine makes of some designs, nominally and disturbed.
    """
    versions: dict[str, str | None] = {
        "python": ".".join(platform.python_version_tuple()[:2]),
        **dict.fromkeys(LIBRARIES),
    }
    for library in LIBRARIES:
        try:
            versions[library] = metadata.version(library)
        except metadata.PackageNotFoundError:
            continue
    return {"versions": versions, "engine_probe": _engine_probe()}


def identity(run: Run, made_with: dict[str, Any]) -> str:
    """Return the SHA-256 of all that a run's result depends on."""
    return _sha256({**run.to_dict(), **made_with}).hex()


def streams(run: Run) -> tuple[np.random.Generator, np.random.Generator]:
    """Return a run's own generators, of its searcher and of its noise seeds.

    They are keyed by the names of searcher, physics, shape, level and policy and by the seed, so
    that whatever else an experiment asks for changes no run.
    """
    words = np.frombuffer(_sha256(run.names()), dtype="<u4").tolist()
    of_searcher, of_noise = np.random.SeedSequence(run.entropy, spawn_key=words).spawn(2)
    return np.random.default_rng(of_searcher), np.random.default_rng(of_noise)


def do(
    run: Run, environments: Environments, *, progress: Progress | None = None
) -> tuple[dict[str, Any], Columns]:
    """Do a run.

    Parameters
    ----------
    run : Run
    environments : Environments
        What was made there for other runs is used again.
    progress : callable (done, total), optional
        Called after every batch with the evaluations.

    Returns
    -------
    summary : dict
        One value for each of `SUMMARY`; None where there is none.
    columns : dict of ndarray
        The log.

    Raises
    ------
    Exception
        Whatever the searcher raises.
    """
    rng, noise = streams(run)
    # At level 0 a repeated evaluation costs what it costs at the others, so that budgets are equal.
    noisy = True if run.problem.level is not None else None
    budget = run.searcher.budget
    oracle = _Watched(environments.of(run.problem), budget, rng=noise, noisy=noisy)
    oracle.progress = progress
    searcher = make(run.searcher.name, rng, **run.searcher.options)
    if oracle.noisy:
        policy = run.policy.policy if run.policy else Policy()
        searcher = Guarded(searcher, policy, evaluations=evaluations(budget))
    recommended = search(searcher, oracle, name=run.searcher.label)
    columns = oracle.log.columns()
    summary = {
        **run.names(),
        "status": "ok",
        "unique": oracle.unique,
        "evaluations": oracle.evaluations,
        "steps": oracle.steps,
        "recommended": design_key(recommended),
        "believed": _believed(searcher, recommended, columns),
        "digest": digest(columns),
    }
    columns["diverged"] = columns.pop("status") != "ok"
    return summary, columns


def design_key(design: Design) -> int | str:
    """Return a design as the log has it: its number, or its digits where int64 can't hold that."""
    return design.index if design.index < 2**63 else design.digits


class _Watched(Oracle):
    """Tells how far it is."""

    progress: Progress | None = None

    def evaluate(self, designs: Any) -> Answer:
        answer = super().evaluate(designs)
        if self.progress is not None:
            budget = self.budget
            if self.noisy or budget.unique is None:
                self.progress(self.evaluations, evaluations(budget))
            else:
                self.progress(self.unique, budget.unique)
        return answer


def _believed(searcher: Any, design: Design, columns: Columns) -> float | None:
    """Return what a searcher believes a design to be worth.

    As its policy believes; without one the value that it was told last, or None where it was told
    nothing of this design.
    """
    if isinstance(searcher, Guarded):
        return _number(searcher.belief(design))
    rows = np.flatnonzero(columns["design"] == design_key(design))
    return _number(columns["fitness"][rows[-1]]) if len(rows) else None


def _number(value: Any) -> float | None:
    return None if np.isnan(value) else float(value)


def _engine_probe() -> str:
    env: Any = gym.make_vec(ENV_ID, num_envs=len(_PROBED))
    displacements = []
    for level in (0.0, 2.0):
        noisy = JakobiNoise(env, level)
        noisy.reset(seed=0)
        displacements.append(noisy.step(digits_of(_PROBED))[4]["displacement"])
        env.reset()
    return bits_digest(np.concatenate(displacements))


def _sha256(value: dict[str, Any]) -> bytes:
    """Return the SHA-256 of a value's canonical JSON."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).digest()
