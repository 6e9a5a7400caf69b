"""The finished runs of an experiment: the best that each had found, at any time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_search.report.truth import SHAPE, TERMS, exact_fitness

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Array = NDArray[np.float64]

#: What makes a problem, and what runs are sorted by.
PROBLEM = ("physics", "shape", "level")
AXES = (*PROBLEM, "policy", "searcher")

#: Unique evaluations at which searchers are compared.
FIXED_BUDGETS = (50, 100, 200, 500, 1000, 6561)

POSITIONS = 60
TARGETS = 51
FINEST_TARGET = 0.01  # voxel widths; the published second best, 0.0115 below the best, misses it


class Curve(NamedTuple):
    """When a run came upon something better than all before it.

    at : ndarray of int64, shape (k,)
        Unique evaluations until then.
    fitness : ndarray, shape (k,)
        Voxel widths; grows.
    """

    at: NDArray[np.int64]
    fitness: Array


def groups(frame: pd.DataFrame, *columns: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Go through the rows that agree in some columns, in order of appearance; NaN equals NaN."""
    yield from frame.groupby(list(columns), dropna=False, sort=False)


def improvements(at: NDArray[Any], fitness: Array) -> Curve:
    """Return every evaluation of a fitness larger than all before it; the first always is.

    Parameters
    ----------
    at : ndarray of int, shape (n,)
        Unique evaluations until each evaluation.
    fitness : ndarray, shape (n,)
    """
    best = np.maximum.accumulate(fitness)
    rows = np.flatnonzero(fitness > np.concatenate([[-np.inf], best])[: len(best)])
    return Curve(at[rows].astype(np.int64), fitness[rows])


def finished(results: Results) -> pd.DataFrame:
    """Return the finished runs, sorted by problem, policy, searcher and seed.

    Levels are in order; of all else what appears first comes first. Columns as in `Results.runs`,
    and:

    ======= ===========================================================================
    limit   unique evaluations that the run's budget allows
    known   whether the optimum of its problem is known
    goal    that optimum, or the best that any run of the problem found; voxel widths
    raw     the run's Curve. Where the optimum is known by the noise-free fitness of the
            landscape: under noise an improvement says that the searcher came past a
            better design, not that it knew. Elsewhere by the values that it was told.
    class   the same in class terms; None where the landscape is not known
    ======= ===========================================================================
    """
    runs = results.runs[results.runs["status"] == "ok"].copy()
    runs = runs.sort_values(
        [*AXES, "seed"], key=_order, kind="stable", na_position="first", ignore_index=True
    )
    values = {problem.physics: problem.values for problem in results.problems}
    runs["limit"] = [
        limit_of(results.budgets[searcher], used)
        for searcher, used in zip(runs["searcher"], runs["unique"], strict=True)
    ]
    runs["known"] = runs["shape"] == shape_name(SHAPE)
    curves: dict[str, list[Curve | None]] = {terms: [] for terms in TERMS}
    for run, physics, known in zip(runs["run"], runs["physics"], runs["known"], strict=True):
        log = results.evaluations(run)
        for terms, column in curves.items():
            if known:
                fitness = exact_fitness(terms, values[physics])[log["design"].astype(np.intp)]
                column.append(improvements(log["unique_sequence"], fitness))
            elif terms == "raw":
                column.append(improvements(log["unique_sequence"], log["fitness"]))
            else:
                column.append(None)
    for terms, column in curves.items():
        runs[terms] = pd.Series(column, dtype=object)
    runs["goal"] = _goals(runs, values)
    return runs


def _order(column: pd.Series[Any]) -> pd.Series[Any]:
    """Return numbers as they are, and for all else when it first appears."""
    if column.name in ("level", "seed"):
        return column
    return pd.Series(pd.factorize(column)[0], index=column.index)


def _goals(runs: pd.DataFrame, values: Mapping[str, Any]) -> Array:
    goals = np.zeros(len(runs))
    for (physics, *_), group in groups(runs, *PROBLEM):
        if group["known"].iat[0]:
            goal = exact_fitness("raw", values[physics]).max()
        else:
            goal = max((curve.fitness[-1] for curve in group["raw"] if len(curve.at)), default=0.0)
        goals[group.index] = goal
    return goals


def shape_name(shape: Iterable[int]) -> str:
    """Return a shape as tables write it, "2x2x2"."""
    return "x".join(map(str, shape))


def limit_of(budget: Any, used: int) -> int:
    """Return the unique evaluations that a budget allows; those used, if it states none."""
    stated = [n for n in (budget.unique, budget.evaluations) if n is not None]
    return int(min(stated, default=used))


def best(curves: Iterable[Curve], positions: NDArray[np.int64]) -> Array:
    """Return the best value of every run after so many unique evaluations.

    A run that has ended keeps its value; one that has not begun has none, which counts as 0, what
    standing still is worth.

    Returns
    -------
    ndarray, shape (n, len(positions))
        Voxel widths.
    """
    rows = [
        np.concatenate([[0.0], curve.fitness])[np.searchsorted(curve.at, positions, side="right")]
        for curve in curves
    ]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(positions))


def first_at(curves: Iterable[Curve], targets: Iterable[float]) -> Array:
    """Return the unique evaluations until every run reached its target; infinite where never.

    Returns
    -------
    ndarray, shape (n,)
    """
    at = [
        float(curve.at[i])
        if (i := int(np.searchsorted(curve.fitness, target))) < len(curve.at)
        else np.inf
        for curve, target in zip(curves, targets, strict=True)
    ]
    return np.array(at, dtype=np.float64)


def positions(length: int) -> NDArray[np.int64]:
    """Return about 60 numbers of evaluations, 1 ... length, evenly spread on a log axis."""
    return np.unique(np.rint(np.geomspace(1, max(length, 1), POSITIONS))).astype(np.int64)


def budgets(length: int) -> list[int]:
    """Return the fixed budgets within a length, and the length itself."""
    return sorted({budget for budget in FIXED_BUDGETS if budget <= length} | {length})


def targets(goal: float) -> Array:
    """Return 51 regrets, log-spaced from the whole goal down to 0.01 voxel widths.

    The easiest is met by a robot that stands still, the hardest under the published physics by the
    optimum alone. The hardest is a hundredth of the goal where that is less.
    """
    if goal <= 0:
        return np.zeros(TARGETS)
    return np.geomspace(goal, min(FINEST_TARGET, goal / 100), TARGETS)


def ecdf(regret: Array, goals: Iterable[float]) -> Array:
    """Return the share of all pairs of a run and a target that are reached so far.

    Parameters
    ----------
    regret : ndarray, shape (n, m)
        Of n runs after m numbers of evaluations.
    goals : iterable of float, length n
        Of the problem of each run.

    Returns
    -------
    ndarray, shape (m,)
        The empirical cumulative distribution of the runtimes over runs and targets, in which a
        target never reached has an infinite runtime.

    Notes
    -----
    Source: N. Hansen et al., COCO: a platform for comparing continuous optimizers in a black-box
    setting, Optimization Methods and Software 36(1), 2021. There runtimes of restarts are drawn
    from the runs where a target was missed; here nothing is added to a run that has ended.
    """
    reached = [
        TARGETS - np.searchsorted(targets(goal)[::-1], row, side="left")
        for row, goal in zip(regret, goals, strict=True)
    ]
    return np.asarray(np.mean(reached, axis=0) / TARGETS)
