"""How the figures look: sizes, fonts and colours in one place; the same bytes on every run."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal, TypeAlias

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

Layout: TypeAlias = Literal["constrained", "compressed", "tight"]

#: Formats that a figure can be written in.
FORMATS = ("png", "pdf")

#: Inches: the text width of a two-column paper.
WIDTH = 7.16

#: Pixels per inch of PNG files, and of the pictures within PDF files.
DPI = 300

#: Points.
FONT, SMALL, TINY = 8.0, 7.0, 5.5

INK, GREY, PALE = "#222222", "#8C8C8C", "#D9D9D9"

#: Fitness and all else that has a size: perceptually uniform, lightness rising, colour-blind safe.
SEQUENTIAL = "cividis"
#: Directions: cyclic, dark towards +-180 degrees.
CYCLIC = "twilight"
#: Time, from dark to light.
TIME = "viridis"
#: Where a map of colours ends that has to stay apart from white.
PALEST = 0.9

_STYLE: dict[Any, Any] = {
    "font.size": FONT,
    "axes.titlesize": FONT,
    "axes.labelsize": FONT,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "text.color": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "pdf.fonttype": 42,  # text stays text: it can be searched, copied and edited
    "figure.dpi": DPI,
}

#: Without a date, and without the version of what wrote it.
_METADATA: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the figures' style, whatever the user's settings are; they are put back."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def figure(width: float, height: float, *, layout: Layout | None = "constrained") -> Figure:
    """Return an empty figure, inches."""
    made = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(made)
    return made


def on_white(name: str) -> ListedColormap:
    """Return a map of colours, cut off before it is too pale beside white."""
    return ListedColormap(colormaps[name](np.linspace(0, PALEST, 256)))


def encoded(made: Figure, form: str) -> bytes:
    """Return a figure as the bytes of a file.

    Parameters
    ----------
    made : Figure
    form : str
        One of `FORMATS`.
    """
    lay_out(made)
    buffer = io.BytesIO()
    made.savefig(buffer, format=form, dpi=DPI, metadata=_METADATA[form])
    return buffer.getvalue()


def lay_out(made: Figure) -> None:
    """Put the parts of a figure where they belong, for good; nothing where that was done before.

    Left to itself matplotlib does so for every file anew, in its own units, and draws it twice.
    """
    engine = made.get_layout_engine()
    if engine is not None:
        made.set_dpi(DPI)
        engine.execute(made)
        made.set_layout_engine(None)
