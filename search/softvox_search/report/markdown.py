"""The tables as people read them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from softvox_search.report.frames import records
from softvox_search.report.text import (
    HELD,
    markdown,
    number,
    percent,
    probability,
    with_band,
)
from softvox_search.report.truth import TERMS, exact_fitness, optimum

PLACES = 3  # of a regret: a thousandth of a voxel width


def overview(table: pd.DataFrame) -> str:
    """Return what every searcher used, of `tables.overview`."""
    made = pd.DataFrame(
        {
            **_axes(table),
            "searcher": table["searcher"],
            "runs": table["runs"],
            "failed": table["failed"],
            "unique evaluations (median)": table["unique"].map(_whole),
            "evaluations (median)": table["evaluations"].map(_whole),
            "steps (median)": table["steps"].map(_whole),
        }
    )
    return markdown(made)


def fixed_budget(table: pd.DataFrame, terms: str) -> str:
    """Return the regret at fixed budgets in one kind of terms, of `tables.fixed_budget`."""
    here = table[table["terms"] == terms]
    rows = []
    for searcher in dict.fromkeys(here["searcher"]):
        own = here[here["searcher"] == searcher]
        cells = {f"{row['budget']}": _at_budget(row) for row in records(own)}
        rows.append({"searcher": searcher, **cells})
    return markdown(pd.DataFrame(rows))


def _at_budget(row: dict[str, Any]) -> str:
    text = with_band(row["iqm"], row["low"], row["high"], PLACES)
    return f"{text} {HELD} {percent(row['reached'])}" if row["reached"] < 1 else text


def fixed_target(table: pd.DataFrame) -> str:
    """Return expected running times and success, of `tables.fixed_target`."""
    rows = []
    for searcher in dict.fromkeys(table["searcher"]):
        row = {"searcher": searcher}
        for terms in TERMS:
            own = table[(table["searcher"] == searcher) & (table["terms"] == terms)]
            for at in records(own):
                text = with_band(at["ert"], at["low"], at["high"], 0)
                row[f"{terms} {percent(at['target'])}"] = f"{text} ({percent(at['success'])})"
        rows.append(row)
    return markdown(pd.DataFrame(rows))


def pairs(table: pd.DataFrame, terms: str) -> str:
    """Return the squares of all budgets in one kind of terms."""
    return "\n".join(
        f"After {budget} unique evaluations:\n\n{pairs_at(table, terms, budget)}"
        for budget in dict.fromkeys(table["budget"])
    )


def pairs_at(table: pd.DataFrame, terms: str, budget: int) -> str:
    """Return A12 of every pair at a budget as a square, of `tables.pairs`; bold if significant."""
    here = table[(table["terms"] == terms) & (table["budget"] == budget)]
    names = list(dict.fromkeys([*here["a"], *here["b"]]))
    square = {(name, name): "" for name in names}
    for row in records(here):
        a, b = row["a"], row["b"]
        mark = "**" if row["p_holm"] < 0.05 else ""
        square[a, b] = f"{mark}{row['a12']:.2f}{mark}"
        square[b, a] = f"{mark}{1 - row['a12']:.2f}{mark}"
    rows = [{"": a, **{b: square[a, b] for b in names}} for a in names]
    return markdown(pd.DataFrame(rows))


def by_searcher(table: pd.DataFrame) -> str:
    """Return true regret and optimism of every searcher, of `recommendations.by_searcher`."""
    made = pd.DataFrame({**_axes(table), "searcher": table["searcher"], **_measures(table)})
    return markdown(made)


def by_policy(table: pd.DataFrame) -> str:
    """Return true regret and optimism of every policy, of `recommendations.by_policy`."""
    columns = {**_axes(table), **_measures(table)}
    for measure, name in (("true_regret", "regret"), ("optimism", "optimism")):
        columns[f"A12 of {name}"] = table[f"{measure}_a12"].map(lambda a12: number(a12, 2))
        columns[f"p of {name} (Holm)"] = table[f"{measure}_p_holm"].map(probability)
    made = pd.DataFrame(columns)
    return markdown(made.loc[:, [bool((made[name] != "").any()) for name in made]])


def target_sizes(shares: Iterable[float]) -> str:
    """Return a sentence with how many designs meet each target."""
    parts = []
    for share in shares:
        counts = [int(np.sum(exact_fitness(terms) >= share * optimum())) for terms in TERMS]
        parts.append(f"{counts[0]} ({percent(share)}; {counts[1]} in class terms)")
    return f"So many of the 6561 designs meet the targets: {', '.join(parts)}."


def _axes(table: pd.DataFrame) -> dict[str, pd.Series[str]]:
    """Return the columns level and policy, where the experiment has them."""
    columns = {}
    if table["level"].notna().any():
        columns["level"] = table["level"].map(lambda level: f"{level:g}")
    if (table["policy"] != "").any():
        columns["policy"] = table["policy"]
    return columns


def _measures(table: pd.DataFrame) -> dict[str, list[str]]:
    def banded(measure: str) -> list[str]:
        return [
            with_band(row[measure], row[f"{measure}_low"], row[f"{measure}_high"], PLACES)
            for row in records(table)
        ]

    known = [
        f"{k}" if k == n else f"{k} ({k} of {n} known)"
        for k, n in zip(table["known"], table["runs"], strict=True)
    ]
    return {
        "runs": known,
        "true regret": banded("true_regret"),
        "its mean": [number(value, PLACES) for value in table["true_regret_mean"]],
        "optimism": banded("optimism"),
    }


def _whole(value: float) -> str:
    return number(value, 0)
