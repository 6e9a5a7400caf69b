"""The tables of a comparison without regard to what the searchers recommend."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_search.report.cells import Cell, Section
from softvox_search.report.curves import FIXED_TARGETS, budgets, ecdf, positions
from softvox_search.report.frames import groups
from softvox_search.report.results import Results
from softvox_search.report.statistics import (
    CONFIDENCE,
    RESAMPLES,
    band,
    compare,
    expected_running_time,
    fixed_generator,
    holm,
    iqm,
    resampled,
)
from softvox_search.report.truth import TERMS, optimum

Array = NDArray[np.float64]

FIXED_BUDGET_COLUMNS = ["runs", "reached", "iqm", "low", "high", "mean", "success"]


def overview(results: Results) -> pd.DataFrame:
    """Return, for every searcher, level and policy, how many runs there are and what they used."""
    rows = []
    for (level, policy, searcher), group in groups(results.runs, "level", "policy", "searcher"):
        done = group[group["status"] == "ok"]
        rows.append(
            {
                "level": level,
                "policy": policy,
                "searcher": searcher,
                "runs": len(done),
                "failed": len(group) - len(done),
                "unique": done["unique"].median(),
                "evaluations": done["evaluations"].median(),
                "steps": done["steps"].median(),
            }
        )
    return pd.DataFrame(rows)


def anytime(section: Section) -> pd.DataFrame:
    """Return the regret of every searcher after so many unique evaluations.

    One row per terms, searcher and position: iqm over the runs with low and high, its bootstrap
    band (voxel widths), and ecdf, the share of targets reached.
    """
    at = positions(section.length)
    parts = []
    for terms in TERMS:
        for cell in section.cells:
            regret = cell.regret(terms, at)
            low, high = band(regret, rng=fixed_generator())
            parts.append(
                pd.DataFrame(
                    {
                        **_names(section, terms, cell),
                        "unique": at,
                        "iqm": iqm(regret.T),
                        "low": low,
                        "high": high,
                        "ecdf": ecdf(regret),
                    }
                )
            )
    return pd.concat(parts, ignore_index=True)


def fixed_budget(section: Section) -> pd.DataFrame:
    """Return the regret of every searcher at each fixed budget of unique evaluations.

    One row per terms, searcher and budget: runs; reached, the share of them that used so many (the
    others keep their last value); iqm with low and high, its bootstrap band, and mean of the
    regret (voxel widths); success, the share of runs that found the optimum. Empty where the
    budget of the searcher's own runs is smaller.
    """
    at = np.array(budgets(section.length))
    rows = []
    for terms in TERMS:
        for cell in section.cells:
            regret = cell.regret(terms, at)
            low, high = band(regret, rng=fixed_generator())
            for i, budget in enumerate(at):
                row: dict[str, Any] = {**_names(section, terms, cell), "budget": int(budget)}
                values: tuple[float, ...] = (
                    len(cell.run),
                    float(np.mean(cell.unique >= budget)),
                    float(iqm(regret[:, i])),
                    low[i],
                    high[i],
                    regret[:, i].mean(),
                    float(np.mean(regret[:, i] == 0)),
                )
                if budget > cell.limit:
                    values = (len(cell.run), *[np.nan] * 6)
                rows.append({**row, **dict(zip(FIXED_BUDGET_COLUMNS, values, strict=True))})
    return pd.DataFrame(rows)


def fixed_target(section: Section) -> pd.DataFrame:
    """Return what it costs every searcher to reach each share of the best fitness.

    One row per terms, searcher and target: the fitness asked for (voxel widths); runs, and hits,
    those that reached it; success, their share; ert, the expected running time in unique
    evaluations with its bootstrap band, infinite where no run (or no resampled run) reached it;
    median, of the evaluations that the successful runs took.
    """
    rows = []
    for terms in TERMS:
        for cell in section.cells:
            for share in FIXED_TARGETS:
                first = cell.hit(terms, share * optimum())
                is_hit = np.isfinite(first)
                used = np.where(is_hit, first, cell.unique)
                low, high = _running_time_band(used, is_hit)
                rows.append(
                    {
                        **_names(section, terms, cell),
                        "target": share,
                        "fitness": share * optimum(),
                        "runs": len(first),
                        "hits": int(is_hit.sum()),
                        "success": is_hit.mean(),
                        "ert": float(expected_running_time(used, is_hit)),
                        "low": low,
                        "high": high,
                        "median": np.median(first[is_hit]) if is_hit.any() else np.nan,
                    }
                )
    return pd.DataFrame(rows)


def pairs(section: Section) -> pd.DataFrame:
    """Return every two searchers compared at each fixed budget, by their runs' best values.

    One row per terms, budget and pair: n_a, n_b, Mann and Whitney's u and p (two-sided), p_holm,
    adjusted for all pairs of the same terms and budget, and a12, the chance that a run of a has
    found a fitter design than a run of b, ties counted half. A searcher whose own budget is
    smaller is left out there.
    """
    at = np.array(budgets(section.length))
    parts = []
    for terms in TERMS:
        best = {cell.searcher: cell.best(terms, at) for cell in section.cells}
        for i, budget in enumerate(at):
            able = [cell.searcher for cell in section.cells if budget <= cell.limit]
            rows = []
            for a, b in combinations(able, 2):
                found = compare(best[a][:, i], best[b][:, i])
                rows.append(
                    {
                        "level": section.level,
                        "policy": section.policy,
                        "terms": terms,
                        "budget": int(budget),
                        "a": a,
                        "b": b,
                        "n_a": len(best[a]),
                        "n_b": len(best[b]),
                        **found._asdict(),
                    }
                )
            if rows:
                frame = pd.DataFrame(rows)
                frame.insert(10, "p_holm", holm(frame["p"].to_numpy()))
                parts.append(frame)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _names(section: Section, terms: str, cell: Cell) -> dict[str, Any]:
    return {
        "level": section.level,
        "policy": section.policy,
        "terms": terms,
        "searcher": cell.searcher,
    }


def _running_time_band(used: Array, is_hit: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the percentile band of the expected running time by the bootstrap over runs."""
    if len(used) < 2:
        return np.nan, np.nan
    drawn = resampled(np.zeros(len(used)), rng=fixed_generator(), resamples=RESAMPLES)
    made = expected_running_time(used[drawn], is_hit[drawn])
    tail = (1 - CONFIDENCE) / 2
    # No interpolation: between a number and infinity there is nothing.
    low, high = np.quantile(made, [tail, 1 - tail], method="inverted_cdf")
    return float(low), float(high)
