"""Tables as CSV and as Markdown."""

from __future__ import annotations

import math

import pandas as pd

HELD = "†"


def csv(table: pd.DataFrame) -> bytes:
    """Return a table as CSV, numbers to six figures.

    The sums behind a mean may differ in their last bits from machine to machine; six figures don't.
    """
    return table.to_csv(index=False, lineterminator="\n", float_format="%.6g").encode()


def markdown(table: pd.DataFrame) -> str:
    """Return a table of strings as Markdown, columns aligned, numbers to the right."""
    head = [_cell(name) for name in table.columns]
    rows = [[_cell(value) for value in row] for row in table.itertuples(index=False)]
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    widths = [max(width, 3) for width in widths]
    is_text = [i == 0 or not any(_is_numeric(row[i]) for row in rows) for i in range(len(head))]
    rule = [
        "-" * w if text else "-" * (w - 1) + ":" for w, text in zip(widths, is_text, strict=True)
    ]
    lines = [
        "| "
        + " | ".join(
            value.ljust(w) if text else value.rjust(w)
            for value, w, text in zip(row, widths, is_text, strict=True)
        )
        + " |"
        for row in [head, rule, *rows]
    ]
    return "\n".join(lines) + "\n"


def _cell(value: object) -> str:
    return str(value).replace("|", "\\|").replace("\n", " ")


def _is_numeric(text: str) -> bool:
    return any(character.isdigit() or character == "∞" for character in text)


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
