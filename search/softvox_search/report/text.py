"""Tables as CSV, and as Markdown for people."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from softvox_search.experiment.results import TEXT_COLUMNS, read_csv
from softvox_search.report.curves import groups, records

#: Text columns of the CSV files, except runs.csv.
TEXT = ("terms", "measure", "a", "b", "name", "truth", "against")

PLACES = 3  # of a regret: a thousandth of a voxel width

HELD = "†"


def csv(table: pd.DataFrame) -> bytes:
    """Return a table as CSV, numbers to six figures.

    The last bits of a mean may differ between machines, as its terms are summed; six figures don't.
    """
    return table.to_csv(index=False, lineterminator="\n", float_format="%.6g").encode()


def read(folder: Path, names: Iterable[str] | None = None) -> dict[str, pd.DataFrame]:
    """Return the tables of a report by name, as stored in its folder tables.

    Give names, such as "pairs.csv", to read only these: an earlier report may have left others.
    """
    paths = folder.glob("*.csv") if names is None else (folder / name for name in names)
    return {path.stem: read_csv(path, (*TEXT_COLUMNS, *TEXT)) for path in sorted(paths)}


def escaped(label: object) -> str:
    """Escape a text so that Markdown and HTML show it as it is; bare underscores stay."""
    marks = r"[&<>$]|[\\`*|~#\[\]!]|(?<![^\W_])_|_(?![^\W_])"
    return re.sub(
        marks,
        lambda found: f"&#{ord(found[0])};" if found[0] in "&<>$" else f"\\{found[0]}",
        " ".join(str(label).split()),
    )


def fenced(command: str) -> str:
    """Return a command as a block of code, whatever characters it has."""
    fence = "`" * max([3, *(len(ticks) + 1 for ticks in re.findall("`+", command))])
    return f"{fence}sh\n{command}\n{fence}"


def markdown(rows: Iterable[dict[str, str]]) -> str:
    """Return rows, each a dict by column, as a Markdown table, numbers aligned to the right."""
    table = pd.DataFrame(rows)
    columns = [[name, *table[name]] for name in table]
    for i, column in enumerate(columns):
        width = max(3, *map(len, column))
        is_number = i > 0 and any(re.match(r"[-<>* ]*[\d∞]", cell) for cell in column[1:])
        column.insert(1, "-" * (width - 1) + ":" if is_number else "-" * width)
        columns[i] = [cell.rjust(width) if is_number else cell.ljust(width) for cell in column]
    return "".join(f"| {' | '.join(line)} |\n" for line in zip(*columns, strict=True))


def number(value: float, places: int = 2) -> str:
    """Return a number with so many decimal places; an empty text for NaN."""
    if math.isnan(value):
        return ""
    return "∞" if math.isinf(value) else f"{value:z.{places}f}"


def with_band(value: float, low: float, high: float, places: int = 2) -> str:
    """Return a number with its band, as 0.75 [0.60, 0.90]; only the number if it has no band."""
    if not math.isfinite(value) or math.isnan(low):
        return number(value, places)
    return f"{number(value, places)} [{number(low, places)}, {number(high, places)}]"


def percent(share: float) -> str:
    """Return a share as whole percent; only all and none are 100 % and 0 %."""
    if math.isnan(share):
        return ""
    rounded = f"{100 * share:.0f} %"
    return {("100 %", True): "> 99 %", ("0 %", True): "< 1 %"}.get(
        (rounded, 0 < share < 1), rounded
    )


def probability(p: float) -> str:
    """Return a p-value to two figures."""
    if math.isnan(p):
        return ""
    return "< 0.0001" if p < 0.0001 else f"{p:.2g}"


def budget(stated: Mapping[str, Any]) -> str:
    """Describe what a budget allows."""
    return ", ".join(f"{name} {value}" for name, value in stated.items() if value)


def overview(table: pd.DataFrame) -> str:
    """Return the table of what every searcher used, from `tables.overview`."""
    columns = {"runs": "runs", "failed": "failed", "unique": "unique evaluations (median)"}
    columns |= {name: f"{name} (median)" for name in ("evaluations", "steps")}
    return markdown(
        {**_labels(row, table), **{text: number(row[n], 0) for n, text in columns.items()}}
        for row in records(table)
    )


def problems(table: pd.DataFrame) -> str:
    """Return the table of the best of every problem, from `tables.problems`."""
    return markdown(
        {
            **_labels(row, table),
            "best fitness": number(row["goal"], 5),  # as in the file: to round twice can be wrong
            "which is": "the optimum" if row["known"] else "the best that any run was told",
            "designs that meet the hardest target": number(row["finest"], 0),
            "targets that at most four meet": number(row["hard"], 0),
            **({"under noise": escaped(row["truth"])} if "truth" in row else {}),
        }
        for row in records(table[table["physics"] != ""])
    )


def fixed_budget(table: pd.DataFrame) -> str:
    """Return the regret at fixed budgets, from `tables.fixed_budget` in one kind of terms."""
    return markdown(
        {"searcher": escaped(name), **{f"{row['budget']}": _held(row) for row in records(own)}}
        for (name,), own in groups(table, "searcher")
    )


def _held(row: dict[str, Any]) -> str:
    text = with_band(row["iqm"], row["low"], row["high"], PLACES)
    return f"{text} {HELD} {percent(row['reached'])}" if row["reached"] < 1 else text


def fixed_target(table: pd.DataFrame) -> str:
    """Return expected running times and success rates, from `tables.fixed_target`."""
    rows = []
    for (name,), own in groups(table, "searcher"):
        cells = {"searcher": escaped(name)}
        for row in records(own):
            time = with_band(row["ert"], row["low"], row["high"], 0)
            column = f"{row['terms']} {percent(row['target'])}"
            cells[column] = f"{time} ({percent(row['success'])})"
        rows.append(cells)
    return markdown(rows)


def pairs(table: pd.DataFrame) -> str:
    """Return A12 of every pair as a square table, bold if significant.

    The table is `tables.pairs`, at one budget and in one kind of terms.
    """
    names = [escaped(name) for name in dict.fromkeys([*table["a"], *table["b"]])]
    square = {a: {"": a, **dict.fromkeys(names, "")} for a in names}
    for row in records(table):
        a, b = escaped(row["a"]), escaped(row["b"])
        mark = "**" if row["p_holm"] < 0.05 else ""
        square[a][b] = f"{mark}{row['a12']:.2f}{mark}"
        square[b][a] = f"{mark}{1 - row['a12']:.2f}{mark}"
    return markdown(square.values())


def noise(table: pd.DataFrame) -> str:
    """Return true regret and optimism, from `noise.by_searcher` or `noise.by_policy`."""
    tested = "true_regret_p" in table and table["true_regret_p"].notna().any()
    rows = []
    for row in records(table[table["known"] > 0]):
        known = f"{row['known']}"
        if row["known"] < row["runs"]:
            known += f" ({known} of {row['runs']} known)"
        regret, optimism = (
            with_band(row[name], row[f"{name}_low"], row[f"{name}_high"], PLACES)
            for name in ("true_regret", "optimism")
        )
        cells = {
            **_labels(row, table),
            "runs": known,
            "true regret": regret,
            "its mean": number(row["true_regret_mean"], PLACES),
            "optimism": optimism,
        }
        for name, text in (("true_regret", "regret"), ("optimism", "optimism")) if tested else ():
            cells[f"A12 of {text}"] = number(row[f"{name}_a12"], 2)
            cells[f"p of {text} (Holm)"] = probability(row[f"{name}_p_holm"])
        rows.append(cells)
    return markdown(rows)


def _labels(row: dict[str, Any], table: pd.DataFrame) -> dict[str, str]:
    """Return the labels of a row's runs, without those that never differ in a table."""
    several = [name for name in ("physics", "shape") if table[name].nunique() > 1]
    several += [
        name for name in ("policy", "searcher") if name in row and (table[name] != "").any()
    ]
    labels = {name: escaped(row[name]) for name in several}
    return labels if np.isnan(row["level"]) else {"level": f"{row['level']:g}", **labels}
