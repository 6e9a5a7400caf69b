"""One run of an experiment: a pure function of the experiment and the run's number."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design
from softvox_search.experiment.config import Experiment, Run
from softvox_search.experiment.environment import Environments
from softvox_search.log import digest
from softvox_search.oracle import Answer, Budget, Oracle
from softvox_search.policies import Guarded, Policy
from softvox_search.protocol import Searcher
from softvox_search.registry import make
from softvox_search.report.improvements import improvements
from softvox_search.run import run as search

Columns = dict[str, NDArray[Any]]

Progress = Callable[[int, int], None]

#: Columns of runs.csv.
SUMMARY = (
    "run",
    "searcher",
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


@dataclass(frozen=True, eq=False)
class Record:
    """What is kept of a run.

    Parameters
    ----------
    summary : dict
        One value for each of `SUMMARY`; None where there is none.
    columns : dict of ndarray
        The log.
    improvements : dict of ndarray
        What `softvox_search.report.improvements` makes of it.
    seconds : float
        s of processor time that the search took, the only thing that differs on repetition.
    """

    summary: dict[str, Any]
    columns: Columns
    improvements: Columns
    seconds: float


def streams(experiment: Experiment, run: Run) -> tuple[np.random.Generator, np.random.Generator]:
    """Return a run's own generators, of its searcher and of its noise seeds.

    They are the children of ``SeedSequence(entropy).spawn(...)[cell].spawn(...)[seed]``, so that a
    searcher added at the end of the file changes no other's runs.
    """
    root = np.random.SeedSequence(experiment.entropy, spawn_key=(run.cell.number, run.seed))
    of_searcher, of_noise = root.spawn(2)
    return np.random.default_rng(of_searcher), np.random.default_rng(of_noise)


def do(
    experiment: Experiment,
    run: Run,
    environments: Environments,
    *,
    progress: Progress | None = None,
) -> Record:
    """Do a run.

    Parameters
    ----------
    experiment : Experiment
    run : Run
        One of its `runs`.
    environments : Environments
        Of the experiment; what was made there for other runs is used again.
    progress : callable (done, total), optional
        Told the evaluations after every batch.

    Raises
    ------
    Exception
        Whatever the searcher raises.
    """
    cell = run.cell
    rng, noise = streams(experiment, run)
    # At level 0 a repeated evaluation costs what it costs at the others, so that budgets are equal.
    noisy = True if cell.level is not None else None
    oracle = _Watched(environments.at(cell.level), cell.searcher.budget, rng=noise, noisy=noisy)
    oracle.progress = progress
    searcher = make(cell.searcher.name, rng, **cell.searcher.options)
    if oracle.noisy:
        policy = cell.policy.policy if cell.policy else Policy()
        searcher = Guarded(searcher, policy, evaluations=evaluations(oracle.budget))
    started = time.process_time()  # the first run of a searcher in a process imports its libraries
    recommended = search(searcher, oracle, name=cell.searcher.label)
    columns = oracle.log.columns()
    summary = {
        "run": run.number,
        "searcher": cell.searcher.label,
        "level": cell.level,
        "policy": cell.policy.name if cell.policy else "",
        "seed": run.seed,
        "status": "ok",
        "unique": oracle.unique,
        "evaluations": oracle.evaluations,
        "steps": oracle.steps,
        "recommended": recommended.index,
        "believed": believed(searcher, recommended, columns),
        "digest": digest(columns),
    }
    # Of another physics the optimum is not known, so nothing can be said of how near to it one is.
    rows = columns if experiment.is_published else {name: columns[name][:0] for name in columns}
    return Record(summary, columns, improvements(rows), time.process_time() - started)


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


def evaluations(budget: Budget) -> int:
    """Return how many evaluations a budget allows where each is a fresh draw and counts."""
    assert budget.evaluations is not None
    return min(budget.evaluations, budget.unique or budget.evaluations)


def believed(searcher: Searcher, design: Design, columns: Columns) -> float | None:
    """Return what a searcher believes a design to be worth.

    As its policy believes; without one the value that it was told last, or None where it was told
    nothing of this design.
    """
    if isinstance(searcher, Guarded):
        return _number(searcher.belief(design))
    rows = np.flatnonzero(columns["design"] == design.index)
    return _number(columns["fitness"][rows[-1]]) if len(rows) else None


def _number(value: Any) -> float | None:
    return None if np.isnan(value) else float(value)
