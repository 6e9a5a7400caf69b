"""The style of the paper's figures: the project's style for print without a grid, and colours."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from softvox_search.report.style import FORMATS, INK, PRINT, encoded, figure, lay_out, line
from softvox_search.report.style import style as project_style

# The style must come before matplotlib, as it imports that whatever MPLBACKEND names.
from matplotlib import colormaps  # isort: skip
from matplotlib.colors import ListedColormap  # isort: skip

__all__ = ["FORMATS", "INK", "encoded", "figure", "lay_out", "line", "on_white", "style"]

#: The text width of a two-column paper, inches; pixels per inch.
WIDTH, DPI = PRINT.widest, PRINT.dpi

#: Size of numbers and labels, points.
SMALL = PRINT.font

GREY, PALE = "#8C8C8C", "#D9D9D9"

#: The background of words on colours or lines.
PAPER: dict[str, Any] = {"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1.0}

#: Colours of fitness and other magnitudes: perceptually uniform, colour-blind safe.
SEQUENTIAL = "cividis"
#: Colours of directions: cyclic, dark towards +-180 degrees.
CYCLIC = "twilight"
#: Colours of time, from dark to light.
TIME = "viridis"
#: Where to end a colour map that has to be distinct from white.
PALEST = 0.9

#: The differences from the project's style: maps have frames and no grid, and d_0 is a symbol.
_CHANGES = {
    "axes.spines.top": True,
    "axes.spines.right": True,
    "axes.grid": False,
    "axes.axisbelow": "line",
    "text.parse_math": True,
}

#: A context in which to draw, whatever the user's settings; these are restored.
style = partial(project_style, PRINT, _CHANGES)


def on_white(name: str) -> ListedColormap:
    """Return a colour map without its end that is too pale on white."""
    return ListedColormap(colormaps[name](np.linspace(0, PALEST, 256)))
