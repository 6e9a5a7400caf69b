"""Maps of all designs: what the maps of fitness, classes, heading and robustness share."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from softvox_view.figures import style
from softvox_view.tessellation import SIDE, cell_of, mapped

#: Widths of the lines between squares by their side in cells, points.
LINES = {27: 0.9, 9: 0.35}


def show(axis: Axes, values: Any, *, lines: str = "white", **options: Any) -> AxesImage:
    """Draw a map of a value or colour per design, shape (6561,) or (6561, 3); see `Axes.imshow`."""
    image = axis.imshow(mapped(values), origin="lower", interpolation="nearest", **options)
    frame(axis, lines=lines)
    return image


def frame(axis: Axes, *, lines: str = "white") -> None:
    """Draw the lines of the outer nestings, and the digits along the sides."""
    for side, width in LINES.items():
        for edge in np.arange(side, SIDE, side) - 0.5:
            line: dict[str, Any] = {"color": lines, "lw": width}
            axis.axhline(edge, **line)
            axis.axvline(edge, **line)
    axis.set(xlim=(-0.5, SIDE - 0.5), ylim=(-0.5, SIDE - 0.5), aspect="equal")
    middles = np.arange(3) * 27 + 13
    axis.set_xticks(middles, ["0", "1", "2"])
    axis.set_yticks(middles, ["0", "1", "2"])
    axis.tick_params(length=0)
    axis.set_xlabel("$d_0$; within it $d_2$, then $d_4$, then $d_6$")
    axis.set_ylabel("$d_1$; within it $d_3$, then $d_5$, then $d_7$")


def mark(
    axis: Axes,
    design: int,
    text: str,
    *,
    offset: tuple[float, float] = (6, 6),
    ring: float = 6.0,
) -> None:
    """Put a ring around a design and a word at an offset, points, readable on any colour."""
    row, column = (int(place) for place in cell_of(design))
    axis.plot(
        column,
        row,
        "o",
        ms=ring,
        mfc="none",
        mec=style.INK,
        mew=0.9,
        path_effects=[patheffects.withStroke(linewidth=2.2, foreground="white")],
        clip_on=False,
        zorder=5,
    )
    axis.annotate(
        text,
        (column, row),
        xytext=offset,
        textcoords="offset points",
        size=style.SMALL,
        color=style.INK,
        bbox={"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1.0},
        ha="left" if offset[0] >= 0 else "right",
        va="bottom" if offset[1] >= 0 else "top",
        zorder=5,
    )
