"""The tables of a comparison, each a data frame as written to a CSV file."""

from __future__ import annotations

import re
from collections.abc import Iterable
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
    targets,
)
from softvox_search.report.statistics import (
    band,
    compare,
    expected_running_time,
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


def make(results: Results) -> dict[str, pd.DataFrame]:
    """Return the tables of a report by name.

    The tables of this module are runs (`overview`) and problems; and anytime, fixed_budget,
    fixed_target, pairs and, if the optimum is not known, hypervolume. These list one problem after
    the other, under the policy that the experiment names first; with several physics they also have
    rows over all of them, whose physics is "". If there are levels, `noise` adds recommendations,
    noise_searchers and noise_policies.
    """
    made = {"runs": overview(results.runs)}
    runs = finished(results)
    if not len(runs):
        return made
    compared = sections(runs)
    made["problems"] = problems(compared, results.problems)
    for function in (anytime, fixed_budget, fixed_target, pairs, hypervolume):
        tables = [
            function(section).assign(**dict(zip(AXES, key, strict=False)))
            for key, section in groups(compared, *AXES[:4])
        ]
        whole = pd.concat([table for table in tables if len(table)] or tables, ignore_index=True)
        if len(whole):
            made[function.__name__] = whole[[*AXES[:4], *whole.columns.drop(AXES[:4])]]
    noisy = runs[runs["level"].notna()]
    if len(noisy):
        made["recommendations"] = noise.recommendations(noisy, results.problems)
        made["noise_searchers"] = noise.by_searcher(made["recommendations"])
        made["noise_policies"] = noise.by_policy(made["recommendations"])
    return made


def overview(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the number of runs of each kind, and the medians of what finished ones used."""
    ok = runs["status"] == "ok"
    used = {name: runs[name].where(ok) for name in ("unique", "evaluations", "steps")}
    grouped: Any = (
        runs[AXES].assign(runs=ok, failed=~ok, **used).groupby(AXES, dropna=False, sort=False)
    )
    how = {"runs": "sum", "failed": "sum"} | dict.fromkeys(used, "median")
    table = pd.DataFrame(grouped.agg(how).reset_index())
    # Counts are integers, and exact in a file; a column with a missing value stays as it is.
    whole = [name for name in used if table[name].notna().all()]
    return table.assign(**{name: table[name].round().astype(np.int64) for name in whole})


def sections(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs by which searchers are compared: those under the first policy.

    They are followed by the same runs pooled over all physics of a lattice and level, with "" as
    their physics. Searchers that lack finished runs on any of the physics are left out of these, as
    they would be compared on other problems. The column instance has the physics of every run.
    """
    parts = [
        group[group["policy"] == group["policy"].iat[0]] for _, group in groups(runs, *PROBLEM)
    ]
    compared = pd.concat(parts, ignore_index=True).assign(instance=lambda own: own["physics"])
    pooled = []
    for _, group in groups(compared, "shape", "level", "policy"):
        n = group["physics"].nunique()
        each = group.groupby("searcher")["physics"].transform("nunique")
        if n > 1:
            pooled.append(group[each == n].assign(physics=""))
    return pd.concat([compared, *pooled], ignore_index=True)


def problems(compared: pd.DataFrame, given: Iterable[Any]) -> pd.DataFrame:
    """Return the problems on which searchers are compared.

    One row each: physics, shape, level; policy, under which they are compared; goal, the largest
    fitness; known, whether that is the optimum or merely the best that any run found; finest, how
    many designs meet the hardest of `curves.targets`; hard, how many of the targets are met by at
    most four designs in either terms; truth, the best design under that noise; name, the end of the
    names of the problem's files.
    """
    several = [name for name in ("physics", "shape") if len(set(compared[name]) - {""}) > 1]
    files = {name: _file_names(compared[name]) for name in several}
    rows = []
    for key, group in groups(compared, *AXES[:4]):
        row = dict(zip(AXES, key, strict=False))
        landscape: Any = group["landscape"].iat[0]
        row |= {"known": landscape is not None, "goal": np.nan}
        if row["physics"]:
            row["goal"] = group["goal"].iat[0]
            if not np.isnan(row["level"]):
                row["truth"] = noise.truth_of(row, given)[1]
            row |= {"finest": np.nan, "hard": np.nan}
            if landscape:
                below = [np.sort(row["goal"] - own) for own in landscape.values()]
                hurdles = targets(row["goal"])
                met = np.array([np.searchsorted(own, hurdles, side="right") for own in below])
                row |= {"finest": met[0, -1], "hard": np.sum(met.max(axis=0) <= 4)}
        ends = [files[name][row[name]] for name in several]
        ends += [] if np.isnan(row["level"]) else [f"level_{row['level']:g}"]
        rows.append({**row, "name": "".join(f"_{end}" for end in ends)})
    return pd.DataFrame(rows)


def _file_names(labels: pd.Series[str]) -> dict[str, str]:
    """Return for every label a part of a file name, different for each."""
    names = {"": "all"}
    for i, label in enumerate(dict.fromkeys(labels[labels != ""])):
        name = re.sub(r"[^a-z0-9.-]+", "_", label.lower())[:40]
        made = f"{name}_{i}" if name in names.values() or name != label.lower() else name
        while made in names.values():  # a label may read like what another one got
            made += "_"
        names[label] = made
    return names


def _by_searcher(
    section: pd.DataFrame,
) -> list[tuple[dict[str, Any], pd.Series[Any], pd.DataFrame]]:
    """Yield terms and searcher as columns, curves and runs, for all that a section has."""
    return [
        ({"terms": terms, "searcher": searcher}, runs[terms], runs)
        for terms in TERMS
        if section[terms].notna().all()
        for (searcher,), runs in groups(section, "searcher")
    ]


def _judged(runs: pd.DataFrame, values: Array) -> tuple[Array, dict[str, Any]]:
    """Return the measure of runs, and as columns its name, centre and band.

    It is the regret if that is known, else the best value.
    """
    measure = "best"
    if runs["landscape"].iat[0] is not None:
        measure, values = "regret", runs[["goal"]].to_numpy() - values
    low, high = band(values)
    return values, {"measure": measure, "iqm": iqm(values.T), "low": low, "high": high}


def anytime(section: pd.DataFrame) -> pd.DataFrame:
    """Return the regret of every searcher after so many unique evaluations.

    One row per terms, searcher and position: ecdf, the share of targets reached; measure, "regret",
    or "best", the best value so far, if the optimum is not known; and its iqm over the runs with
    low and high, its bootstrap band (voxel widths). Several physics have no common iqm.

    The section has the rows of `sections` for one problem, or for several pooled.
    """
    at = positions(int(section["unique"].max()))
    parts = []
    for names, curves, runs in _by_searcher(section):
        values = best(curves, at)
        share = ecdf(runs[["goal"]].to_numpy() - values, runs["goal"])
        judged = _judged(runs, values)[1] if runs["instance"].nunique() == 1 else {}
        parts.append(pd.DataFrame({**names, "unique": at, "ecdf": share, **judged}))
    return pd.concat(parts, ignore_index=True)


def fixed_budget(section: pd.DataFrame) -> pd.DataFrame:
    """Return the regret of every searcher at each fixed budget of unique evaluations.

    One row per terms, searcher and budget: measure, as in `anytime`; runs; reached, the share of
    them that used so many (the others keep their last value); iqm with low and high, its bootstrap
    band, and mean of the measure (voxel widths); success, the share of runs that reached the goal.
    Empty where the searcher's own budget is smaller. There are no rows if the runs are of several
    physics.
    """
    if section["instance"].nunique() > 1:
        return pd.DataFrame()
    at = budgets(int(section["unique"].max()))
    parts = []
    for names, curves, runs in _by_searcher(section):
        values, judged = _judged(runs, best(curves, at))
        columns = {
            "reached": np.mean(runs["unique"].to_numpy()[:, np.newaxis] >= at, axis=0),
            **judged,
            "mean": values.mean(axis=0),
            "success": np.mean(best(curves, at) == runs[["goal"]].to_numpy(), axis=0),
        }
        table = pd.DataFrame({**names, "budget": at, "runs": len(runs), **columns})
        table.loc[at > runs["limit"].max(), [name for name in columns if name != "measure"]] = (
            np.nan
        )
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def fixed_target(section: pd.DataFrame) -> pd.DataFrame:
    """Return how many evaluations every searcher needs to reach each share of the goal.

    One row per terms, searcher and target: the target fitness (voxel widths), and how many designs
    have it; runs; successes, those that reached it; success, their share; ert, the expected running
    time in unique evaluations with its bootstrap band, infinite where no run (or no resampled run)
    reached it; median, the median evaluations of the successful runs.
    Runs of several physics are pooled, each physics a stratum of the bootstrap.
    """
    rows = []
    is_one = section["instance"].nunique() == 1
    for names, curves, runs in _by_searcher(section):
        landscape: Any = runs["landscape"].iat[0] if is_one else None
        for share in FIXED_TARGETS:
            wanted = share * runs["goal"]
            at = first_at(curves, wanted)
            succeeded = np.isfinite(at)
            used = np.where(succeeded, at, runs["unique"])
            low, high = running_time_band(used, succeeded, strata=runs["instance"].to_numpy(str))
            row = {
                "target": share,
                "fitness": wanted.iat[0] if is_one else np.nan,
                "designs": np.sum(landscape[names["terms"]] >= wanted.iat[0])
                if landscape
                else np.nan,
                "runs": len(at),
                "successes": succeeded.sum(),
                "success": succeeded.mean(),
                "ert": float(expected_running_time(used, succeeded)),
                "low": low,
                "high": high,
                "median": np.median(at[succeeded]) if succeeded.any() else np.nan,
            }
            rows.append({**names, **row})
    return pd.DataFrame(rows)


def pairs(section: pd.DataFrame) -> pd.DataFrame:
    """Compare every two searchers at each fixed budget, by their runs' best values.

    One row per terms, budget and pair: n_a, n_b, Mann and Whitney's u and p (two-sided), p_holm,
    adjusted for all pairs of the same terms and budget, and a12, the probability that a run of a
    found a fitter design than a run of b, ties counted half. A searcher is left out at budgets
    above its own. There are no rows if the runs are of several physics.
    """
    if section["instance"].nunique() > 1:
        return pd.DataFrame()
    at = budgets(int(section["unique"].max()))
    values = [
        (names["terms"], names["searcher"], runs["limit"].max(), best(curves, at))
        for names, curves, runs in _by_searcher(section)
    ]
    rows = []
    for terms in TERMS:
        for i, budget in enumerate(at):
            able = [own for own in values if own[0] == terms and budget <= own[2]]
            for (_, a, _, ours), (_, b, _, theirs) in combinations(able, 2):
                names = {"terms": terms, "budget": budget, "a": a, "b": b}
                found = compare(ours[:, i], theirs[:, i])._asdict()
                rows.append({**names, "n_a": len(ours), "n_b": len(theirs), **found})
    table = pd.DataFrame(rows)
    if rows:
        table.insert(8, "p_holm", table.groupby(["terms", "budget"])["p"].transform(holm))
    return table


def hypervolume(section: pd.DataFrame) -> pd.DataFrame:
    """Return the hypervolume of every searcher's designs after so many unique evaluations.

    One row per searcher and position of `anytime` or `fixed_budget`: measure; iqm of
    `curves.hypervolume` over the runs (voxel widths) with low and high, its bootstrap band;
    reached, the share of runs that used so many evaluations. There are no rows if the optimum is
    known, or the runs are of several physics.
    """
    if section["instance"].nunique() > 1 or section["front"].isna().any():
        return pd.DataFrame()
    length = int(section["unique"].max())
    at = np.union1d(positions(length), budgets(length))
    parts = []
    for (searcher,), runs in groups(section, "searcher"):
        values = best(runs["front"], at)
        low, high = band(values)
        reached = np.mean(runs["unique"].to_numpy()[:, np.newaxis] >= at, axis=0)
        columns = {"iqm": iqm(values.T), "low": low, "high": high, "reached": reached}
        parts.append(
            pd.DataFrame({"searcher": searcher, "unique": at, "measure": "hypervolume", **columns})
        )
    return pd.concat(parts, ignore_index=True)
