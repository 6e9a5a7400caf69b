"""How searchers stand on every problem, from any number of folders of results."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_gym import Design, Lattice, evaluate
from softvox_search.experiment.results import Results
from softvox_search.experiment.schema import Problem
from softvox_search.report.truth import exact_fitness

#: Columns of the table of a problem.
COLUMNS = ("searcher", "policy", "budget", "runs", "value", "best", "regret", "found", "ert")


def leaderboard(folders: Sequence[Results]) -> tuple[pd.DataFrame, list[str]]:
    """Return the table of all problems, best searchers first, and what is to be said of it.

    A run counts once, in however many folders it is.

    Parameters
    ----------
    folders : sequence of Results

    Returns
    -------
    table : DataFrame
        One row per problem, searcher, policy and budget.

        ======== =========================================================================
        problem  physics, shape and level of noise
        searcher label
        policy   against luck; "" where there is none
        budget   of each run
        runs     finished ones
        value    median over the runs of what the recommended design is worth without noise,
                 voxel widths
        best     the best of them
        regret   what the median lacks to the optimum, voxel widths; NaN where that is not known
        found    share of the runs that evaluated an optimal design; NaN where that is not known
        ert      expected evaluations, cached ones left out, until that happened: those of all
                 runs over the number of successes; infinite where there was none
        ======== =========================================================================
    notes : list of str

    Raises
    ------
    ResultsError
        Where the file of a run is damaged.
    """
    rows: dict[tuple[str, ...], dict[str, dict[str, Any]]] = {}
    notes: list[str] = []
    for results in folders:
        budgets = results.budgets
        problems = {(p.physics, str(p.shape), _level(p.level)): p for p in results.problems}
        logs = (results.folder / "runs").is_dir()
        if not logs:
            notes.append(
                f"{results.folder} has no runs/, so that found and ert are not known; "
                f"{results.command} makes them"
            )
        row: Any
        for row in results.runs[results.runs["status"] == "ok"].itertuples():
            problem = problems[row.physics, row.shape, _level(row.level)]
            key = (_title(problem), row.searcher, row.policy, _shown(budgets[row.searcher]))
            cell = rows.setdefault(key, {})
            if row.run not in cell:
                cell[row.run] = _facts(results, row, problem, with_log=logs)
    table = pd.DataFrame([_summed(key, list(cell.values())) for key, cell in rows.items()])
    if len(table):
        order = ["problem", "value", "ert", "searcher"]
        table = table.sort_values(order, ascending=[True, False, True, True], ignore_index=True)
    return table, notes


def as_text(table: pd.DataFrame) -> str:
    """Return the table for people, problem by problem."""
    parts = []
    for problem, rows in table.groupby("problem", sort=False):
        shown = rows[list(COLUMNS)].dropna(axis="columns", how="all")
        if not shown["policy"].any():
            shown = shown.drop(columns="policy")
        text = shown.to_string(index=False, float_format=lambda x: f"{x:.4g}", na_rep="-")
        parts.append(f"{problem}\n{text}")
    return "\n\n".join(parts)


def as_json(table: pd.DataFrame) -> str:
    """Return the table for programs; null for what is not known or infinite."""
    rows = [
        {key: None if isinstance(v, float) and not np.isfinite(v) else v for key, v in row.items()}
        for row in table.to_dict("records")
    ]
    return json.dumps(rows, indent=2, allow_nan=False)


def _facts(results: Results, row: Any, problem: Problem, *, with_log: bool) -> dict[str, Any]:
    """Return what is to be known of a run."""
    values = _landscape(problem)
    facts = {"value": _worth(row.recommended, problem), "found": np.nan, "cost": np.nan}
    if values is not None:
        facts["regret"] = values.max() - facts["value"]
        if with_log:
            log = results.evaluations(row.run)
            hits = np.flatnonzero(values[log["design"]] == values.max())
            facts["found"] = float(len(hits) > 0)
            facts["cost"] = float(log["unique_sequence"][hits[0]] if len(hits) else row.unique)
    return facts


def _summed(key: tuple[str, ...], runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the row of a searcher on a problem."""
    frame = pd.DataFrame(runs)
    found, cost = frame["found"], frame["cost"]
    known = not found.isna().any()
    ert = np.inf if known and not found.any() else cost.sum() / found.sum() if known else np.nan
    return {
        **dict(zip(("problem", "searcher", "policy", "budget"), key, strict=True)),
        "runs": len(frame),
        "value": float(frame["value"].median()),
        "best": float(frame["value"].max()),
        "regret": float(frame["regret"].median()) if "regret" in frame else np.nan,
        "found": float(found.mean()) if known else np.nan,
        "ert": float(ert),
    }


def _worth(recommended: int | str, problem: Problem) -> float:
    """Return the fitness of a design without noise, voxel widths; 0 where it diverges."""
    values = _landscape(problem)
    if values is not None:
        return float(values[int(recommended)])
    return float(evaluate([Design(recommended, shape=problem.shape)], problem.values).value[0])


def _landscape(problem: Problem) -> NDArray[np.float64] | None:
    """Return the fitness of every design of a lattice that is known as a whole, else None."""
    return exact_fitness(problem.values)["raw"] if problem.shape == Lattice() else None


def _level(level: float | None) -> float | None:
    return None if level is None or np.isnan(level) else float(level)


def _title(problem: Problem) -> str:
    """Return what tells a problem from others, for people."""
    changes = problem.to_dict()["physics"]
    values = ", ".join(f"{name} {value}" for name, value in changes.items())
    parts = [f"physics {problem.physics}" + (f" ({values})" if values else ""), str(problem.shape)]
    parts += [] if problem.level is None else [f"noise level {problem.level:g}"]
    return ", ".join([*parts, *(json.dumps(wrapper) for wrapper in problem.wrappers)])


def _shown(budget: dict[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in budget.items() if value)
