"""How the paper's figures look: the project's style for print without a grid, and colours."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from softvox_search.report.style import FORMATS, INK, PRINT, encoded, figure, lay_out, line
from softvox_search.report.style import style as project_style

# The style is the door to matplotlib, which it imports whatever MPLBACKEND names.
from matplotlib import colormaps  # isort: skip
from matplotlib.colors import ListedColormap  # isort: skip

__all__ = ["FORMATS", "INK", "encoded", "figure", "lay_out", "line", "on_white", "style"]

#: Inches: the text width of a two-column paper. Pixels per inch.
WIDTH, DPI = PRINT.widest, PRINT.dpi

#: Points: of numbers and labels.
SMALL = PRINT.font

GREY, PALE = "#8C8C8C", "#D9D9D9"

#: What words on colours or lines are written on.
PAPER: dict[str, Any] = {"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1.0}

#: Fitness and all else that has a size: perceptually uniform, lightness rising, colour-blind safe.
SEQUENTIAL = "cividis"
#: Directions: cyclic, dark towards +-180 degrees.
CYCLIC = "twilight"
#: Time, from dark to light.
TIME = "viridis"
#: Where a map of colours ends that has to stay apart from white.
PALEST = 0.9

#: What differs from the project's style: maps have frames and no grid, and d_0 is a symbol.
_CHANGES = {
    "axes.spines.top": True,
    "axes.spines.right": True,
    "axes.grid": False,
    "axes.axisbelow": "line",
    "text.parse_math": True,
}

#: A context manager to draw within, whatever the user's settings are; they are put back.
style = partial(project_style, PRINT, _CHANGES)


def on_white(name: str) -> ListedColormap:
    """Return a map of colours, cut off before it is too pale beside white."""
    return ListedColormap(colormaps[name](np.linspace(0, PALEST, 256)))
