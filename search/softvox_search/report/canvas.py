"""Figures that come out the same bytes everywhere, and don't touch the caller's matplotlib."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D


@dataclass(frozen=True)
class Look:
    """How large figures and what is in them are.

    Parameters
    ----------
    dpi : int
        Pixels per inch.
    font : float
        Points of numbers and labels; titles, lines and markers keep their proportion to it.
    widest : float
        Inches; a figure that would be wider shrinks to this, and its text does not.
    panel : (float, float)
        Inches of a panel of a grid, with its share of what is around it.
    columns : tuple of int
        Numbers of columns of a grid of five panels or more, the best first: that one is taken which
        leaves the fewest places empty.
    """

    dpi: int = 120
    font: float = 9.0
    widest: float = 13.0
    panel: tuple[float, float] = (2.6, 2.1)
    columns: tuple[int, ...] = (4, 5, 3)


#: For the page of a report, on a screen.
REPORT = Look()

_look: ContextVar[Look] = ContextVar("look", default=REPORT)

#: Okabe and Ito's colours, which the colour-blind can tell apart, in an order that alternates
#: dark and light.
COLOURS = ("#0072B2", "#E69F00", "#000000", "#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#F0E442")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
LINES = ("-", "--", ":", "-.")

INK, GREY = "#222222", "#C4C4C4"

_STYLE: dict[Any, Any] = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "axes.axisbelow": True,
    "legend.frameon": False,
}


@contextmanager
def style(look: Look = REPORT) -> Iterator[None]:
    """Draw in the report's style, whatever the user's settings are; they are put back.

    Parameters
    ----------
    look : Look
        Of what is drawn within.
    """
    with matplotlib.rc_context():
        before = _look.set(look)
        matplotlib.rcdefaults()
        matplotlib.rcParams.update({**_STYLE, **_sizes(), "figure.dpi": look.dpi})
        try:
            yield
        finally:
            _look.reset(before)


def scaled(size: float) -> float:
    """Return a size, points or inches, that is meant for text of 9 points, for the look's."""
    return size * (_look.get().font / REPORT.font)


def _sizes() -> dict[Any, Any]:
    return {
        "font.size": scaled(9),
        "figure.labelsize": scaled(9),
        "axes.titlesize": scaled(9.5),
        "legend.title_fontsize": scaled(12),
        "axes.linewidth": scaled(0.8),
        "grid.linewidth": scaled(0.6),
    }


def figure(width: float, height: float) -> Figure:
    """Return an empty figure, inches, no wider than the look allows."""
    shrunk = min(1.0, _look.get().widest / width)
    made = Figure(figsize=(shrunk * width, height), layout="constrained")
    FigureCanvasAgg(made)
    return made


def grid(panels: int, *, height: float = 1.0) -> tuple[Figure, list[Axes]]:
    """Return a figure of so many panels with shared axes, and the panels in reading order.

    Parameters
    ----------
    panels : int
    height : float
        Of a panel, relative to the look's.
    """
    look = _look.get()
    columns = panels if panels < 5 else min(look.columns, key=lambda wide: -panels % wide)
    rows = -(-panels // columns)
    width, high = look.panel
    made = figure(width * max(columns, 2), height * high * rows + scaled(1.0))
    axes = made.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    flat = list(axes.flat)
    for empty in flat[panels:]:
        empty.remove()
    for i, axis in enumerate(flat[:panels]):
        # A panel with nothing below it carries the ticks that the last row would have carried.
        axis.tick_params(labelbottom=i + columns >= panels)
    return made, flat[:panels]


def legend(made: Figure, title: str, handles: list[Line2D]) -> None:
    """Put the title and the legend above the panels, where they cover nothing."""
    made.legend(
        handles=handles,
        title=title,
        loc="outside upper center",
        ncols=max(1, int(made.get_figwidth() // scaled(2.4))),
    )


def png(made: Figure) -> bytes:
    """Return the picture without a date or a version in it."""
    buffer = io.BytesIO()
    made.savefig(buffer, format="png", dpi="figure", metadata={"Software": None})
    return buffer.getvalue()
