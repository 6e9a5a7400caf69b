"""The style of all figures, and the only module that imports matplotlib: the same bytes everywhere.

It leaves the caller's matplotlib settings alone, and needs no interactive backend.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal


def _import_matplotlib() -> None:
    """Import matplotlib, even where MPLBACKEND names a backend that is not installed.

    Every Jupyter kernel sets the variable, and its child processes inherit it. Matplotlib then
    can't be imported unless the kernel's own package is installed beside it.
    """
    wanted = None if "matplotlib" in sys.modules else os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    finally:
        if wanted is not None:
            os.environ["MPLBACKEND"] = wanted
    if wanted:
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = wanted  # as the import would have done


_import_matplotlib()

import matplotlib  # noqa: E402, it needs the lines above
from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.ticker import LogFormatter  # noqa: E402

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Look:
    """The sizes of figures and of what is in them."""

    dpi: int = 120
    #: Points, of numbers and labels; titles, lines and markers scale with it.
    font: float = 9.0
    #: Inches; a figure that would be wider shrinks to this, but its text does not.
    widest: float = 13.0
    #: Inches of a panel of a grid, with its share of the space around it.
    panel: tuple[float, float] = (2.6, 2.1)
    #: Columns of a grid of five panels or more, by preference; the fewest empty places win.
    columns: tuple[int, ...] = (4, 5, 3)


#: For a report on a screen; and for print, as wide as the text of a paper.
SCREEN = Look()
PRINT = Look(dpi=300, font=7.0, widest=7.16, panel=(7.16 / 3, 1.25), columns=(4, 3))

_look: ContextVar[Look] = ContextVar("look", default=SCREEN)

#: Okabe and Ito's colour-blind safe colours, in an order that alternates dark and light.
COLOURS = ("#0072B2", "#E69F00", "#000000", "#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#F0E442")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
LINES = ("-", "--", ":", "-.")

INK, GREY = "#222222", "#C4C4C4"

#: Formats that a figure can be written in, without date and version of the writer.
FORMATS: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}

#: And of a picture within an HTML page.
_METADATA = {**FORMATS, "svg": dict.fromkeys(("Creator", "Date", "Format", "Type"))}

_STYLE: dict[Any, Any] = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.grid": True,
    "grid.color": "#E6E6E6",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "text.parse_math": False,  # a label is text, even with dollar signs in it
    "svg.hashsalt": "softvox",  # the same ids on every run
    "pdf.fonttype": 42,  # text stays text: it can be searched, copied and edited
}

#: Points, at a font of 9.
_SIZES = {
    "font.size": 9,
    "figure.labelsize": 9,
    "axes.titlesize": 9.5,
    "legend.title_fontsize": 12,
    "axes.linewidth": 0.8,
    "grid.linewidth": 0.6,
}


@contextmanager
def style(look: Look = SCREEN, changes: dict[Any, Any] | None = None) -> Iterator[None]:
    """Draw in the project's style, whatever the user's settings; these are restored.

    The changes are differences from the style, by the names of matplotlib's parameters.
    """
    with matplotlib.rc_context():
        before = _look.set(look)
        sizes: dict[Any, Any] = {name: scaled(size) for name, size in _SIZES.items()}
        matplotlib.rcdefaults()
        matplotlib.rcParams.update({**_STYLE, **sizes, "figure.dpi": look.dpi, **(changes or {})})
        try:
            yield
        finally:
            _look.reset(before)


def scaled(size: float) -> float:
    """Scale a size meant for text of 9 points (points or inches) to the look's font."""
    return size * (_look.get().font / SCREEN.font)


def figure(
    width: float,
    height: float,
    *,
    layout: Literal["constrained", "compressed", "tight"] | None = "constrained",
) -> Figure:
    """Return an empty figure, inches, no wider than the look allows."""
    made = Figure(figsize=(min(width, _look.get().widest), height), layout=layout)
    FigureCanvasAgg(made)
    return made


def grid(panels: int, *, height: float = 1.0, is_shared: bool = True) -> tuple[Figure, list[Axes]]:
    """Return a figure with so many panels, and the panels in reading order.

    Their height is relative to the look's; their axes are shared, or each has its own.
    """
    look = _look.get()
    columns = panels if panels < 5 else min(look.columns, key=lambda wide: -panels % wide)
    rows = -(-panels // columns)
    width, high = look.panel
    made = figure(width * max(columns, 2), height * high * rows + scaled(1.0))
    axes = made.subplots(rows, columns, sharex=is_shared, sharey=is_shared, squeeze=False)
    flat = list(axes.flat)
    for empty in flat[panels:]:
        empty.remove()
    for i, axis in enumerate(flat[:panels]):
        # A panel with nothing below it shows the ticks that the last row would have shown.
        axis.tick_params(labelbottom=not is_shared or i + columns >= panels)
    return made, flat[:panels]


def line(label: str = "", **options: Any) -> Line2D:
    """Return an entry of a legend: a line and its label."""
    return Line2D([], [], label=label, **options)


def log_axis(axis: Axes) -> None:
    """Make x logarithmic, with plain numbers: matplotlib's own would be mathtext."""
    axis.set_xscale("log")
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(LogFormatter())  # shown where there is less than a decade


def legend(made: Figure, title: str, handles: list[Line2D]) -> None:
    """Put the title and the legend above the panels, where they cover nothing."""
    width = int(made.get_figwidth() / scaled(0.085))
    made.legend(
        handles=handles,
        title=fill(title, width),
        loc="outside upper center",
        ncols=max(1, int(made.get_figwidth() // scaled(2.4))),
    )


def lay_out(made: Figure) -> None:
    """Lay out the parts of a figure once and for all.

    Otherwise matplotlib does so for every file anew, in the file's own units.
    """
    if (engine := made.get_layout_engine()) is not None:
        engine.execute(made)
        made.set_layout_engine(None)


def encoded(made: Figure, form: str = "png") -> bytes:
    """Return a figure as the bytes of a file; form is one of `FORMATS`, or svg."""
    lay_out(made)
    buffer = io.BytesIO()
    made.savefig(buffer, format=form, dpi="figure", metadata=_METADATA[form])
    return buffer.getvalue()
