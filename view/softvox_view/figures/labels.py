"""Placement of words beside points in a panel, without overlaps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from numpy.typing import NDArray

from softvox_view.figures import style

Array = NDArray[np.float64]

#: Shares of a panel's side: step between places that are tried; room around a word; the distance
#: from which a line leads to it; the detour that is preferred to covering one point of a line.
STEP, ROOM, FAR, DETOUR = 0.01, 0.012, 0.05, 0.03


def put(
    axis: Axes, words: Sequence[tuple[str, Array]], *, clear: Array, lines: Array, far: float = FAR
) -> None:
    """Write words as near to their places as there is room; a word without room is left out.

    The figure must be laid out. Words never cover boxes (n, 4), left, bottom, right and top, and
    avoid lines, points (m, 2). All are in shares of the panel's sides. If a word is farther from
    its place than `far`, a line leads to it.
    """
    for word, place in words:
        options: dict[str, Any] = {"size": style.SMALL, "parse_math": False, "va": "bottom"}
        text = axis.text(0, 0, word, transform=axis.transAxes, bbox=style.PAPER, **options)
        size = np.divide(text.get_window_extent().size, axis.bbox.size)
        across, up = (np.arange(ROOM, 1 - ROOM - side, STEP) for side in size)
        low = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
        # A word covers the points of lines that are both in its columns and in its rows.
        columns, rows = (
            ((along > at - ROOM) & (along < at + side + ROOM)).astype(np.float64)
            for along, at, side in zip(
                lines.T, (across[:, np.newaxis], up[:, np.newaxis]), size, strict=True
            )
        )
        covered = (rows @ columns.T).ravel()
        for box in clear:
            is_free = np.any((low + size + ROOM < box[:2]) | (low - ROOM > box[2:]), axis=1)
            low, covered = low[is_free], covered[is_free]
        if not len(low):
            text.remove()
            continue
        ends = np.clip(place, low, low + size)
        away = np.hypot(*(ends - place).T)
        best = np.argmin(away + DETOUR * covered)
        text.set(position=low[best], zorder=6)
        clear = np.concatenate([clear, [[*low[best], *(low[best] + size)]]])
        if away[best] > far:
            white = [patheffects.withStroke(linewidth=1.6, foreground="white")]
            leader: dict[str, Any] = {"color": style.INK, "lw": 0.5, "path_effects": white}
            leader |= {"transform": axis.transAxes, "zorder": 1.5}
            axis.plot(*np.transpose([place, ends[best]]), **leader)
