"""Going through a data frame row by row and group by group."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pandas as pd


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows, each a dict by column."""
    columns: dict[Any, list[Any]] = {name: frame[name].tolist() for name in frame.columns}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def groups(frame: pd.DataFrame, *columns: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Go through the rows that agree in some columns, in order of appearance; NaN equals NaN.

    Yields
    ------
    key : tuple
        What they agree in.
    group : DataFrame
    """
    yield from frame.groupby(list(columns), dropna=False, sort=False)
