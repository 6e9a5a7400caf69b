"""Words beside places in a panel, none on another and few on lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from softvox_view.figures import style

Array = NDArray[np.float64]

#: Shares of a panel's side: between places that are tried, around a word, and the distance from
#: which on a line leads to it.
STEP, ROOM, FAR = 0.01, 0.012, 0.05

#: Shares of the side that a word goes farther rather than cover one point of a line.
DETOUR = 0.03


def put(axis: Axes, words: Sequence[tuple[str, Array]], *, clear: Array, lines: Array) -> None:
    """Write words as near to their places as there is room; a word without room is left out.

    The figure must be laid out. They keep clear of boxes (n, 4), left, bottom, right and top, and
    rather do not cover lines, points (m, 2). All are shares of the panel's sides.
    """
    for word, place in words:
        text = axis.text(0, 0, word, size=style.TINY, transform=axis.transAxes, parse_math=False)
        size = _size(axis, text)
        corner = _corner(place, size, clear, lines)
        if corner is None:
            text.remove()
            continue
        text.set(position=corner, va="bottom", zorder=6)
        box = np.concatenate([corner, corner + size])
        clear = np.concatenate([clear, [box]])
        end = np.clip(place, box[:2], box[2:])
        if np.hypot(*(end - place)) > FAR:
            leader: dict[str, Any] = {"color": style.GREY, "lw": 0.4, "zorder": 3}
            axis.plot(*np.transpose([place, end]), transform=axis.transAxes, **leader)


def _size(axis: Axes, text: Any) -> Array:
    """Return width and height of a word, shares of the panel's sides."""
    canvas: Any = axis.figure.canvas
    box = text.get_window_extent(canvas.get_renderer())
    return np.array([box.width / axis.bbox.width, box.height / axis.bbox.height])


def _corner(place: Array, size: Array, clear: Array, lines: Array) -> Array | None:
    """Return where the lower left corner of a word goes; None where there is no room."""
    across, up = (np.arange(ROOM, 1 - ROOM - side, STEP) for side in size)
    low = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
    high = low + size
    is_free = np.ones(len(low), dtype=bool)
    for box in clear:
        is_free &= np.any((high + ROOM < box[:2]) | (low - ROOM > box[2:]), axis=1)
    if not is_free.any():
        return None
    low, high = low[is_free], high[is_free]
    away = np.hypot(*(np.clip(place, low, high) - place).T)
    inside = (lines > low[:, np.newaxis] - ROOM) & (lines < high[:, np.newaxis] + ROOM)
    covered = inside.all(axis=2).sum(axis=1)
    return np.asarray(low[np.argmin(away + DETOUR * covered)])
