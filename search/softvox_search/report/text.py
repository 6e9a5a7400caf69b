"""Tables as CSV, and as people read them in Markdown."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from softvox_search.report.curves import groups, records

#: Columns of text in the CSV files: nothing in them stands for "", in all others for NaN.
TEXT = (
    "physics",
    "shape",
    "policy",
    "searcher",
    "terms",
    "measure",
    "a",
    "b",
    "name",
    "run",
    "truth",
)

PLACES = 3  # of a regret: a thousandth of a voxel width

HELD = "†"


def csv(table: pd.DataFrame) -> bytes:
    """Return a table as CSV, numbers to six figures.

    The sums behind a mean may differ in their last bits from machine to machine; six figures don't.
    """
    return table.to_csv(index=False, lineterminator="\n", float_format="%.6g").encode()


def read(folder: Path) -> dict[str, pd.DataFrame]:
    """Return the tables of a report by name, as they stand in its folder tables."""
    tables = {}
    for path in sorted(folder.glob("*.csv")):
        names = pd.read_csv(path, nrows=0).columns
        tables[path.stem] = pd.read_csv(
            path,
            dtype={name: str for name in names if name in TEXT},
            keep_default_na=False,
            na_values={name: [""] for name in names if name not in TEXT},
        )
    return tables


def escaped(label: object) -> str:
    """Return a text so that Markdown and HTML show it as it is; only bare underscores are left."""
    marks = r"[&<>$]|[\\`*|~#\[\]!]|(?<![^\W_])_|_(?![^\W_])"
    return re.sub(
        marks,
        lambda found: f"&#{ord(found[0])};" if found[0] in "&<>$" else f"\\{found[0]}",
        " ".join(str(label).split()),
    )


def fenced(command: str) -> str:
    """Return a command as a block of code, whatever is in it."""
    fence = "`" * max([3, *(len(ticks) + 1 for ticks in re.findall("`+", command))])
    return f"{fence}sh\n{command}\n{fence}"


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as Markdown, columns aligned, numbers to the right."""
    body = [[str(value) for value in row] for row in rows]
    widths = [max(3, *(len(row[i]) for row in [head, *body])) for i in range(len(head))]
    is_text = [
        i == 0 or not any(map(_is_numeric, column))
        for i, column in enumerate(zip(*body, strict=True))
    ]
    rule = [
        "-" * w if text else "-" * (w - 1) + ":" for w, text in zip(widths, is_text, strict=True)
    ]
    lines = [
        " | ".join(
            value.ljust(w) if text else value.rjust(w)
            for value, w, text in zip(row, widths, is_text, strict=True)
        )
        for row in [head, rule, *body]
    ]
    return "".join(f"| {line} |\n" for line in lines)


def _is_numeric(text: str) -> bool:
    return re.match(r"[-<>* ]*[\d∞]", text) is not None


def number(value: float, places: int = 2) -> str:
    """Return a number with so many places; nothing where it is NaN."""
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "∞"
    text = f"{value:.{places}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def with_band(value: float, low: float, high: float, places: int = 2) -> str:
    """Return a number with its band, as 0.75 [0.60, 0.90]; alone where it has none to tell."""
    if not math.isfinite(value) or math.isnan(low):
        return number(value, places)
    return f"{number(value, places)} [{number(low, places)}, {number(high, places)}]"


def percent(share: float) -> str:
    """Return a share as whole percent, with 100 % and 0 % kept for all and none."""
    if math.isnan(share):
        return ""
    rounded = round(100 * share)
    if rounded == 100 and share < 1:
        return "> 99 %"
    if rounded == 0 and share > 0:
        return "< 1 %"
    return f"{rounded} %"


def probability(p: float) -> str:
    """Return a p-value to two figures."""
    if math.isnan(p):
        return ""
    return "< 0.0001" if p < 0.0001 else f"{p:.2g}"


def overview(table: pd.DataFrame) -> str:
    """Return what every searcher used, of `tables.overview`."""
    axes = _axes(table, "searcher")
    used = ["unique evaluations", "evaluations", "steps"]
    rows = (
        [
            *_labels(row, axes),
            *(
                number(row[name], 0)
                for name in ("runs", "failed", "unique", "evaluations", "steps")
            ),
        ]
        for row in records(table)
    )
    return markdown([*axes, "runs", "failed", *(f"{name} (median)" for name in used)], rows)


def problems(table: pd.DataFrame) -> str:
    """Return what the best is worth on every problem, of `tables.problems`."""
    axes = [name for name in _axes(table) if name != "policy"]
    rows = (
        [
            *_labels(row, axes),
            number(row["goal"], 4),
            "the optimum" if row["known"] else "the best that any run found",
        ]
        for row in records(table[table["physics"] != ""])
    )
    return markdown([*axes, "best fitness", "which is"], rows)


def fixed_budget(table: pd.DataFrame) -> str:
    """Return the regret at fixed budgets, of `tables.fixed_budget` in one kind of terms."""
    rows = [
        [escaped(searcher), *map(_at_budget, records(own))]
        for (searcher,), own in groups(table, "searcher")
    ]
    return markdown(["searcher", *dict.fromkeys(map(str, table["budget"]))], rows)


def _at_budget(row: dict[str, Any]) -> str:
    text = with_band(row["iqm"], row["low"], row["high"], PLACES)
    return f"{text} {HELD} {percent(row['reached'])}" if row["reached"] < 1 else text


def fixed_target(table: pd.DataFrame) -> str:
    """Return expected running times and success, of `tables.fixed_target`."""
    targets = dict.fromkeys(zip(table["terms"], table["target"], strict=True))
    rows = [
        [
            escaped(searcher),
            *(
                f"{with_band(row['ert'], row['low'], row['high'], 0)} ({percent(row['success'])})"
                for row in records(own)
            ),
        ]
        for (searcher,), own in groups(table, "searcher")
    ]
    return markdown(["searcher", *(f"{terms} {percent(share)}" for terms, share in targets)], rows)


def pairs(table: pd.DataFrame) -> str:
    """Return A12 of every pair as a square, bold if significant.

    Parameters
    ----------
    table : DataFrame
        Of `tables.pairs`, at one budget and in one kind of terms.
    """
    names = list(dict.fromkeys([*table["a"], *table["b"]]))
    square = {(name, name): "" for name in names}
    for row in records(table):
        a, b = row["a"], row["b"]
        mark = "**" if row["p_holm"] < 0.05 else ""
        square[a, b] = f"{mark}{row['a12']:.2f}{mark}"
        square[b, a] = f"{mark}{1 - row['a12']:.2f}{mark}"
    labels = [escaped(name) for name in names]
    rows = ([label, *(square[a, b] for b in names)] for label, a in zip(labels, names, strict=True))
    return markdown(["", *labels], rows)


def noise(table: pd.DataFrame) -> str:
    """Return true regret and optimism, of `noise.by_searcher` or `noise.by_policy`."""
    axes = _axes(table, *table.columns.intersection(["searcher"]))
    head = [*axes, "runs", "true regret", "its mean", "optimism"]
    tested = "true_regret_p" in table and bool(table["true_regret_p"].notna().any())
    if tested:
        head += ["A12 of regret", "p of regret (Holm)", "A12 of optimism", "p of optimism (Holm)"]
    rows = []
    for row in records(table):
        known = row["known"]
        regret, optimism = (
            with_band(row[name], row[f"{name}_low"], row[f"{name}_high"], PLACES)
            for name in ("true_regret", "optimism")
        )
        cells = [
            *_labels(row, axes),
            f"{known}" if known == row["runs"] else f"{known} ({known} of {row['runs']} known)",
            regret,
            number(row["true_regret_mean"], PLACES),
            optimism,
        ]
        for name in ("true_regret", "optimism") if tested else ():
            cells += [number(row[f"{name}_a12"], 2), probability(row[f"{name}_p_holm"])]
        rows.append(cells)
    return markdown(head, rows)


def _axes(table: pd.DataFrame, *more: str) -> list[str]:
    """Return the columns that say which runs a row is about, without those that never differ."""
    several = [name for name in ("physics", "shape") if table[name].nunique() > 1]
    several += ["level"] if table["level"].notna().any() else []
    several += ["policy"] if (table["policy"] != "").any() else []
    return [*several, *more]


def _labels(row: dict[Any, Any], axes: Iterable[str]) -> list[str]:
    return [f"{row[name]:g}" if name == "level" else escaped(row[name]) for name in axes]
