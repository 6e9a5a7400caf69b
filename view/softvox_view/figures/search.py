"""Searchers compared: the figures of a report for print, drawn anew from folders of results."""

from __future__ import annotations

from matplotlib.figure import Figure

from softvox_search.experiment.results import FOLDER
from softvox_search.report import figures, tables, text
from softvox_search.report.style import PRINT, style
from softvox_view.figures import Drawing, Inputs


def draw_search(inputs: Inputs) -> Drawing:
    """Draw the figures of every folder; the folder's name is part of theirs.

    They are made from its runs; where it is kept without them, from the tables of its report.
    """
    made: dict[str, Figure] = {}
    with style(PRINT):
        for name, results in inputs.results.items():
            has_runs = (results.folder / FOLDER).is_dir()
            of = tables.make(results) if has_runs else text.read(results.folder / "tables")
            made |= {f"search_{name}_{key}": figure for key, figure in figures.draw(of).items()}
    return Drawing(made)
