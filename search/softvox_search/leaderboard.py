"""The ranking of searchers on every problem, from any number of folders of results."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from softvox_gym import Design, evaluate
from softvox_search.experiment.results import FOLDER, Results
from softvox_search.experiment.schema import Problem, shown
from softvox_search.report.curves import first_at, groups, improvements
from softvox_search.report.text import budget
from softvox_search.report.truth import exact_fitness

#: The keys of a row.
_KEY = ["problem", "searcher", "policy", "budget"]


def leaderboard(folders: Sequence[Results]) -> tuple[pd.DataFrame, list[str]]:
    """Return the table of all problems, best searchers first, and notes on it.

    A run counts once, even if several folders have it. If searchers or policies with one label have
    other settings in another folder, the label says so.

    Returns
    -------
    table : DataFrame
        One row per problem, searcher, policy and budget: the number of finished runs, and the
        columns that ``softvox leaderboard --help`` explains, NaN if unknown.
    notes : list of str

    Raises
    ------
    ResultsError
        If the file of a run is damaged.
    """
    rows: list[dict[str, Any]] = []
    notes = []
    for results in folders:
        budgets = {label: budget(own) for label, own in results.budgets.items()}
        problems = {(p.physics, str(p.shape), p.level): p for p in results.problems}
        settings = _settings(results)
        has_logs = (results.folder / FOLDER).is_dir()
        if not has_logs:
            notes.append(
                f"{results.folder} has no runs/, so that found and ert are not known; "
                f"{results.repair} makes them"
            )
        for row in results.runs[results.runs["status"] == "ok"].to_dict("records"):
            level = None if np.isnan(row["level"]) else row["level"]
            problem = problems[row["physics"], row["shape"], level]
            names = (_title(problem), row["searcher"], row["policy"], budgets[row["searcher"]])
            made = {f"{name} set": own[row[name]] for name, own in settings.items()}
            facts = _facts(results, row, problem, has_log=has_logs)
            rows.append({**dict(zip(_KEY, names, strict=True)), "run": row["run"], **made, **facts})
    columns = [*_KEY, "run", "searcher set", "policy set", "value", "regret", "found", "cost"]
    runs = pd.DataFrame(rows, columns=columns)
    for name in ("searcher", "policy"):
        several = runs.groupby(name)[f"{name} set"].transform("nunique") > 1
        runs.loc[several, name] += " (" + runs[f"{name} set"] + ")"
    # Of a run in several folders, keep the row with a known "found": that folder has the log.
    runs = runs.sort_values("found", kind="stable").drop_duplicates([*_KEY, "run"]).sort_index()
    grouped = runs.groupby(_KEY, sort=False)
    table = grouped.agg(
        runs=("run", "size"),
        value=("value", "median"),
        best=("value", "max"),
        regret=("regret", "median"),
    )
    hits, cost = (grouped[name].sum(skipna=False) for name in ("found", "cost"))
    table = table.assign(found=hits / table["runs"], ert=cost / hits).reset_index()
    order = ["problem", "value", "ert", "searcher"]
    return table.sort_values(order, ascending=[True, False, True, True], ignore_index=True), notes


def as_text(table: pd.DataFrame) -> str:
    """Return the table as text, problem by problem."""
    parts = []
    for (problem,), rows in groups(table, "problem"):
        shown = rows.drop(columns="problem").dropna(axis="columns", how="all")
        if not shown["policy"].any():
            shown = shown.drop(columns="policy")
        text = shown.to_string(index=False, float_format=lambda x: f"{x:.4g}", na_rep="-")
        parts.append(f"{problem}\n{text}")
    return "\n\n".join(parts)


def as_json(table: pd.DataFrame) -> str:
    """Return the table as JSON; null for unknown or infinite values."""
    known = table.astype(object).mask(table.isin([np.nan, np.inf]), None)
    return json.dumps(known.to_dict("records"), indent=2, allow_nan=False)


def _settings(results: Results) -> dict[str, dict[str, str]]:
    """Return, by label, how the searchers and the policies of results are set, in words."""
    searchers = results.of_file.searcher_choices()
    policies = {policy.name: vars(policy.policy) for policy in results.of_file.policies}
    return {
        "searcher": {one.label: shown({"name": one.name, **one.options}) for one in searchers},
        "policy": {"": "", **{name: shown(own) for name, own in policies.items()}},
    }


def _facts(results: Results, row: Any, problem: Problem, *, has_log: bool) -> dict[str, float]:
    """Return the facts about a run, without noise; a design that diverges has the value 0."""
    if (known := exact_fitness(problem.values, problem.shape)) is None:
        design = Design(row["recommended"], shape=problem.shape)
        return {"value": float(evaluate([design], problem.values).value[0])}
    values = known["raw"]
    value, optimum = float(values[row["recommended"]]), float(values.max())
    facts = {"value": value, "regret": optimum - value}
    if has_log:
        log = results.evaluations(row["run"])
        (at,) = first_at([improvements(log["unique_sequence"], values[log["design"]])], [optimum])
        found = np.isfinite(at)
        facts |= {"found": float(found), "cost": float(at if found else row["unique"])}
    return facts


def _title(problem: Problem) -> str:
    """Return a heading that identifies a problem."""
    values = ", ".join(f"{name} {value}" for name, value in problem.changes.items())
    parts = [f"physics {problem.physics}" + (f" ({values})" if values else ""), str(problem.shape)]
    parts += [] if problem.level is None else [f"noise level {problem.level:.15g}"]
    return ", ".join([*parts, *(json.dumps(wrapper) for wrapper in problem.wrappers)])
