"""Tracks of the best of nine bodies (Fig. 7'), and of real robots over them."""

from __future__ import annotations

from collections.abc import Sequence
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
from softvox_view.comparison import as_csv, as_lines, compare
from softvox_view.figures import Inputs, Made, style
from softvox_view.figures.bodies import best_of_bodies
from softvox_view.figures.robots import picture
from softvox_view.tracks_csv import COLUMNS, RealTrack

CYCLES, PER_CYCLE = 23, 50

ACROSS = 3

#: Designs of real tracks that are none of the nine have panels of their own, up to so many.
MOST_MORE = 18

#: cm; a scale is no finer than this, however little the robots travel.
LEAST_HALF = 0.5

#: Share of a panel's side that the robot's picture takes, and its pixels.
INSET, PIXELS = 0.30, 210

Array = NDArray[np.float64]


def draw(inputs: Inputs) -> Made:
    """Draw a panel per design, and compare with the real tracks.

    Raises
    ------
    ValueError
        Where real tracks are of too many designs.
    """
    designs = designs_of(inputs.tracks)
    simulated = dict(zip((d.index for d in designs), simulated_tracks(designs), strict=True))
    real = [[track for track in inputs.tracks if track.design == d.index] for d in designs]
    tables = {"tracks_simulated.csv": tracks_csv(simulated)}
    lines = []
    if inputs.tracks:
        rows = [compare(track, simulated[track.design], PER_CYCLE) for track in inputs.tracks]
        tables["tracks_compared.csv"] = as_csv(rows)
        lines = as_lines(rows)
    made = _panels(designs, list(simulated.values()), real)
    return Made({"tracks": made}, tables, lines)


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
            f"at most {MOST_MORE} have room; leave some out, or spread them over several files"
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


def _panels(
    designs: Sequence[Design], simulated: Sequence[Array], real: Sequence[Sequence[RealTrack]]
) -> Figure:
    rows = -(-len(designs) // ACROSS)
    made = style.figure(style.WIDTH, rows * style.WIDTH / ACROSS + 0.55)
    axes = list(made.subplots(rows, ACROSS, squeeze=False).flat)
    for axis in axes[len(designs) :]:
        axis.remove()
    shown = [
        np.concatenate([ours, *(track.position for track in theirs)])
        for ours, theirs in zip(simulated, real, strict=True)
    ]
    reach = max(float(np.ptp(points, axis=0).max()) for points in shown) / 2
    half = max(1.12 * reach, LEAST_HALF)
    letters = "abcdefghijklmnopqrstuvwxyz\N{GREEK SMALL LETTER ALPHA}"
    for i, design in enumerate(designs):
        axis = axes[i]
        line = _panel(axis, simulated[i], real[i])
        middle = (shown[i].min(axis=0) + shown[i].max(axis=0)) / 2
        axis.set(
            xlim=(middle[0] - half, middle[0] + half),
            ylim=(middle[1] - half, middle[1] + half),
            aspect="equal",
        )
        axis.set_title(f"{letters[i]}\N{PRIME}  {design.index}", loc="left")
        _inset(axis, design, (shown[i] - middle) / half)
    made.supxlabel("x, cm", size=style.FONT)
    made.supylabel("y, cm", size=style.FONT)
    bar = made.colorbar(line, ax=axes[: len(designs)], pad=0.02, aspect=40, shrink=0.8)
    bar.set_label("time, cycles of actuation")
    if any(real):
        _legend(made)
    return made


def _panel(axis: Axes, ours: Array, theirs: Sequence[RealTrack]) -> LineCollection:
    segments = np.stack([ours[:-1], ours[1:]], axis=1)
    time = np.arange(len(segments)) / PER_CYCLE
    line = LineCollection(list(segments), cmap=style.on_white(style.TIME), array=time, lw=1.6)
    line.set_clim(0, CYCLES)
    axis.add_collection(line)
    for track in theirs:
        axis.plot(*track.position.T, color=style.INK, lw=0.9, ls=(0, (4, 1.5)))
        axis.plot(*track.position[-1], "s", color=style.INK, ms=3.5)
    axis.plot(0, 0, "o", mfc="white", mec=style.INK, mew=0.8, ms=4, zorder=4)
    axis.plot(*ours[-1], "D", mfc=line.cmap(1.0), mec=style.INK, mew=0.8, ms=4, zorder=4)
    axis.grid(color="#E6E6E6", lw=0.5)
    axis.set_axisbelow(True)
    axis.locator_params(nbins=5)
    return line


def _inset(axis: Axes, design: Design, shown: Array) -> None:
    """Put the robot's picture into the corner that the tracks, in -1 to 1, keep clear of most."""
    span = 2 * INSET
    corners = [(x, y) for y in (1 - span, -1) for x in (1 - span, -1)]

    def inside(corner: tuple[float, float]) -> int:
        low = np.array(corner)
        return int(np.all((shown >= low - 0.05) & (shown <= low + span + 0.05), axis=1).sum())

    x, y = min(corners, key=inside)
    box = axis.inset_axes(((x + 1) / 2, (y + 1) / 2, INSET, INSET), zorder=1)
    box.imshow(picture(design, PIXELS))
    box.set_axis_off()


def _legend(made: Figure) -> None:
    ours: dict[str, Any] = {"mfc": "none", "mec": style.INK, "ls": "none", "ms": 4}
    handles = [
        Line2D([], [], marker="o", label="start", **ours),
        Line2D([], [], marker="D", label="end, simulated", **ours),
        Line2D([], [], color=style.INK, ls=(0, (4, 1.5)), lw=0.9, marker="s", ms=3.5, label="real"),
    ]
    made.legend(handles=handles, loc="outside upper center", ncols=3)
