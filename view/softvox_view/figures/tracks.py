"""Tracks of the best of nine bodies (Fig. 7'), and of real robots over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.physics import Physics
from softvox_gym.simulation import simulate
from softvox_view.comparison import Compared, as_csv, as_lines, compare, short, track_at
from softvox_view.figures import Drawing, Inputs, labels, style
from softvox_view.figures.robots import best_of_bodies, picture
from softvox_view.tracks_csv import COLUMNS, RealTrack

CYCLES, PER_CYCLE = 23, 50

#: Panels on a page; what does not fit goes on to further pages.
PER_PAGE = 12

#: Designs of real tracks that are none of the nine have panels of their own, up to so many.
MOST_MORE = 99

ACROSS = 3

#: Inches: of a row of panels, of what is below all rows, and of the legend above.
ROW, FOOT, LEGEND = 2.24, 0.18, 0.36

#: Share of a panel's half side that the tracks leave free at the sides.
MARGIN = 0.12

#: cm; a scale is no finer than this, however little the robots travel.
LEAST_HALF = 0.5

#: Cycles between the marks of time on tracks that are compared.
MARKED = 5

#: Share of a panel's side that the robot's picture takes, and its pixels.
INSET, PIXELS = 0.30, 210

#: Half of the share of a panel's side that a mark at an end takes.
MARK = 0.022

_REAL: dict[str, Any] = {"color": style.INK, "lw": 0.8, "ls": (0, (4, 1.5))}
_END: dict[str, Any] = {"color": style.INK, "marker": "s", "ms": 3.5, "ls": "none"}
_TIME: dict[str, Any] = {"marker": "o", "mec": style.INK, "mew": 0.5, "ms": 2.6, "ls": "none"}

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Panel:
    """What a panel shows: tracks in cm from the start, shape (m, 2), at times in cycles."""

    name: str
    design: Design
    cycle: Array
    simulated: Array
    real: tuple[RealTrack, ...] = ()
    compared: tuple[Compared, ...] = ()

    @property
    def points(self) -> Array:
        """All points of all tracks, cm, shape (n, 2)."""
        points: Array = np.concatenate([self.simulated, *(track.position for track in self.real)])
        return points

    @property
    def middle(self) -> Array:
        """The middle of all tracks, cm."""
        middle: Array = (self.points.min(axis=0) + self.points.max(axis=0)) / 2
        return middle


def needed_half(points: Sequence[Array]) -> float:
    """Return half a panel's side, cm, that any of some tracks has room in."""
    reach = max(float(np.ptp(track, axis=0).max()) for track in points) / 2
    return max((1 + MARGIN) * reach, LEAST_HALF)


def draw(inputs: Inputs) -> Drawing:
    """Draw a panel per design, and compare with the real tracks.

    Raises
    ------
    ValueError
        Where real tracks are of too many designs.
    """
    designs = designs_of(inputs.tracks)
    simulated = dict(zip((d.index for d in designs), simulated_tracks(designs), strict=True))
    tables = {"tracks_simulated.csv": tracks_csv(simulated)}
    rows = [compare(track, simulated[track.design], PER_CYCLE) for track in inputs.tracks]
    lines = []
    if rows:
        tables["tracks_compared.csv"] = as_csv(rows)
        lines = as_lines(rows)
    panels = [
        Panel(
            name=_letters(i),
            design=design,
            cycle=np.arange(CYCLES * PER_CYCLE + 1) / PER_CYCLE,
            simulated=simulated[design.index],
            real=tuple(track for track in inputs.tracks if track.design == design.index),
            compared=tuple(row for row in rows if row.design == design.index),
        )
        for i, design in enumerate(designs)
    ]
    half = needed_half(list(simulated.values()))
    figures = {
        f"tracks_{1 + first // PER_PAGE}" if first else "tracks": draw_page(
            panels[first : first + PER_PAGE], half
        )
        for first in range(0, len(panels), PER_PAGE)
    }
    return Drawing(figures, tables, lines)


def _letters(i: int) -> str:
    """Return a, b, ... z, aa, ab, ... from 0 on."""
    before = _letters(i // 26 - 1) if i >= 26 else ""
    return before + "abcdefghijklmnopqrstuvwxyz"[i % 26]


def designs_of(real: Sequence[RealTrack]) -> list[Design]:
    """Return the designs to show: the best of nine bodies, then others with real tracks.

    Raises
    ------
    ValueError
        Where these are too many.
    """
    best = best_of_bodies()
    more = [d for d in dict.fromkeys(Design(track.design) for track in real) if d not in best]
    if len(more) > MOST_MORE:
        raise ValueError(
            f"real tracks are of {len(more)} designs besides the {len(best)} that are shown, and "
            f"at most {MOST_MORE} have room; leave some out, or draw them one after the other"
        )
    return [*best, *more]


def simulated_tracks(designs: Sequence[Design]) -> Array:
    """Return where the centres of mass are, cm from the start, shape (n, 23 * 50 + 1, 2)."""
    physics = Physics.published()
    result = simulate(designs, physics.lasting(CYCLES), track=PER_CYCLE)
    assert result.track is not None
    return np.asarray(result.track[..., :2] * physics.edge * 100)


def tracks_csv(simulated: dict[int, Array]) -> bytes:
    """Return simulated tracks in the format of the real ones; see `softvox_view.tracks_csv`."""
    lines = [",".join(COLUMNS)]
    for design, track in simulated.items():
        for sample, (x, y) in enumerate(track):
            lines.append(f"{design},simulated,{sample / PER_CYCLE:g},{x:.6f},{y:.6f}")
    return ("\n".join(lines) + "\n").encode()


def draw_page(panels: Sequence[Panel], half: float) -> Figure:
    """Draw a page; a panel that needs more than half a side, cm, has a scale of its own."""
    rows = -(-len(panels) // ACROSS)
    is_compared = any(panel.real for panel in panels)
    height = rows * ROW + FOOT + (LEGEND if is_compared else 0)
    made = style.figure(style.WIDTH, height, layout="compressed")
    axes = list(made.subplots(rows, ACROSS, squeeze=False).flat)
    for axis in axes[len(panels) :]:
        axis.remove()
    halves = [max(half, needed_half([panel.points])) for panel in panels]
    corners = []
    for axis, panel, own in zip(axes, panels, halves, strict=False):
        line = _tracks(axis, panel)
        _frame(axis, panel, own)
        corners.append(_inset(axis, panel, own))
    made.supxlabel("x, cm")
    made.supylabel("y, cm")
    bar = made.colorbar(line, ax=axes[: len(panels)], pad=0.02, aspect=40, shrink=0.8)
    bar.set_label("time, cycles of actuation")
    if is_compared:
        _legend(made)
    style.lay_out(made)  # where the words go depends on how large the panels are
    for axis, panel, own, corner in zip(axes, panels, halves, corners, strict=False):
        _words(axis, panel, corner, has_own_scale=own > half)
    return made


def _tracks(axis: Axes, panel: Panel) -> LineCollection:
    ours = panel.simulated
    colours = style.on_white(style.TIME)
    segments = np.stack([ours[:-1], ours[1:]], axis=1)
    line = LineCollection(list(segments), cmap=colours, array=panel.cycle[:-1], lw=1.6)
    line.set_clim(0, panel.cycle[-1])
    axis.add_collection(line)
    for track in panel.real:
        axis.plot(*track.position.T, **_REAL)
        axis.plot(*track.position[-1], zorder=3, **_END)
    if panel.real:
        tracks = [(panel.cycle, ours), *((track.cycle, track.position) for track in panel.real)]
        for cycle, position in tracks:
            times = np.arange(MARKED, cycle[-1], MARKED, dtype=float)
            for time, point in zip(times, track_at(times, cycle, position), strict=True):
                axis.plot(*point, mfc=colours(time / panel.cycle[-1]), zorder=3.5, **_TIME)
    axis.plot(0, 0, "o", mfc="white", mec=style.INK, mew=0.8, ms=4, zorder=4)
    axis.plot(*ours[-1], "D", mfc=colours(1.0), mec=style.INK, mew=0.8, ms=4, zorder=4)
    return line


def _frame(axis: Axes, panel: Panel, half: float) -> None:
    x, y = panel.middle
    axis.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
    axis.grid(color="#E6E6E6", lw=0.5)
    axis.set_axisbelow(True)
    axis.locator_params(nbins=5)
    axis.set_title(f"{panel.name}\N{PRIME}  {panel.design.index}", loc="left")
    if panel.compared:
        axis.set_title(errors(panel.compared), loc="right", size=style.SMALL)


def errors(compared: Sequence[Compared]) -> str:
    """Return the means over the trials of a design, the angle over those that have one."""
    angles = [row.angle for row in compared if not np.isnan(row.angle)]
    angle = f"{np.mean(angles):.0f}\N{DEGREE SIGN}, " if angles else ""
    return f"{angle}RMS {np.mean([row.rms_error for row in compared]):.2f} cm"


def _inset(axis: Axes, panel: Panel, half: float) -> Array:
    """Put the robot's picture into the corner that the tracks keep clear of most; return its box.

    That is left, bottom, right, top, shares of the panel's sides.
    """
    shown = _shares(panel, half)
    corners = [np.array([x, y]) for y in (1 - INSET, 0) for x in (1 - INSET, 0)]

    def covered(corner: Array) -> int:
        is_inside = (shown >= corner - 0.025) & (shown <= corner + INSET + 0.025)
        return int(is_inside.all(axis=1).sum())

    corner = min(corners, key=covered)
    box = axis.inset_axes((*corner, INSET, INSET), zorder=1)
    box.imshow(picture(panel.design, PIXELS))
    box.set_axis_off()
    return np.concatenate([corner, corner + INSET])


def _shares(panel: Panel, half: float) -> Array:
    """Return the points of all tracks as shares of the panel's sides, shape (n, 2).

    As many of each track, however often it was looked at.
    """
    times = panel.cycle[:: max(len(panel.cycle) // 200, 1)]
    tracks = [track_at(times, panel.cycle, panel.simulated)]
    for track in panel.real:
        tracks.append(track_at(times[times <= track.cycle[-1]], track.cycle, track.position))
    return (np.concatenate(tracks) - panel.middle) / (2 * half) + 0.5


def _words(axis: Axes, panel: Panel, inset: Array, *, has_own_scale: bool) -> None:
    """Write the trials' names at the ends of their tracks, and that a scale is another."""
    half = float(np.ptp(axis.get_xlim())) / 2
    points = [np.zeros(2), panel.simulated[-1], *(track.position[-1] for track in panel.real)]
    places = (np.array(points) - panel.middle) / (2 * half) + 0.5
    words = [
        (short(track.trial), place) for track, place in zip(panel.real, places[2:], strict=True)
    ]
    if has_own_scale:
        words.insert(0, ("own scale", np.zeros(2)))
    clear = np.concatenate([[inset], np.hstack([places - MARK, places + MARK])])
    labels.put(axis, words, clear=clear, lines=_shares(panel, half))


def _legend(made: Figure) -> None:
    ours: dict[str, Any] = {"mfc": "none", "mec": style.INK, "ls": "none", "ms": 4}
    handles = [
        Line2D([], [], marker="o", label="start", **ours),
        Line2D([], [], marker="D", label="end, simulated", **ours),
        Line2D([], [], **_REAL, marker="s", ms=3.5, label="real, with its trial"),
        Line2D([], [], mfc="none", label=f"every {MARKED} cycles", **_TIME),
    ]
    made.legend(
        handles=handles,
        title="above each panel: angle between the displacements and RMS error, means over trials",
        title_fontsize=style.SMALL,
        loc="outside upper center",
        ncols=len(handles),
    )
