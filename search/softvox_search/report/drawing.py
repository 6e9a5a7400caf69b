"""All figures of a report by name, from its tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from softvox_search.report import figures
from softvox_search.report.frames import groups
from softvox_search.report.truth import TERMS

#: The figures that show what noise does, and their titles.
NOISE = {
    "true_regret": "True regret by level of noise (IQM)",
    "optimism": "Optimism by level of noise (mean)",
}


@dataclass(frozen=True, eq=False)
class Tables:
    """What the figures of a report are made of.

    Parameters
    ----------
    runs : DataFrame
        One row per run, of which searcher, level, policy, status and unique are used; see
        `softvox_search.report.results.Results`.
    anytime, fixed_budget : DataFrame
        Of `tables.anytime` and `tables.fixed_budget`, all levels one after the other.
    by_searcher, by_policy : DataFrame or None
        Of `recommendations.by_searcher` and `recommendations.by_policy`, where the experiment has
        levels of noise.
    """

    runs: pd.DataFrame
    anytime: pd.DataFrame
    fixed_budget: pd.DataFrame
    by_searcher: pd.DataFrame | None = None
    by_policy: pd.DataFrame | None = None


def key(name: str, level: float, *more: str) -> str:
    """Return the name of a file about a level: fixed_budget_raw_level_0.5; NaN for no level."""
    end = () if np.isnan(level) else (f"level_{level:g}",)
    return "_".join((name, *more, *end))


def drawn(tables: Tables) -> dict[str, Figure]:
    """Draw the figures of a report; to be called within `canvas.style`.

    Returns
    -------
    dict of str to Figure
        By file name without its ending, in the order in which the report lists them.
    """
    made: dict[str, Figure] = {}
    for (level, policy), anytime in groups(tables.anytime, "level", "policy"):
        ends = _ends(_rows(tables.runs, level, policy))
        at = ("" if np.isnan(level) else f", noise level {level:g}") + (
            f", policy {policy}" if policy else ""
        )
        for terms in TERMS:
            here = anytime[anytime["terms"] == terms]
            title = f"Regret in {terms} terms{at}"
            made[key("anytime", level, terms)] = figures.anytime(here, title=title, ends=ends)
            title = f"Targets reached in {terms} terms{at}"
            made[key("ecdf", level, terms)] = figures.ecdf(here, title=title, ends=ends)
        made[key("fixed_budget", level)] = figures.fixed_budget(
            _rows(tables.fixed_budget, level, policy), title=f"Regret at fixed budgets{at}"
        )
    by_searcher, by_policy = tables.by_searcher, tables.by_policy
    if by_searcher is not None and by_policy is not None and by_policy["known"].sum():
        for measure, title in NOISE.items():
            made[measure] = figures.noise(by_searcher, by_policy, measure, title=title)
    return made


def _rows(table: pd.DataFrame, level: float, policy: str) -> Any:
    """Return the rows of a level, NaN for none, and a policy."""
    is_level = table["level"].isna() if np.isnan(level) else table["level"] == level
    return table[is_level & (table["policy"] == policy)]


def _ends(runs: pd.DataFrame) -> dict[str, float]:
    """Return where the median of every searcher's finished runs ends, in unique evaluations."""
    finished = runs[runs["status"] == "ok"]
    medians = finished.groupby("searcher", sort=False)["unique"].median()
    return {str(name): float(value) for name, value in medians.items()}
