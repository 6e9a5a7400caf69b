"""The tables of a comparison, each a data frame as it is written to a CSV file."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_search.report import noise
from softvox_search.report.curves import (
    AXES,
    PROBLEM,
    best,
    budgets,
    ecdf,
    finished,
    first_at,
    groups,
    positions,
)
from softvox_search.report.statistics import (
    band,
    compare,
    expected_running_time,
    fixed_generator,
    holm,
    iqm,
    running_time_band,
)
from softvox_search.report.truth import TERMS

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Array = NDArray[np.float64]

#: Shares of the best fitness that count as targets.
FIXED_TARGETS = (0.95, 0.99, 1.0)

#: Columns of text: nothing in them stands for "", in all others for NaN.
TEXT = ("physics", "shape", "policy", "searcher", "terms", "measure", "a", "b", "name", "run")


def make(results: Results) -> tuple[dict[str, pd.DataFrame], list[str]]:
    """Return the tables by name; and notes on what is known of the problems under noise.

    Searchers are compared problem by problem, under the policy that the experiment names first.

    ================= =====================================================================
    runs              `overview`
    problems          `problems`
    anytime           `anytime`, one problem after the other; so are the next three
    fixed_budget      `fixed_budget`
    fixed_target      `fixed_target`
    pairs             `pairs`
    all_ecdf          over all physics of a lattice and level, where there are several:
                      physics, how many; and of `anytime` the column ecdf
    all_fixed_target  likewise `fixed_target`
    recommendations   `noise.recommendations`, where the experiment has levels of noise
    noise_searchers   `noise.by_searcher`
    noise_policies    `noise.by_policy`
    ================= =====================================================================
    """
    made = {"runs": overview(results.runs)}
    runs = finished(results)
    if not len(runs):
        return made, []
    made["problems"] = problems(runs)
    compared = pd.concat([g[g["policy"] == g["policy"].iat[0]] for _, g in groups(runs, *PROBLEM)])
    for function in (anytime, fixed_budget, fixed_target, pairs):
        table = _each(function, compared, *PROBLEM, "policy")
        if len(table):
            made[function.__name__] = table
    several = shared(compared)
    if len(several):
        axes = ("shape", "level", "policy")
        made["all_ecdf"] = _each(_all_ecdf, several, *axes)
        made["all_fixed_target"] = _each(_all_fixed_target, several, *axes)
    noisy = runs[runs["level"].notna()]
    if not len(noisy):
        return made, []
    recommended, notes = noise.recommendations(noisy, results.problems)
    made["recommendations"] = recommended
    made["noise_searchers"] = noise.by_searcher(recommended)
    made["noise_policies"] = noise.by_policy(recommended)
    return made, notes


def _each(
    function: Callable[[pd.DataFrame], pd.DataFrame], runs: pd.DataFrame, *axes: str
) -> pd.DataFrame:
    """Return the tables of all groups of runs one after the other, with what each agrees in."""
    tables = []
    for key, group in groups(runs, *axes):
        table = function(group)
        for i, (name, value) in enumerate(zip(axes, key, strict=True)):
            table.insert(i, name, value)
        tables.append(table)
    return pd.concat([table for table in tables if len(table)] or tables[:1], ignore_index=True)


def overview(runs: pd.DataFrame) -> pd.DataFrame:
    """Return for all that runs have in common how many there are, and the median of what they used.

    Parameters
    ----------
    runs : DataFrame
        `Results.runs`.
    """
    rows = []
    for key, group in groups(runs, *PROBLEM, "policy", "searcher"):
        done = group[group["status"] == "ok"]
        rows.append(
            {
                **dict(zip(AXES, key, strict=True)),
                "runs": len(done),
                "failed": len(group) - len(done),
                **{name: done[name].median() for name in ("unique", "evaluations", "steps")},
            }
        )
    return pd.DataFrame(rows)


def problems(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the problems that have finished runs.

    One row each: physics, shape, level; policy, under which searchers are compared; goal, the
    largest fitness, and known, whether it is the optimum or merely the best that any run found;
    name, what the files about it end with.
    """
    several = [column for column in ("physics", "shape") if runs[column].nunique() > 1]
    files = {column: _file_names(runs[column]) for column in several}
    rows = []
    for (physics, shape, level), group in groups(runs, *PROBLEM):
        row = {"physics": physics, "shape": shape, "level": level}
        ends = [files[column][row[column]] for column in several]
        ends += [] if np.isnan(level) else [f"level_{level:g}"]
        rows.append(
            {
                **row,
                "policy": group["policy"].iat[0],
                "known": bool(group["known"].iat[0]),
                "goal": group["goal"].iat[0],
                "name": "".join(f"_{end}" for end in ends),
            }
        )
    return pd.DataFrame(rows)


def _file_names(labels: pd.Series[str]) -> dict[str, str]:
    """Return for every label what can be part of a file's name, different for each."""
    names: dict[str, str] = {}
    for i, label in enumerate(dict.fromkeys(labels)):
        name = re.sub(r"[^A-Za-z0-9.-]+", "_", label)[:40].lower()
        names[label] = f"{name}_{i}" if name in names.values() or name != label.lower() else name
    return names


def shared(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs of searchers that have been put to every one of several physics.

    Lattice by lattice and level by level: elsewhere a mean over physics would compare searchers
    on different problems.
    """
    kept = []
    for _, group in groups(runs, "shape", "level", "policy"):
        n = group["physics"].nunique()
        if n > 1:
            kept += [own for _, own in groups(group, "searcher") if own["physics"].nunique() == n]
    return pd.concat(kept) if kept else runs[:0]


def _by_searcher(section: pd.DataFrame) -> list[tuple[dict[str, Any], str, pd.DataFrame]]:
    """Return terms and searcher as columns, the terms, and the runs, for all that a section has."""
    return [
        ({"terms": terms, "searcher": searcher}, terms, runs)
        for terms in TERMS
        if section[terms].notna().all()
        for (searcher,), runs in groups(section, "searcher")
    ]


def _below(runs: pd.DataFrame, terms: str, at: NDArray[np.int64]) -> Array:
    """Return how far the best value of every run is below the goal, shape (n, len(at))."""
    return np.asarray(runs["goal"].to_numpy()[:, np.newaxis] - best(runs[terms], at))


def _measured(runs: pd.DataFrame, terms: str, at: NDArray[np.int64]) -> tuple[str, Array]:
    """Return what runs are judged by, the regret where it is known, else the best value."""
    if runs["known"].iat[0]:
        return "regret", _below(runs, terms, at)
    return "best", best(runs[terms], at)


def anytime(section: pd.DataFrame) -> pd.DataFrame:
    """Return the regret of every searcher after so many unique evaluations.

    One row per terms, searcher and position: measure, "regret" or where the optimum is not known
    "best", the best value so far; its iqm over the runs with low and high, its bootstrap band
    (voxel widths); and ecdf, the share of targets reached.

    Parameters
    ----------
    section : DataFrame
        Finished runs on one problem under one policy, as `curves.finished` returns them.
    """
    at = positions(int(section["unique"].max()))
    parts = []
    for names, terms, runs in _by_searcher(section):
        measure, values = _measured(runs, terms, at)
        low, high = band(values, rng=fixed_generator())
        columns = {
            "unique": at,
            "measure": measure,
            "iqm": iqm(values.T),
            "low": low,
            "high": high,
            "ecdf": ecdf(_below(runs, terms, at), runs["goal"]),
        }
        parts.append(pd.DataFrame({**names, **columns}))
    return pd.concat(parts, ignore_index=True)


def fixed_budget(section: pd.DataFrame) -> pd.DataFrame:
    """Return the regret of every searcher at each fixed budget of unique evaluations.

    One row per terms, searcher and budget: measure, as in `anytime`; runs; reached, the share of
    them that used so many (the others keep their last value); iqm with low and high, its bootstrap
    band, and mean of the measure (voxel widths); success, the share of runs that reached the goal.
    Empty where the budget of the searcher's own runs is smaller.
    """
    at = np.array(budgets(int(section["unique"].max())))
    parts = []
    for names, terms, runs in _by_searcher(section):
        measure, values = _measured(runs, terms, at)
        low, high = band(values, rng=fixed_generator())
        columns = {
            "reached": np.mean(runs["unique"].to_numpy()[:, np.newaxis] >= at, axis=0),
            "iqm": iqm(values.T),
            "low": low,
            "high": high,
            "mean": values.mean(axis=0),
            "success": np.mean(_below(runs, terms, at) == 0, axis=0),
        }
        table = pd.DataFrame(
            {**names, "budget": at, "measure": measure, "runs": len(runs), **columns}
        )
        table.loc[at > runs["limit"].max(), list(columns)] = np.nan
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def fixed_target(section: pd.DataFrame) -> pd.DataFrame:
    """Return what it costs every searcher to reach each share of the goal.

    One row per terms, searcher and target: the fitness asked for (voxel widths); runs, and successes, those that reached it; success, their
    share; ert, the expected running time in unique evaluations with its bootstrap band, infinite
    where no run (or no resampled run) reached it; median, of the evaluations that the successful
    runs took. Runs of several problems are pooled, each problem a stratum of the bootstrap.
    """
    rows = []
    for names, terms, runs in _by_searcher(section):
        for share in FIXED_TARGETS:
            first = first_at(runs[terms], share * runs["goal"])
            succeeded = np.isfinite(first)
            used = np.where(succeeded, first, runs["unique"])
            low, high = running_time_band(used, succeeded, strata=runs["physics"].to_numpy(str))
            rows.append(
                {
                    **names,
                    "target": share,
                    "fitness": share * runs["goal"].iat[0],
                    "runs": len(first),
                    "successes": int(succeeded.sum()),
                    "success": succeeded.mean(),
                    "ert": float(expected_running_time(used, succeeded)),
                    "low": low,
                    "high": high,
                    "median": np.median(first[succeeded]) if succeeded.any() else np.nan,
                }
            )
    return pd.DataFrame(rows)


def pairs(section: pd.DataFrame) -> pd.DataFrame:
    """Return every two searchers compared at each fixed budget, by their runs' best values.

    One row per terms, budget and pair: n_a, n_b, Mann and Whitney's u and p (two-sided), p_holm,
    adjusted for all pairs of the same terms and budget, and a12, the chance that a run of a has
    found a fitter design than a run of b, ties counted half. A searcher whose own budget is
    smaller is left out there.
    """
    at = np.array(budgets(int(section["unique"].max())))
    values: dict[str, dict[str, tuple[int, Array]]] = {}
    for names, terms, runs in _by_searcher(section):
        limit = int(runs["limit"].max())
        values.setdefault(terms, {})[names["searcher"]] = (limit, best(runs[terms], at))
    parts = []
    for terms, searchers in values.items():
        for i, budget in enumerate(at.tolist()):
            able = [(name, own[:, i]) for name, (most, own) in searchers.items() if budget <= most]
            rows = [
                {
                    "terms": terms,
                    "budget": budget,
                    "a": a,
                    "b": b,
                    "n_a": len(ours),
                    "n_b": len(theirs),
                    **compare(ours, theirs)._asdict(),
                }
                for (a, ours), (b, theirs) in combinations(able, 2)
            ]
            if rows:
                frame = pd.DataFrame(rows)
                frame.insert(8, "p_holm", holm(frame["p"].to_numpy()))
                parts.append(frame)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _all_ecdf(runs: pd.DataFrame) -> pd.DataFrame:
    at = positions(int(runs["unique"].max()))
    parts = [
        pd.DataFrame(
            {
                **names,
                "problems": own["physics"].nunique(),
                "unique": at,
                "ecdf": ecdf(_below(own, terms, at), own["goal"]),
            }
        )
        for names, terms, own in _by_searcher(runs)
    ]
    return pd.concat(parts, ignore_index=True)


def _all_fixed_target(runs: pd.DataFrame) -> pd.DataFrame:
    table = fixed_target(runs).drop(columns="fitness")
    table.insert(2, "problems", runs["physics"].nunique())
    return table
