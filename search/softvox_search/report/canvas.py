"""Figures that come out the same bytes everywhere, and don't touch the caller's matplotlib."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

DPI = 120

#: Okabe and Ito's colours, which the colour-blind can tell apart, in an order that alternates
#: dark and light.
COLOURS = ("#0072B2", "#E69F00", "#000000", "#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#F0E442")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
LINES = ("-", "--", ":", "-.")

INK, GREY = "#222222", "#C4C4C4"

_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "figure.dpi": DPI,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the report's style, whatever the user's settings are; they are put back."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def figure(width: float, height: float) -> Figure:
    """Return an empty figure, inches."""
    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    return made


def grid(panels: int, *, height: float = 2.1) -> tuple[Figure, list[Axes]]:
    """Return a figure of so many panels with shared axes, and the panels in reading order."""
    columns = panels if panels < 5 else min((4, 5, 3), key=lambda wide: -panels % wide)
    rows = -(-panels // columns)
    made = figure(max(2.6 * columns, 5.2), height * rows + 1.0)
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
        title_fontproperties={"size": 12},
        loc="outside upper center",
        ncols=max(1, int(made.get_figwidth() // 2.4)),
    )


def png(made: Figure) -> bytes:
    """Return the picture without a date or a version in it."""
    buffer = io.BytesIO()
    made.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()
