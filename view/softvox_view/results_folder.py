"""Folders of results of `softvox compare`, read for the figures of their reports."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from softvox_search.report.drawing import Tables
from softvox_search.report.frames import groups
from softvox_search.report.truth import TERMS
from softvox_view.folders import ResultsError, by_name, checked

#: Columns of text; in all others nothing stands for NaN.
TEXT = ("searcher", "policy", "terms", "status", "digest")

#: What is read, and the columns that are needed.
RUNS = ("runs.csv", ("searcher", "level", "policy", "status", "unique"))
ANYTIME = (
    "tables/anytime.csv",
    ("level", "policy", "terms", "searcher", "unique", "iqm", "low", "high", "ecdf"),
)
FIXED_BUDGET = (
    "tables/fixed_budget.csv",
    ("level", "policy", "terms", "searcher", "budget", "iqm", "low", "high"),
)
_MEASURED = tuple(
    f"{measure}{end}" for measure in ("true_regret", "optimism") for end in ("", "_low", "_high")
)
SEARCHERS = ("tables/noise_searchers.csv", ("level", "policy", "searcher", "known", *_MEASURED))
POLICIES = ("tables/noise_policies.csv", ("level", "policy", "known", *_MEASURED))

#: A level of noise, None where there is none; a policy; and where they matter searcher and terms.
Cell = tuple[Any, ...]


def read_all(folders: Sequence[Path]) -> dict[str, Tables]:
    """Read folders of results, by their names.

    Raises
    ------
    ResultsError
        Where there is no folder, two have the same name, or one can't be used.
    """
    if not folders:
        raise ResultsError(
            "the figure search is made from results; name a folder of softvox compare"
        )
    return {name: read(folder) for name, folder in by_name(folders).items()}


def read(folder: Path) -> Tables:
    """Read the tables of a folder that `softvox compare` has written.

    Raises
    ------
    ResultsError
        Where a table is missing, is none, is cut off or does not belong to the runs.
    """
    runs = _table(checked(folder), *RUNS)
    finished = runs[runs["status"] == "ok"]
    has_noise = bool(finished["level"].notna().any())
    made = Tables(
        runs=runs,
        anytime=_table(folder, *ANYTIME, filled=("unique", "iqm", "ecdf")),
        fixed_budget=_table(folder, *FIXED_BUDGET, filled=("budget",)),
        by_searcher=_table(folder, *SEARCHERS) if has_noise else None,
        by_policy=_table(folder, *POLICIES) if has_noise else None,
    )
    _check_comparison(folder, ANYTIME[0], made.anytime, finished, step="unique")
    _check_comparison(folder, FIXED_BUDGET[0], made.fixed_budget, finished, step="budget")
    for (name, _), table, columns in (
        (SEARCHERS, made.by_searcher, ("level", "policy", "searcher")),
        (POLICIES, made.by_policy, ("level", "policy")),
    ):
        if table is not None:
            _check_cells(folder, name, _cells(table, *columns), _cells(finished, *columns))
    return made


def _table(
    folder: Path, name: str, columns: tuple[str, ...], *, filled: tuple[str, ...] = ()
) -> pd.DataFrame:
    """Read a table that has these columns, of which some have a value in every row."""
    path = folder / name
    if not path.is_file():
        raise ResultsError(
            f"{folder} has no {name}, so it holds no finished report; softvox compare FILE.toml "
            f"--out {folder} writes it, with --report-only from runs that are there"
        )
    try:
        with path.open(encoding="utf-8") as file:
            names = file.readline().strip().split(",")
        table = pd.read_csv(
            path,
            dtype={name: str for name in names if name in TEXT},
            keep_default_na=False,
            na_values={name: [""] for name in names if name not in TEXT},
        )
    except (UnicodeDecodeError, ValueError) as error:
        raise _unusable(folder, name, f"can't be read as a table ({error})") from None
    if fault := _fault(table, columns, filled):
        raise _unusable(folder, name, fault)
    return table


def _fault(table: pd.DataFrame, columns: Iterable[str], filled: Iterable[str]) -> str:
    """Return what is wrong with a table for itself; nothing where it is as it should be."""
    for name in columns:
        if name not in table.columns:
            return f"lacks the column {name}"
        if len(table) and name not in TEXT and table[name].dtype.kind not in "if":
            return f"has something other than numbers in the column {name}"
    if not len(table):
        return "has no rows"
    for name in filled:
        if table[name].isna().any():
            line = int(table[name].isna().to_numpy().argmax()) + 2
            return f"has nothing in the column {name} on line {line}"
    return ""


def _check_comparison(
    folder: Path, name: str, table: pd.DataFrame, finished: pd.DataFrame, *, step: str
) -> None:
    """Make sure that a table has every finished searcher at every level, each at every step."""
    for terms in dict.fromkeys(table["terms"]):
        if terms not in TERMS:
            raise _unusable(folder, name, f"has the terms {terms!r}, which are none of {TERMS}")
    # Searchers are compared under one policy of each level, the one that the table names.
    pairs = _cells(table, "level", "policy")
    runs = [cell for cell in _cells(finished, "level", "policy", "searcher") if cell[:2] in pairs]
    expected = dict.fromkeys((*cell, terms) for cell in runs for terms in TERMS)
    _check_cells(folder, name, _cells(table, "level", "policy", "searcher", "terms"), expected)
    levels = dict.fromkeys((level,) for level, _ in pairs)
    _check_cells(folder, name, levels, _cells(finished, "level"))
    for (level, policy), section in groups(table, "level", "policy"):
        counts = {cell: rows[step].nunique() for cell, rows in groups(section, "searcher", "terms")}
        fewest = min(counts, key=lambda cell: counts[cell])
        if counts[fewest] < max(counts.values()):
            cell = _plain((level, policy, *fewest))
            raise _unusable(
                folder,
                name,
                f"is cut off: it has {counts[fewest]} rows of {_named(cell)}, and "
                f"{max(counts.values())} of others",
            )


def _check_cells(
    folder: Path, name: str, given: Collection[Cell], expected: Collection[Cell]
) -> None:
    """Make sure that a table is about the runs that there are."""
    for cell in given:
        if cell not in expected:
            raise _unusable(
                folder, name, f"has {_named(cell)}, of which {RUNS[0]} has no finished run"
            )
    for cell in expected:
        if cell not in given:
            raise _unusable(
                folder, name, f"lacks {_named(cell)}, of which {RUNS[0]} has finished runs"
            )


def _cells(table: pd.DataFrame, *columns: str) -> dict[Cell, None]:
    """Return what there is in some columns, each once and in order; None for NaN."""
    rows = zip(*(table[name].tolist() for name in columns), strict=True)
    return dict.fromkeys(_plain(row) for row in rows)


def _plain(row: Iterable[Any]) -> Cell:
    """Return it with None for NaN, which would equal nothing."""
    return tuple(None if value != value else value for value in row)


def _named(cell: Cell) -> str:
    """Return a cell in words: ga, in raw terms, level 1, policy 'all'."""
    level, policy, searcher, terms = (*cell, None, None, None)[:4]
    parts = [
        searcher,
        f"in {terms} terms" if terms is not None else None,
        f"level {level:g}" if level is not None else "no level",
        f"policy {policy!r}" if policy else None,
    ]
    return ", ".join(part for part in parts if part)


def _unusable(folder: Path, name: str, fault: str) -> ResultsError:
    return ResultsError(
        f"{folder / name} {fault}; softvox compare FILE.toml --out {folder} --report-only writes "
        "the tables anew from the runs"
    )
