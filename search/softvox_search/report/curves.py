"""The finished runs of an experiment: the best that each had found after so many evaluations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_gym.design import ABSENT
from softvox_search.report.truth import TERMS, exact_fitness

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Array = NDArray[np.float64]

#: The columns that identify a problem; runs are sorted by them.
PROBLEM = ["physics", "shape", "level"]
AXES = [*PROBLEM, "policy", "searcher"]

#: Unique evaluations at which searchers are compared.
FIXED_BUDGETS = (50, 100, 200, 500, 1000, 6561)

POSITIONS = 60
TARGETS = 51
FINEST_TARGET = 0.01  # voxel widths; the published second best, 0.0115 below the best, misses it


class Curve(NamedTuple):
    """A run's improvements: unique evaluations until each, and its fitness in voxel widths."""

    at: NDArray[np.int64]
    fitness: Array


def groups(frame: pd.DataFrame, *columns: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Iterate over the groups of rows equal in some columns, in order of appearance; NaN == NaN."""
    grouped: Any = frame.groupby(list(columns), dropna=False, sort=False)
    yield from grouped


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows, each a dict by column."""
    rows: list[dict[Any, Any]] = frame.to_dict("records")
    return rows


def on(problem: Mapping[str, Any], table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a table that belong to a problem."""
    level = table["level"]
    is_level = level.isna() if np.isnan(problem["level"]) else level == problem["level"]
    is_physics, is_shape = (table[name] == problem[name] for name in ("physics", "shape"))
    rows: pd.DataFrame = table[is_physics & is_shape & is_level]
    return rows


def improvements(at: NDArray[Any], fitness: Array) -> Curve:
    """Return those of n evaluations, at numbers of shape (n,), that are fitter than all before."""
    best = np.maximum.accumulate(fitness)
    rows = np.flatnonzero(fitness > np.concatenate([[-np.inf], best])[: len(best)])
    return Curve(at[rows].astype(np.int64), fitness[rows])


def hypervolume(at: NDArray[Any], fitness: Array, voxels: NDArray[Any], sites: int) -> Curve:
    """Return the hypervolume of all evaluations so far; the objectives are fitness and few voxels.

    This is the area between the non-dominated designs and the reference point, a robot that stands
    still and has sites + 1 voxels, divided by the number of sites. It equals the mean, over all
    numbers of voxels 1 ... sites, of the best fitness of robots with at most so many (voxel
    widths). Of n evaluations, at numbers of shape (n,), each with its fitness and voxels.

    Notes
    -----
    Source: E. Zitzler, L. Thiele, Multiobjective evolutionary algorithms: a comparative case study
    and the strength Pareto approach, IEEE Transactions on Evolutionary Computation 3(4), 1999.
    """
    best = np.zeros(sites + 1)  # of robots with at most so many voxels
    rows = []
    for place, value, number in zip(at.tolist(), fitness.tolist(), voxels.tolist(), strict=True):
        if value > best[number]:
            best[number:] = np.maximum(best[number:], value)
            rows.append((place, best[1:].mean()))
    places, volumes = zip(*rows, strict=True) if rows else ((), ())
    return Curve(np.array(places, dtype=np.int64), np.array(volumes, dtype=np.float64))


def n_voxels(designs: NDArray[Any], lattice: Lattice) -> NDArray[Any]:
    """Return the number of voxels of designs, which a log has as numbers, or as digits in text."""
    if lattice.has_int64_numbers:
        return np.asarray((lattice.digits(designs.astype(np.int64)) != ABSENT).sum(axis=1))
    return lattice.sites - np.char.count(designs.astype(str), str(ABSENT))


def finished(results: Results) -> pd.DataFrame:
    """Return the finished runs, sorted by problem, policy, searcher and seed.

    Levels are in ascending order; all else is in order of first appearance. Columns as in
    `Results.runs`, and:

    ========= =========================================================================
    limit     unique evaluations that the budget allows, or were used if it states none
    landscape exact fitness of all designs by terms; None where it is not known
    goal      the optimum, or the best that any run of the problem found; voxel widths
    raw       the run's Curve. If the landscape is known, it uses the noise-free fitness:
              under noise, an improvement means that the searcher evaluated a better
              design, not that it knew. Otherwise it uses the values the searcher got.
    class     the same in class terms; None where the landscape is not known
    front     the Curve of the `hypervolume`; None where the landscape is known
    ========= =========================================================================
    """
    runs: pd.DataFrame = results.runs[results.runs["status"] == "ok"].sort_values(
        [*AXES, "seed"],
        key=lambda column: (
            column
            if column.name in ("level", "seed")
            else pd.Series(pd.factorize(column)[0], index=column.index)
        ),
        kind="stable",
        na_position="first",
        ignore_index=True,
    )
    known = {
        (problem.physics, str(problem.shape)): exact_fitness(problem.values, problem.shape)
        for problem in results.problems
    }
    budgets = results.budgets
    columns = ["limit", "landscape", *TERMS, "front"]
    facts = []
    for row in records(runs):
        log = results.evaluations(row["run"])
        at, told, lattice = log["unique_sequence"], log["fitness"], Lattice.named(row["shape"])
        stated = [budgets[row["searcher"]].get(name) for name in ("unique", "evaluations")]
        limit = min(filter(None, stated), default=row["unique"])
        if landscape := known[row["physics"], row["shape"]]:
            designs = log["design"].astype(np.intp)
            curves = {name: improvements(at, values[designs]) for name, values in landscape.items()}
        else:
            voxels = n_voxels(log["design"], lattice)
            front = hypervolume(at, told, voxels, lattice.sites)
            curves = {"raw": improvements(at, told), "front": front}
        facts.append({**dict.fromkeys(columns), "limit": limit, "landscape": landscape, **curves})
    made = pd.DataFrame(facts, columns=columns, dtype=object)
    runs = runs.join(made.astype({"limit": np.int64}))
    for _, group in groups(runs, *PROBLEM):
        ends = [curve.fitness[-1] for curve in group["raw"] if len(curve.at)]
        exact: Any = group["landscape"].iat[0]
        runs.loc[group.index, "goal"] = exact["raw"].max() if exact else max(ends, default=0.0)
    return runs


def best(curves: Iterable[Curve], positions: NDArray[np.int64]) -> Array:
    """Return the best value of n runs after so many unique evaluations, shape (n, m), voxel widths.

    A run that has ended keeps its value. One that has not begun has none, which counts as 0, the
    fitness of standing still.
    """
    rows = [
        np.concatenate([[0.0], curve.fitness])[np.searchsorted(curve.at, positions, side="right")]
        for curve in curves
    ]
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(positions))


def first_at(curves: Iterable[Curve], targets: Iterable[float]) -> Array:
    """Return the unique evaluations until each of n runs reached its target; infinite if never."""
    places = [
        np.append(curve.at, np.inf)[np.searchsorted(curve.fitness, target)]
        for curve, target in zip(curves, targets, strict=True)
    ]
    return np.array(places, dtype=np.float64)


def positions(length: int) -> NDArray[np.int64]:
    """Return about 60 numbers of evaluations, 1 ... length, evenly spaced on a log axis."""
    return np.unique(np.rint(np.geomspace(1, max(length, 1), POSITIONS))).astype(np.int64)


def budgets(length: int) -> NDArray[np.int64]:
    """Return the fixed budgets up to a length, and the length itself."""
    return np.array(sorted({budget for budget in FIXED_BUDGETS if budget <= length} | {length}))


def targets(goal: float) -> Array:
    """Return 51 regrets, log-spaced from the whole goal down to 0.01 voxel widths.

    A robot that stands still meets the easiest; under the published physics only the optimum meets
    the hardest. If a hundredth of the goal is less than 0.01, that is the hardest.
    """
    if goal <= 0:
        return np.zeros(TARGETS)
    return np.geomspace(goal, min(FINEST_TARGET, goal / 100), TARGETS)


def ecdf(regret: Array, goals: Iterable[float]) -> Array:
    """Return the share of all pairs of a run and a target that are reached so far, shape (m,).

    This is the empirical cumulative distribution of runtimes over runs and targets, in which a
    target that is never reached has an infinite runtime. The regret is that of n runs after m
    numbers of evaluations, shape (n, m); each run has its goal.

    Notes
    -----
    Source: N. Hansen et al., COCO: a platform for comparing continuous optimizers in a black-box
    setting, Optimization Methods and Software 36(1), 2021. COCO simulates restarts where a run
    missed a target; here nothing is added to a run that has ended.
    """
    reached = [
        TARGETS - np.searchsorted(targets(goal)[::-1], row, side="left")
        for row, goal in zip(regret, goals, strict=True)
    ]
    return np.asarray(np.mean(reached, axis=0) / TARGETS)
