"""The gap between the simulator and realities: fitness, headings, tracks, and a map of turns."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from softvox_gym.landscapes import gap, landscape
from softvox_gym.landscapes.robustness import TOP, kendall_tau, ranked
from softvox_gym.real_tracks import LITTLE, between, heading
from softvox_gym.realities import Reality, realities, reality
from softvox_gym.simulation import Result, simulate
from softvox_search.report.style import COLOURS, grid
from softvox_view.figures import Drawing, Inputs, maps, style, tracks
from softvox_view.figures.robots import best_of_bodies

Array = NDArray[np.float64]

#: The default reality of tracks and map, which shows the paper's own finding.
CHOSEN = "area_friction"

#: Colours of the simulator and of a reality, of all designs and of the simulator's best hundred.
SIMULATED, REAL = COLOURS[0], COLOURS[4]
ALL, BEST = COLOURS[3], COLOURS[4]

#: The line where both worlds agree, and the area in which a heading has turned.
_ALIKE: dict[str, Any] = {"color": style.INK, "lw": 0.6, "zorder": 2.5}
_TURNED: dict[str, Any] = {"color": "#EDEDED", "lw": 0}

#: Degrees from the middle of the heading panels to their sides; samples of a track per cycle.
SIDE, PER_CYCLE = 190, 50

#: Inches per entry of a legend.
ENTRY = 1.75

_DOT: dict[str, Any] = {"ls": "none", "marker": "o", "mew": 0}
_LOOKS: list[dict[str, Any]] = [{"color": SIMULATED, "lw": 1.2}, {"color": REAL, "lw": 1.2}]
_END: dict[str, Any] = {"mec": style.INK, "mew": 0.7, "ms": 3.6, "ls": "none", "zorder": 4}


class Worlds:
    """A reality and its simulator, design by design."""

    def __init__(self, reality: Reality) -> None:
        tables = landscape(reality.nominal), reality.landscape()
        self.reality = reality
        #: Fitness in both, voxel widths, and headings, degrees from +x towards +y, (2, 6561).
        self.worth = np.stack([gap.value(table) for table in tables])
        self.headings = np.degrees([np.arctan2(table["dy"], table["dx"]) for table in tables])
        #: Designs that travel far enough in both; and the share of these whose heading turns round.
        self.has_heading = np.all(self.worth > LITTLE, axis=0)
        self.turned = gap.share(gap.turned(*tables), self.has_heading)
        #: The simulator's best hundred, best first.
        self.best = ranked(self.worth[0])[:TOP]


def draw_gap(inputs: Inputs) -> Figure:
    """Draw the fitness of every design in reality against that in its simulator."""
    shown = _all(inputs)
    made, axes = grid(len(shown), height=1.2, is_shared=False)
    for axis, one in zip(axes, shown, strict=True):
        axis.axline((0, 0), slope=1, **_ALIKE)
        _dots(axis, one.worth, one)
        ends = np.maximum(one.worth.max(axis=1), LITTLE)
        axis.set(xlim=(-0.04 * ends[0], 1.06 * ends[0]), ylim=(-0.04 * ends[1], 1.06 * ends[1]))
        axis.locator_params(nbins=5, steps=(1, 2, 5, 10))
        _titles(axis, one, f"\N{GREEK SMALL LETTER TAU} = {kendall_tau(*one.worth):.2f}")
    made.supxlabel("fitness in the simulator, voxel widths")
    made.supylabel("fitness in reality, voxel widths")
    _legend(made, "every design")
    return made


def draw_gap_headings(inputs: Inputs) -> Figure:
    """Draw the heading in reality against that in its simulator, for designs that have both."""
    shown = _all(inputs)
    made, axes = grid(len(shown), height=1.4)
    ends = np.array([-SIDE, SIDE])
    for axis, one in zip(axes, shown, strict=True):
        for off in (-180, 180):
            axis.fill_between(ends, ends + off - 90, ends + off + 90, **_TURNED)
        axis.plot(ends, ends, **_ALIKE)
        axis.set_box_aspect(1)
        _dots(axis, np.where(one.has_heading, one.headings, np.nan), one)
        _titles(axis, one, f"{one.turned:.0%} turned")
    ticks = np.arange(-180, 181, 90)
    axes[0].set(xlim=ends, ylim=ends, xticks=ticks, yticks=ticks)
    made.supxlabel("heading in the simulator, degrees from +x towards +y")
    made.supylabel("heading in reality, degrees")
    turned = Patch(**_TURNED, label="turned by more than 90\N{DEGREE SIGN}")
    _legend(made, "every design that travels", turned)
    return made


def draw_gap_tracks(inputs: Inputs) -> Drawing:
    """Draw the tracks of the best of nine bodies in both worlds, a figure per reality."""
    chosen = inputs.realities or (reality(CHOSEN),)
    return Drawing({f"gap_tracks_{one.name}": _tracks(one) for one in chosen})


def draw_gap_map(inputs: Inputs) -> Drawing:
    """Draw a map of the cosine between the headings in both worlds, one per reality."""
    chosen = inputs.realities or (reality(CHOSEN),)
    return Drawing({f"gap_map_{one.name}": _map(Worlds(one)) for one in chosen})


def _all(inputs: Inputs) -> list[Worlds]:
    return [Worlds(one) for one in inputs.realities or realities().values()]


def _dots(axis: Axes, values: Array, one: Worlds) -> None:
    """Draw a dot per design, from values in both worlds, shape (2, 6561)."""
    axis.plot(*values, color=ALL, ms=1.3, rasterized=True, **_DOT)
    axis.plot(*values[:, one.best], color=BEST, ms=2.2, rasterized=True, zorder=3, **_DOT)


def _titles(axis: Axes, one: Worlds, text: str) -> None:
    axis.set_title(one.reality.name, loc="left")
    axis.set_title(text, loc="right", size=style.SMALL)


def _legend(made: Figure, name: str, *more: Any) -> None:
    handles = [
        style.line(name, color=ALL, ms=3, **_DOT),
        style.line(f"the simulator's best {TOP}", color=BEST, ms=3, **_DOT),
        style.line("the same in both", **_ALIKE),
        *more,
    ]
    columns = min(len(handles), int(made.get_figwidth() // ENTRY))
    made.legend(handles=handles, loc="outside upper center", ncols=columns)


def _tracks(one: Reality) -> Figure:
    """Draw a panel per design, with its tracks in both worlds."""
    designs = best_of_bodies()
    worlds = (
        simulate(designs, one.nominal, track=PER_CYCLE),
        one.simulate(designs, track=PER_CYCLE),
    )
    rows = -(-len(designs) // tracks.ACROSS)
    height = rows * tracks.ROW + tracks.FOOT + tracks.LEGEND
    made = style.figure(style.WIDTH, height, layout="compressed")
    axes = made.subplots(rows, tracks.ACROSS).flat
    walks = [[walk(world, i) for world in worlds] for i in range(len(designs))]
    half = max(tracks.half_side(np.concatenate(both)) for both in walks)
    for axis, design, both, name in zip(axes, designs, walks, tracks.NAMES, strict=False):
        for points, looks in zip(both, _LOOKS, strict=True):
            axis.plot(*points.T, **looks)
            axis.plot(*points[-1], "D", mfc=looks["color"], **_END)
        axis.plot(0, 0, "o", mfc="white", **_END)
        points = np.concatenate(both)
        x, y = tracks.middle(points)
        axis.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
        axis.grid(color="#E6E6E6", lw=0.5)
        axis.set_axisbelow(True)
        axis.locator_params(nbins=7, steps=(1, 2, 5, 10))
        tracks.put_picture(axis, design, (points - (x, y)) / (2 * half) + 0.5)
        angle = between(*(heading(points[-1]) for points in both))
        axis.set_title(f"{name}  {design.index}", loc="left")
        shown = "no heading" if np.isnan(angle) else f"{angle:.0f}\N{DEGREE SIGN}"
        axis.set_title(shown, loc="right", size=style.SMALL)
    made.supxlabel("x, voxel widths")
    made.supylabel("y, voxel widths")
    names = (
        f"simulator, {one.nominal.cycles:g} cycles",
        f"{one.name}, {one.physics.cycles:g} cycles",
    )
    handles = [style.line(name, **looks) for name, looks in zip(names, _LOOKS, strict=True)]
    handles += [style.line("start", marker="o", mfc="white", **_END)]
    handles += [style.line("end", marker="D", mfc="white", **_END)]
    title = "right above each panel: the angle between the two displacements"
    made.legend(
        handles=handles,
        title=title,
        title_fontsize=style.SMALL,
        loc="outside upper center",
        ncols=len(handles),
    )
    return made


def walk(world: Result, design: int) -> Array:
    """Return the track of a design of a result, shape (m, 2); only its start if it diverged."""
    assert world.track is not None
    points = world.track[design, :, :2]
    return np.asarray(points[: max(1, np.isfinite(points).all(axis=1).sum())])


def _map(one: Worlds) -> Figure:
    """Draw the map, and mark the best designs of both worlds."""
    made = style.figure(0.8 * style.WIDTH, 0.74 * style.WIDTH)
    axis = made.subplots()
    colours = style.on_white(style.SEQUENTIAL)
    cosine = np.cos(np.radians(one.headings[1] - one.headings[0]))
    cosine[~one.has_heading] = np.nan
    image = maps.show(axis, cosine, lines=style.PALE, cmap=colours, vmin=-1, vmax=1)
    count = one.has_heading.sum()
    axis.set_title(f"{one.reality.name}: {one.turned:.0%} of {count} designs turned", loc="left")
    bar = made.colorbar(image, ax=axis, pad=0.02)
    still = f"white: less than {LITTLE:g} voxel widths in either"
    bar.set_label(f"cosine between the headings in both worlds; {still}")
    first, other = one.worth.argmax(axis=1)
    handles = [
        maps.outline(axis, first, marker="o", ms=5, label=f"{first}, best in the simulator"),
        maps.outline(axis, other, marker="s", ms=7, label=f"{other}, best in {one.reality.name}"),
    ]
    made.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return made
