"""Tracks of the best of nine bodies (Fig. 7'), and of real robots over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from string import ascii_lowercase
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from softvox_gym.design import Design, called
from softvox_gym.landscapes import landscape
from softvox_gym.physics import Physics
from softvox_gym.real_tracks import (
    COLUMNS,
    Compared,
    RealTrack,
    as_csv,
    as_lines,
    compare,
    short,
    track_at,
)
from softvox_gym.simulation import Result, simulate
from softvox_view.figures import Drawing, Inputs, labels, style
from softvox_view.figures.robots import best_of_bodies, picture

CYCLES, PER_CYCLE = 23, 50

#: Cycles of the published run, after which fitness is taken.
PUBLISHED = 15

#: The cycle of every sample of a simulated track.
CYCLE = np.arange(CYCLES * PER_CYCLE + 1) / PER_CYCLE

#: Steps between frames, one less than a cycle; and the degrees by which the body's vertical turns
#: within a cycle in which the robot tips over. In robots that walk on it turns by less than 3.
STEPS, TIPPED = 551, 10

#: Panels in a row and on a page; further panels go to further pages.
ACROSS, PER_PAGE = 3, 12

#: The most designs of real tracks, besides the nine, that have panels of their own.
MOST_MORE = 99

#: Names of panels: a, b, ... z, aa, ab, ...
NAMES = [*ascii_lowercase, *map("".join, product(ascii_lowercase, repeat=2))]

#: Inches: a row of panels, the space below all rows, and the legend above.
ROW, FOOT, LEGEND = 2.24, 0.1, 0.38

#: Explanations of the titles of panels.
FITNESS_ABOVE = f"above each panel: design, fitness in voxel widths after {PUBLISHED} cycles"
ERRORS_ABOVE = "at the right: angle between the displacements, RMS error, means over trials"

#: Share of a panel's half side that the tracks leave free at the sides.
MARGIN = 0.12

#: The finest scale, cm, however little the robots travel.
LEAST_HALF = 0.5

#: The most pieces of one colour in a track, as vector pictures of many tracks would be large.
SEGMENTS = 240

#: Cycles between the time marks on compared tracks.
MARKED = 5

#: Share of a panel's side that the robot's picture takes, and its pixels.
INSET, PIXELS = 0.30, 210

#: Half the size of a mark at an end, as a share of a panel's side.
MARK = 0.022

_REAL: dict[str, Any] = {"color": style.INK, "lw": 0.8, "ls": (0, (4, 1.5))}
_TIME: dict[str, Any] = {"marker": "o", "mec": style.INK, "mew": 0.5, "ms": 2.6, "ls": "none"}
_END: dict[str, Any] = {"mec": style.INK, "mew": 0.8, "ms": 4, "ls": "none"}
_FITNESS: dict[str, Any] = {"marker": "o", "color": style.INK, "ms": 2.4, "ls": "none"}
_TIPPED: dict[str, Any] = {"marker": "X", "mfc": "white", **_END, "ms": 5}

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Panel:
    """The content of a panel: tracks from the start, shape (m, 2), in the unit.

    Fitness is text; tipped is the cycle in which the simulated robot tips over, or 0.
    """

    name: str
    design: Design
    fitness: str
    tipped: int
    simulated: Array
    real: list[RealTrack]
    compared: list[Compared]
    unit: str = "cm"

    @property
    def cycle(self) -> Array:
        """The cycle of every sample of the simulated track, shape (m,)."""
        return np.arange(len(self.simulated)) / PER_CYCLE

    @property
    def points(self) -> Array:
        """All points of all tracks, shape (n, 2)."""
        points: Array = np.concatenate([self.simulated, *(track.position for track in self.real)])
        return points

    @property
    def tip(self) -> Array:
        """Where the robot tips over: in the middle of that cycle, shape (2,)."""
        return np.asarray(self.simulated[round((self.tipped - 0.5) * PER_CYCLE)])

    def shares(self, points: Any, half: float) -> Array:
        """Return points as shares of the panel's sides."""
        return np.asarray((points - middle(self.points)) / (2 * half) + 0.5)


def draw_tracks(inputs: Inputs) -> Drawing:
    """Draw a panel per design, and compare with the real tracks.

    Raises
    ------
    ValueError
        If real tracks are of too many designs.
    """
    designs = designs_of(inputs.tracks)
    numbers = [design.index for design in designs]
    walked, tipped = simulated_tracks(designs)
    simulated = dict(zip(numbers, walked, strict=True))
    lines = [",".join(COLUMNS)]
    for number, track in simulated.items():
        for cycle, (x, y) in zip(CYCLE, track, strict=True):
            lines.append(f"{number},simulated,{cycle:g},{x:.6f},{y:.6f}")
    tables = {"tracks_simulated.csv": ("\n".join(lines) + "\n").encode()}
    rows = [compare(track, simulated[track.design], PER_CYCLE) for track in inputs.tracks]
    if rows:
        tables["tracks_compared.csv"] = as_csv(rows)
    more = {"fitness": landscape()["fitness"], "tipped": dict(zip(numbers, tipped, strict=True))}
    pages = draw_pages("tracks", designs, simulated, inputs.tracks, rows, **more)
    return Drawing(pages, tables, as_lines(rows) if rows else [])


def draw_pages(
    name: str,
    designs: Sequence[Design],
    simulated: Mapping[int, Array],
    real: Sequence[RealTrack],
    rows: Sequence[Compared],
    *,
    fitness: Array | None = None,
    tipped: Mapping[int, int] | None = None,
) -> dict[str, Figure]:
    """Draw a panel per design: its tracks, simulated and real, and the text of `rows` on these.

    Fitness of every design and the cycles in which robots tip over are shown if given. Returns the
    pages by file name. They share one scale, which the simulated tracks set.
    """
    panels = [
        Panel(
            letter,
            design,
            "" if fitness is None else f": {fitness[design.index]:.2f}",
            (tipped or {}).get(design.index, 0),
            simulated[design.index],
            [track for track in real if track.design == design.index],
            [row for row in rows if row.design == design.index],
        )
        for letter, design in zip(NAMES, designs, strict=False)
    ]
    return paged(name, panels)


def paged(name: str, panels: Sequence[Panel], *, half: float = 0.0) -> dict[str, Figure]:
    """Draw panels; return the pages by file name. They share a scale, of at least half a side."""
    half = max(half, *(half_side(panel.simulated) for panel in panels))
    return {
        f"{name}_{1 + first // PER_PAGE}" if first else name: draw_page(
            panels[first : first + PER_PAGE], half
        )
        for first in range(0, len(panels), PER_PAGE)
    }


def middle(points: Array) -> Array:
    """Return the middle of the smallest box around points (n, 2)."""
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


def half_side(points: Array) -> float:
    """Return half the side of a square that has room for points (n, 2)."""
    return max((1 + MARGIN) * float(np.ptp(points, axis=0).max()) / 2, LEAST_HALF)


def designs_of(real: Sequence[RealTrack]) -> list[Design]:
    """Return the designs to show: the best of nine bodies, then others with real tracks.

    Raises
    ------
    ValueError
        If there are too many.
    """
    best = best_of_bodies()
    more = [d for d in dict.fromkeys(Design(track.design) for track in real) if d not in best]
    if len(more) > MOST_MORE:
        raise ValueError(
            f"real tracks are of {len(more)} designs besides the {len(best)} that are shown, and "
            f"at most {MOST_MORE} have room; leave some out, or draw them one after the other"
        )
    return [*best, *more]


def simulated_tracks(designs: Sequence[Design]) -> tuple[Array, list[int]]:
    """Return the tracks of the centres of mass, cm from the start, shape (n, 23 * 50 + 1, 2).

    Also return the cycle, from 1, in which each robot tips over, 0 if it does not.
    """
    physics = Physics.published()
    result = simulate(designs, physics.lasting(CYCLES), track=PER_CYCLE, frames=STEPS)
    assert result.track is not None
    return np.asarray(result.track[..., :2] * physics.edge * 100), tipping_cycles(result)


def tipping_cycles(result: Result) -> list[int]:
    """Return the cycle in which the body's vertical turns most; 0 if that is below `TIPPED`."""
    assert result.frames is not None
    w, x, y, z = np.moveaxis(result.frames.quaternion, -1, 0)
    vertical = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)], axis=-1)
    mean = np.nanmean(vertical, axis=(2, 3, 4))[:, 1:]  # the first frame is before settling
    mean /= np.linalg.norm(mean, axis=-1, keepdims=True)
    turned = np.degrees(np.arccos(np.clip((mean[:, 1:] * mean[:, :-1]).sum(axis=-1), -1, 1)))
    return [int(row.argmax()) + 1 if row.max() > TIPPED else 0 for row in turned]


def draw_page(panels: Sequence[Panel], half: float) -> Figure:
    """Draw a page; a panel that needs more than half a side has its own scale."""
    across = min(ACROSS, len(panels))
    rows = -(-len(panels) // across)
    is_compared = any(panel.real for panel in panels)
    height = rows * ROW + FOOT + (2 if is_compared else 1) * LEGEND
    made = style.figure(style.WIDTH, height, layout="compressed")
    axes = list(made.subplots(rows, across, squeeze=False).flat)
    for axis in axes[len(panels) :]:
        axis.remove()
    cycles = max(panel.cycle[-1] for panel in panels)
    words = []
    for axis, panel in zip(axes, panels, strict=False):
        own = max(half, half_side(panel.points))
        line = _tracks(axis, panel, cycles)
        words.append(_frame(axis, panel, own, has_own_scale=own > half))
    made.supxlabel(f"x, {panels[0].unit}")
    ylabel = made.supylabel if across == ACROSS else axes[0].set_ylabel
    ylabel(f"y, {panels[0].unit}")
    bar = made.colorbar(line, ax=axes[: len(panels)], pad=0.02, aspect=40, shrink=0.8)
    bar.set_label("time, cycles of actuation")
    title = [FITNESS_ABOVE] if panels[0].fitness else []
    title += [ERRORS_ABOVE] if is_compared else []
    looks: dict[str, Any] = {"title_fontsize": style.SMALL, "loc": "outside upper center"}
    columns = 3 if is_compared else 4
    made.legend(title="\n".join(title), handles=_handles(panels), ncols=columns, **looks)
    style.lay_out(made)  # the size of the panels decides where the words go
    for axis, own_words in zip(axes, words, strict=False):
        labels.put(axis, **own_words)
    return made


def _handles(panels: Sequence[Panel]) -> list[Line2D]:
    """Return the legend's entries for the content of the panels."""
    handles = [style.line("start", marker="o", mfc="none", **_END)]
    handles.append(style.line("end, simulated", marker="D", mfc="none", **_END))
    if panels[0].fitness:
        handles.append(style.line(f"after {PUBLISHED} cycles", **_FITNESS))
    if any(panel.tipped for panel in panels):
        handles.append(style.line("falls on another side", **_TIPPED))
    if any(panel.real for panel in panels):
        handles.append(style.line("real, with its trial", marker="s", ms=3.5, **_REAL))
        if max(panel.cycle[-1] for panel in panels) > MARKED:
            handles.append(style.line(f"every {MARKED} cycles", mfc="none", **_TIME))
    return handles


def _tracks(axis: Axes, panel: Panel, cycles: float) -> LineCollection:
    """Draw the tracks, coloured by time, in so many cycles."""
    ours = panel.simulated
    colours = style.on_white(style.TIME)
    starts = np.arange(0, len(ours) - 1, -(-len(ours) // SEGMENTS))
    segments = np.split(ours, starts[1:] + 1)
    segments[1:] = [np.vstack([ours[i], s]) for i, s in zip(starts[1:], segments[1:], strict=True)]
    line = LineCollection(segments, cmap=colours, array=panel.cycle[starts], lw=1.6)
    line.set_clim(0, cycles)
    axis.add_collection(line)
    for track in panel.real:
        axis.plot(*track.position.T, **_REAL)
        axis.plot(*track.position[-1], "s", color=style.INK, ms=3.5, zorder=3)
    if panel.real:
        tracks = [(panel.cycle, ours), *((track.cycle, track.position) for track in panel.real)]
        for cycle, position in tracks:
            times = np.arange(MARKED, cycle[-1], MARKED, dtype=float)
            for time, point in zip(times, track_at(times, cycle, position), strict=True):
                axis.plot(*point, mfc=colours(time / cycles), zorder=3.5, **_TIME)
    axis.plot(0, 0, "o", mfc="white", zorder=4, **_END)
    axis.plot(*ours[-1], "D", mfc=colours(1.0), zorder=4, **_END)
    if panel.fitness:
        axis.plot(*ours[round(PUBLISHED * PER_CYCLE)], zorder=4, **_FITNESS)
    if panel.tipped:
        axis.plot(*panel.tip, zorder=4, **_TIPPED)
    return line


def _frame(axis: Axes, panel: Panel, half: float, *, has_own_scale: bool) -> dict[str, Any]:
    """Draw the frame of a panel, and return the words to be placed among the tracks.

    These are the trials' names at their ends, when a robot tips over, and a differing scale.
    """
    x, y = middle(panel.points)
    axis.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
    axis.grid(color="#E6E6E6", lw=0.5)
    axis.set_axisbelow(True)
    axis.locator_params(nbins=5)
    axis.set_title(f"{panel.name}  {short(str(called(panel.design)))}{panel.fitness}", loc="left")
    if panel.compared:
        axis.set_title(errors(panel.compared), loc="right", size=style.SMALL)
    # The same number of points from each track, however often it was sampled.
    times = panel.cycle[:: len(panel.cycle) // 200 or 1]
    tracks = [track_at(times, panel.cycle, panel.simulated)]
    for track in panel.real:
        tracks.append(track_at(times[times <= track.cycle[-1]], track.cycle, track.position))
    lines = panel.shares(np.concatenate(tracks), half)

    picture_box = put_picture(axis, panel.design, lines)
    ends = [track.position[-1] for track in panel.real]
    places = panel.shares([np.zeros(2), panel.simulated[-1], *ends], half)
    words = [("own scale", np.zeros(2))] if has_own_scale else []
    words += zip((short(track.trial) for track in panel.real), places[2:], strict=True)
    if panel.tipped:
        words.append((f"falls in cycle {panel.tipped}", panel.shares(panel.tip, half)))
        places = np.vstack([places, words[-1][1]])
    return {
        "words": words,
        "clear": np.vstack([picture_box, np.hstack([places - MARK, places + MARK])]),
        "lines": lines,
    }


def put_picture(axis: Axes, design: Design, lines: Array) -> Array:
    """Put a robot's picture into the corner with the fewest lines, and return its box.

    Lines, points (m, 2), and the box, left, bottom, right and top, are shares of the panel's sides.
    """
    corners = [np.array([x, y]) for y in (1 - INSET, 0) for x in (1 - INSET, 0)]
    inside = [(lines >= c - 0.025) & (lines <= c + INSET + 0.025) for c in corners]
    corner = corners[int(np.argmin([found.all(axis=1).sum() for found in inside]))]
    inset = axis.inset_axes((*corner, INSET, INSET), zorder=1)
    inset.imshow(picture(design, PIXELS))
    inset.set_axis_off()
    return np.concatenate([corner, corner + INSET])


def errors(compared: Sequence[Compared]) -> str:
    """Return the mean errors over the trials of a design, the angle over those that have one."""
    angles = [row.angle for row in compared if not np.isnan(row.angle)]
    angle = f"{np.mean(angles):.0f}\N{DEGREE SIGN}, " if angles else ""
    return f"{angle}RMS {np.mean([row.rms_error for row in compared]):.2f}"
