"""Searchers compared: the figures of a report for print, drawn anew from folders of results."""

from __future__ import annotations

from matplotlib.figure import Figure

from softvox_search.report import figures, tables
from softvox_search.report.style import PRINT, style
from softvox_view.figures import Drawing, Inputs


def draw(inputs: Inputs) -> Drawing:
    """Draw the figures of every folder; the folder's name is part of theirs."""
    made: dict[str, Figure] = {}
    with style(PRINT):
        for name, results in inputs.results.items():
            drawn = figures.draw(tables.make(results))
            made |= {f"search_{name}_{key}": figure for key, figure in drawn.items()}
    return Drawing(made, style=lambda: style(PRINT))
