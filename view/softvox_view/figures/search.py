"""Searchers, or transfer methods, compared: the figures of a report redrawn for print."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from softvox_search.experiment.results import FOLDER
from softvox_search.report import figures, tables, text, transfer, transfer_figures
from softvox_search.report.style import PRINT, style
from softvox_view.figures import Drawing, Inputs, figure_of


def draw_search(inputs: Inputs) -> Drawing:
    """Draw the figures of every folder of searchers, named after the folder."""
    return _drawn("search", inputs, tables, figures)


def draw_transfer(inputs: Inputs) -> Drawing:
    """Draw regret against tests of every folder of transfer methods, by task."""
    return _drawn("transfer", inputs, transfer, transfer_figures)


def _drawn(kind: str, inputs: Inputs, making: Any, drawing: Any) -> Drawing:
    """Draw the figures of all folders of a kind.

    They are made from a folder's runs, or from its report's tables if the runs were not kept.
    """
    made: dict[str, Figure] = {}
    with style(PRINT):
        for name, results in inputs.results.items():
            if figure_of(results) == kind:
                has_runs = (results.folder / FOLDER).is_dir()
                of = making.make(results) if has_runs else text.read(results.folder / "tables")
                made |= {f"{kind}_{name}_{key}": one for key, one in drawing.draw(of).items()}
    return Drawing(made)
