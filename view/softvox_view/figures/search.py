"""Searchers compared: the figures of a report, drawn anew from a folder of results."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
from matplotlib.figure import Figure

from softvox_search.report import canvas
from softvox_search.report.drawing import drawn
from softvox_view.figures import Inputs, Made, style
from softvox_view.results_folder import read_all

#: As large as the other figures, not as those of the report's page.
LOOK = canvas.Look(
    dpi=style.DPI,
    font=style.SMALL,
    widest=style.WIDTH,
    panel=(style.WIDTH / 3, 1.25),
    columns=(4, 3),
)


@contextmanager
def look() -> Iterator[None]:
    """Draw in the report's style, for print, with text that stays text."""
    with canvas.style(LOOK):
        matplotlib.rcParams["pdf.fonttype"] = 42
        yield


def draw(inputs: Inputs) -> Made:
    """Draw the figures of every folder; the folder's name is part of theirs.

    Raises
    ------
    ResultsError
        Where there is no folder, two have the same name, or one can't be used.
    """
    figures: dict[str, Figure] = {}
    with look():
        for name, tables in read_all(inputs.results).items():
            figures |= {f"search_{name}_{key}": figure for key, figure in drawn(tables).items()}
    return Made(figures, look=look)
