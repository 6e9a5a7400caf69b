"""Searchers compared: the figures of a report, drawn anew from a folder of results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
from matplotlib.figure import Figure

from softvox_view.figures import Inputs, Made

if TYPE_CHECKING:
    import pandas as pd

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

#: What the report calls the figures that show what noise does.
NOISE = {
    "true_regret": "True regret by level of noise (IQM)",
    "optimism": "Optimism by level of noise (mean)",
}


class ResultsError(ValueError):
    """A folder that no figures can be made of; the message says what is missing, and the mend."""


@dataclass(frozen=True, eq=False)
class Tables:
    """What a folder of results holds for the figures.

    Parameters
    ----------
    runs, anytime, fixed_budget : DataFrame
    by_searcher, by_policy : DataFrame or None
        Where the experiment has levels of noise.
    """

    runs: pd.DataFrame
    anytime: pd.DataFrame
    fixed_budget: pd.DataFrame
    by_searcher: pd.DataFrame | None
    by_policy: pd.DataFrame | None


def read(folder: Path) -> Tables:
    """Read the tables of a folder that `softvox compare` has written.

    Raises
    ------
    ResultsError
        Where a table is missing, or is none.
    """
    if not folder.is_dir():
        raise ResultsError(f"{folder} is not a folder; name one that softvox compare has written")
    has_noise = (folder / SEARCHERS[0]).exists()
    return Tables(
        runs=_table(folder, *RUNS),
        anytime=_table(folder, *ANYTIME),
        fixed_budget=_table(folder, *FIXED_BUDGET),
        by_searcher=_table(folder, *SEARCHERS) if has_noise else None,
        by_policy=_table(folder, *POLICIES) if has_noise else None,
    )


def _table(folder: Path, name: str, columns: tuple[str, ...]) -> pd.DataFrame:
    import pandas as pd

    path = folder / name
    if not path.exists():
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
        raise ResultsError(
            f"{path} can't be read as a table ({error}); softvox compare FILE.toml --out {folder} "
            "--report-only writes it anew"
        ) from None
    _check(path, table, columns)
    return table


def _check(path: Path, table: pd.DataFrame, columns: tuple[str, ...]) -> None:
    missing = [name for name in columns if name not in table.columns]
    wrong = [
        name
        for name in columns
        if name not in (*missing, *TEXT) and table[name].dtype.kind not in "if"
    ]
    if missing or wrong or not len(table):
        fault = (
            f"lacks the column {missing[0]}"
            if missing
            else f"has something other than numbers in the column {wrong[0]}"
            if wrong
            else "has no rows"
        )
        raise ResultsError(
            f"{path} {fault}; softvox compare FILE.toml --out {path.parent} writes such tables"
        )


@contextmanager
def look() -> Iterator[None]:
    """Draw in the report's style, with text that stays text."""
    from softvox_search.report import canvas

    with canvas.style():
        matplotlib.rcParams["pdf.fonttype"] = 42
        yield


def draw(inputs: Inputs) -> Made:
    """Draw the figures of every folder; the folder's name is part of theirs.

    Raises
    ------
    ResultsError
        Where there is no folder, two have the same name, or one can't be used.
    """
    tables = read_all(inputs.results)
    figures: dict[str, Figure] = {}
    with look():
        for name, made in tables.items():
            named = figures_of(made)
            figures |= {f"search_{name}_{key}": figure for key, figure in named.items()}
    return Made(figures, look=look)


def read_all(folders: Sequence[Path]) -> dict[str, Tables]:
    """Read folders of results, by their names.

    Raises
    ------
    ResultsError
        As `draw` does.
    """
    names = [folder.resolve().name for folder in folders]
    if not names:
        raise ResultsError(
            "the figure search is made from results; name a folder of softvox compare"
        )
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ResultsError(
            f"two folders of results are called {twice}, and so would their figures be; draw them "
            "one after the other into different folders"
        )
    return {name: read(folder) for name, folder in zip(names, folders, strict=True)}


def figures_of(tables: Tables) -> dict[str, Figure]:
    """Return the figures of a comparison by name; to be called within `look`."""
    from softvox_search.report import figures

    made: dict[str, Figure] = {}
    for level, policy in _sections(tables.anytime):
        here: dict[str, Any] = {"level": level, "policy": policy}
        ends = _ends(_rows(tables.runs, **here))
        end = "" if level != level else f"_level_{level:g}"
        at = "" if level != level else f", noise level {level:g}"
        for terms in dict.fromkeys(tables.anytime["terms"]):
            rows = _rows(tables.anytime, **here, terms=terms)
            title = f"Regret in {terms} terms{at}"
            made[f"anytime_{terms}{end}"] = figures.anytime(rows, title=title, ends=ends)
            title = f"Targets reached in {terms} terms{at}"
            made[f"ecdf_{terms}{end}"] = figures.ecdf(rows, title=title, ends=ends)
        rows = _rows(tables.fixed_budget, **here)
        made[f"fixed_budget{end}"] = figures.fixed_budget(
            rows, title=f"Regret at fixed budgets{at}"
        )
    if tables.by_searcher is not None and tables.by_policy is not None:
        for measure, title in NOISE.items():
            if tables.by_policy["known"].sum():
                made[measure] = figures.noise(
                    tables.by_searcher, tables.by_policy, measure, title=title
                )
    return made


def _sections(anytime: pd.DataFrame) -> list[tuple[float, str]]:
    """Return each level with its policy; a level of NaN, which equals nothing, comes once."""
    rows = anytime[["level", "policy"]].drop_duplicates()
    return list(zip(rows["level"].tolist(), rows["policy"].tolist(), strict=True))


def _rows(table: pd.DataFrame, *, level: float, **texts: str) -> Any:
    """Return the rows of a level, NaN for none, that have these texts."""
    chosen = table["level"].isna() if level != level else table["level"] == level
    for name, text in texts.items():
        chosen &= table[name] == text
    return table[chosen]


def _ends(runs: pd.DataFrame) -> dict[str, float]:
    """Return where the median of every searcher's finished runs ends, in unique evaluations."""
    finished = runs[runs["status"] == "ok"]
    medians = finished.groupby("searcher", sort=False)["unique"].median()
    return {str(name): float(value) for name, value in medians.items()}
