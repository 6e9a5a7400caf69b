"""Maps of all designs: fitness, kinds and classes, heading; and the fitness left under noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps, patheffects
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

import softvox_gym
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.landscapes.robustness import TOP, ranked
from softvox_gym.real_tracks import LITTLE
from softvox_search.report.style import COLOURS as APART
from softvox_view.figures import Inputs, labels, style
from softvox_view.tessellation import SIDE, cell_of, mapped

Array = NDArray[np.float64]

#: Widths of the lines between squares, points, by the squares' side in cells.
LINES = {27: 0.9, 9: 0.35}

#: Kinds of robots, from dark to light, to be distinct without colour.
KINDS = ("no voxels", "in pieces, none active", "in pieces", "one piece, none active", "one piece")
COLOURS = ("#000000", "#5B2A6E", "#C0563B", "#6FA8DC", "#F7E7A9")

#: The colour of a design that stands still, and the factor that keeps all others darker than it.
STILL, DIMMED = "white", 0.86

#: Cells along a side of the squares with an arrow for their mean, and the arrow's length, inches
#: per voxel width: the longest fits its square.
SQUARE, INCHES = 9, 0.28

#: The number of best designs labelled on the map of fitness, and the radius that their rings take,
#: a share of the map's side.
NAMED, AROUND = 10, 0.016

#: The level of noise; and the least fitness, voxel widths, with a share kept: for slower robots it
#: means little, since many of them walk faster under noise.
LEVEL, FAST = 1.0, 1.0


def show(axis: Axes, values: Any, *, lines: str = "white", **options: Any) -> AxesImage:
    """Draw a map of a value or colour per design, shape (6561,) or (6561, 3); see `Axes.imshow`."""
    image = axis.imshow(mapped(values), origin="lower", interpolation="nearest", **options)
    frame(axis, color=lines)
    return image


def frame(axis: Axes, *, color: str, widths: Mapping[int, float] = LINES) -> None:
    """Draw the lines between nested squares, and the digits along the sides."""
    for side, width in widths.items():
        for edge in np.arange(side, SIDE, side) - 0.5:
            axis.axhline(edge, color=color, lw=width)
            axis.axvline(edge, color=color, lw=width)
    axis.set(xlim=(-0.5, SIDE - 0.5), ylim=(-0.5, SIDE - 0.5), aspect="equal")
    digits(axis, np.arange(3) * 27 + 13)
    axis.set_xlabel("$d_0$; within it $d_2$, then $d_4$, then $d_6$")
    axis.set_ylabel("$d_1$; within it $d_3$, then $d_5$, then $d_7$")


def digits(axis: Axes, middles: Any) -> None:
    """Write the digits 0, 1, 2 along both sides."""
    axis.set_xticks(middles, ["0", "1", "2"])
    axis.set_yticks(middles, ["0", "1", "2"])
    axis.tick_params(length=0)


def mark(
    axis: Axes,
    design: int,
    text: str,
    *,
    offset: tuple[float, float] = (6, 6),
    ring: float = 6.0,
) -> None:
    """Put a ring around a design and a word at an offset, points, legible on any colour."""
    outline(axis, design, marker="o", ms=ring)
    row, column = (int(place) for place in cell_of(design))
    axis.annotate(
        text,
        (column, row),
        xytext=offset,
        textcoords="offset points",
        size=style.SMALL,
        color=style.INK,
        bbox=style.PAPER,
        ha="left" if offset[0] >= 0 else "right",
        va="bottom" if offset[1] >= 0 else "top",
        zorder=5,
    )


def outline(axis: Axes, design: int, **options: Any) -> Line2D:
    """Put an empty marker, visible on any colour, around a design; see `Axes.plot`."""
    row, column = (int(place) for place in cell_of(design))
    white = [patheffects.withStroke(linewidth=2.2, foreground="white")]
    looks: dict[str, Any] = {"mfc": "none", "mec": style.INK, "mew": 0.9, "path_effects": white}
    options = {"ls": "none", "clip_on": False, "zorder": 5, **looks, **options}
    return axis.plot(column, row, **options)[0]


def draw_heatmap(inputs: Inputs) -> Figure:
    """Draw the fitness of every design (Fig. 4), by rank or by value: lighter is fitter."""
    fitness = softvox_gym.landscape()["fitness"]
    made = style.figure(0.84 * style.WIDTH, 0.7 * style.WIDTH)
    axis = made.subplots()
    if inputs.scale == "fitness":
        image = show(axis, fitness, cmap=style.SEQUENTIAL, vmin=0)
        made.colorbar(image, ax=axis, label="fitness, voxel widths", pad=0.02)
    else:
        places = ranks(fitness)
        image = show(axis, places, cmap=f"{style.SEQUENTIAL}_r")
        bar = made.colorbar(image, ax=axis, label="rank: fitness in voxel widths", pad=0.02)
        at = [1, *range(500, int(places.max()), 500)]
        worth = fitness[ranked(fitness)][np.array(at) - 1]
        bar.set_ticks(at, labels=[f"{n}: {value:.2f}" for n, value in zip(at, worth, strict=True)])
        bar.ax.invert_yaxis()
    style.lay_out(made)  # the size of the map decides where the words go
    name_best(axis, fitness)
    return made


def ranks(values: Array) -> NDArray[np.int64]:
    """Return the rank of every value, from 1, the largest; equal values share the better rank."""
    return 1 + np.searchsorted(np.sort(-values), -values)


def name_best(axis: Axes, values: Array) -> None:
    """Ring the best of all designs, and label them with rank, number and value.

    The figure must be laid out.
    """
    best = ranked(values)[:NAMED]
    for design in best:
        outline(axis, int(design), marker="o", ms=5)
    places = (np.stack(cell_of(best)[::-1], axis=1) + 0.5) / SIDE
    words = [f"{i}: {design}, {values[design]:.2f}" for i, design in enumerate(best, start=1)]
    clear = np.hstack([places - AROUND, places + AROUND])
    labels.put(axis, list(zip(words, places, strict=True)), clear=clear, lines=places, far=0)


def kinds() -> NDArray[np.int64]:
    """Return the kind of every design, an index into `KINDS`, shape (6561,)."""
    table = softvox_gym.landscape()
    is_active = table["n_active"] > 0
    kind = np.where(table["is_connected"], 3, 1) + is_active
    return np.where(table["n_voxels"] == 0, 0, kind)


def class_ranks() -> NDArray[np.int64]:
    """Return the rank of every design's symmetry class, shape (6561,).

    The 1035 classes are ranked from 1 by their fittest design, ties by their smallest number.
    """
    smallest, member_of = np.unique(symmetry_classes(), return_inverse=True)
    best = np.full(len(smallest), -np.inf)
    np.maximum.at(best, member_of, softvox_gym.landscape()["fitness"])
    rank = np.empty(len(smallest), dtype=np.int64)
    rank[np.lexsort((smallest, -best))] = 1 + np.arange(len(smallest))
    return rank[member_of]


def draw_classes(_: Inputs) -> Figure:
    """Draw the kind of every robot, and its symmetry class (turned or mirrored)."""
    made = style.figure(style.WIDTH, 0.62 * style.WIDTH)
    (left, right), (key, bar) = made.subplots(2, 2, height_ratios=(24, 1))
    edges = BoundaryNorm(np.arange(len(KINDS) + 1) - 0.5, len(KINDS))
    show(left, kinds(), cmap=ListedColormap(COLOURS), norm=edges)
    left.set_title("a  kind of robot", loc="left")
    counts = np.bincount(kinds(), minlength=len(KINDS))
    handles = [
        Patch(fc=colour, ec=style.INK, lw=0.4, label=f"{kind} ({count})")
        for kind, colour, count in zip(KINDS, COLOURS, counts, strict=True)
    ]
    key.set_axis_off()
    key.legend(handles=handles, loc="center", ncols=2)
    ranks = class_ranks()
    image = show(right, ranks, cmap=f"{style.SEQUENTIAL}_r")
    right.set_title("b  symmetry class", loc="left")
    scale = made.colorbar(image, cax=bar, orientation="horizontal")
    scale.set_label("rank of the class by its fittest design")
    scale.set_ticks([ranks.max(), 800, 600, 400, 200, 1])
    bar.invert_xaxis()  # the lightest to the right, as on the other maps
    return made


def colour_of(dx: Array, dy: Array) -> Array:
    """Return the colours (..., 3) of displacements; `STILL` for those below `LITTLE`."""
    turn = np.arctan2(dy, dx) / (2 * np.pi) % 1
    colours = DIMMED * colormaps[style.CYCLIC](turn)[..., :3]
    colours[np.hypot(dx, dy) < LITTLE] = to_rgb(STILL)
    return np.asarray(colours)


def mean_displacement(displacement: Array) -> Array:
    """Return the mean displacement (6561, 2) of every square of 9 x 9 designs, (9, 9, 2)."""
    squares = SIDE // SQUARE
    laid = mapped(displacement).reshape(squares, SQUARE, squares, SQUARE, 2)
    return np.asarray(laid.mean(axis=(1, 3)))


def draw_heading(_: Inputs) -> Figure:
    """Draw the direction of travel, an arrow over each square of 9 x 9 designs, and the keys."""
    table = softvox_gym.landscape()
    dx, dy = table["dx"], table["dy"]
    made = style.figure(0.84 * style.WIDTH, 0.68 * style.WIDTH)
    axis, side = made.subplots(1, 2, width_ratios=(5, 1))
    show(axis, colour_of(dx, dy), lines=style.GREY)
    mean = np.moveaxis(mean_displacement(np.stack([dx, dy], axis=1)), -1, 0)
    mean[:, np.hypot(*mean) < LITTLE] = np.nan
    middle = np.arange(SIDE // SQUARE) * SQUARE + (SQUARE - 1) / 2
    arrows = axis.quiver(
        *np.meshgrid(middle, middle), *mean,
        pivot="mid", units="inches", scale=1 / INCHES, scale_units="inches",
        width=0.011, headwidth=4.5, headlength=5, headaxislength=4.5,
        color=style.INK, zorder=4,
        path_effects=[patheffects.withStroke(linewidth=1.6, foreground="white")],
    )  # fmt: skip
    side.set_axis_off()
    # A ring of the colours, each in its direction as seen from above.
    wheel = side.inset_axes((0.15, 0.57, 0.7, 0.2), projection="polar")
    turn = np.linspace(0, 2 * np.pi, 181)
    middles = (turn[1:] + turn[:-1]) / 2
    colours = colour_of(np.cos(middles), np.sin(middles))[np.newaxis]
    wheel.pcolormesh(turn, [0.5, 1], colours, rasterized=True)
    wheel.set(rorigin=0, ylim=(0.5, 1), yticks=[])
    names = ["+x", "+y", "\N{MINUS SIGN}x", "\N{MINUS SIGN}y"]
    wheel.set_xticks(np.arange(4) * np.pi / 2, names)
    wheel.tick_params(pad=-2, grid_alpha=0)
    wheel.set_title("heading,\nseen from above", size=style.SMALL)
    axis.quiverkey(arrows, 0.908, 0.48, 1, "1 voxel width", coordinates="figure", labelpos="S")
    words: dict[str, Any] = {"ha": "center", "size": style.SMALL}
    squares = f"arrows: mean of\n{SQUARE} \N{MULTIPLICATION SIGN} {SQUARE} designs"
    side.text(0.5, 0.49, squares, va="bottom", **words)
    still = f"white, no arrow:\nless than\n{LITTLE:g} voxel widths"
    side.text(0.5, 0.38, still, va="top", **words)
    return made


def kept() -> Array:
    """Return the share of its fitness that a design keeps in nine draws of ten, shape (6561,).

    This is the 10 % quantile under noise over the fitness without; NaN if that is below `FAST`.
    """
    fitness = softvox_gym.landscape()["fitness"]
    share = np.full(len(fitness), np.nan)
    quantile = softvox_gym.noisy_landscape(LEVEL)["q10"]
    np.divide(quantile, fitness, out=share, where=fitness >= FAST)
    return share


def draw_robustness(_: Inputs) -> Figure:
    """Draw the mean under noise against the fitness, and the share kept in nine draws of ten."""
    fitness, mean = softvox_gym.landscape()["fitness"], softvox_gym.noisy_landscape(LEVEL)["mean"]
    made = style.figure(style.WIDTH, 0.62 * style.WIDTH)
    (left, right), (empty, bar) = made.subplots(2, 2, height_ratios=(24, 1))
    empty.set_axis_off()
    left.axline((0, 0), slope=1, color=style.INK, lw=0.6, zorder=2.5)
    best, robust = ranked(fitness)[:TOP], ranked(mean)[:TOP]
    dots: dict[str, Any] = {"marker": "o", "ls": "none", "rasterized": True}
    left.plot(fitness, mean, label="every design", color=APART[3], ms=1.3, mew=0, **dots)
    ring: dict[str, Any] = {"mfc": "none", "mec": style.INK, "ms": 4.2, "mew": 0.6}
    dot: dict[str, Any] = {"color": APART[4], "ms": 2.4, "mew": 0}
    for chosen, noise, look in ((best, "without", dot), (robust, "under", ring)):
        name = f"the best {TOP} {noise} noise"
        left.plot(fitness[chosen], mean[chosen], label=name, **look, **dots)
    left.legend(loc="upper left", markerscale=1.5)
    for design, offset in ((best[0], (0, 6)), (robust[0], (18, 5))):
        words, place = f"{design}: {mean[design]:.2f}", (fitness[design], mean[design])
        left.annotate(words, place, xytext=offset, textcoords="offset points", ha="center")
    side = 1.1 * fitness.max()
    left.set(xlim=(0, side), ylim=(0, side), aspect="equal")
    left.set_xlabel("fitness without noise, voxel widths")
    left.set_ylabel(f"mean fitness at noise level {LEVEL:g}, voxel widths")
    left.set_title("a  what noise leaves of the fitness", loc="left")
    colours = style.on_white(style.SEQUENTIAL)
    image = show(right, kept(), lines=style.PALE, cmap=colours, vmin=0, vmax=1)
    right.set_title("b  share of the fitness kept in nine draws of ten", loc="left")
    scale = made.colorbar(image, cax=bar, extend="max", orientation="horizontal")
    scale.set_label(f"10 % quantile / fitness; white: fitness below {FAST:g} voxel width")
    return made
