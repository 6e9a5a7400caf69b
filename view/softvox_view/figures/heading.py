"""The direction in which every design travels, as a map."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps, patheffects
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

import softvox_gym
from softvox_view.comparison import LITTLE
from softvox_view.figures import Inputs, maps, style
from softvox_view.tessellation import SIDE, mapped

#: Lighter than any colour of the wheel, dimmed, so that it stays apart without colour as well.
STILL, DIMMED = "white", 0.86

#: Of the wheel, in its radius: where the ring begins, and samples along a side.
HOLE, SAMPLES = 0.5, 600

#: Cells along a side of the squares whose mean is an arrow.
SQUARE = 9

#: Inches that an arrow is long per voxel width: the longest fits its square.
INCHES = 0.28

Array = NDArray[np.float64]


def draw(_: Inputs) -> Figure:
    """Draw the map, an arrow over each square of 9 x 9 designs, and the keys."""
    table = softvox_gym.landscape()
    dx, dy = table["dx"], table["dy"]
    made = style.figure(0.84 * style.WIDTH, 0.68 * style.WIDTH)
    axis, side = made.subplots(1, 2, width_ratios=(5, 1))
    maps.show(axis, colour_of(dx, dy), lines=style.GREY)
    mean = mean_displacement(np.stack([dx, dy], axis=1))
    mean[np.hypot(*np.moveaxis(mean, -1, 0)) < LITTLE] = np.nan
    middle = np.arange(len(mean)) * SQUARE + (SQUARE - 1) / 2
    x, y = np.meshgrid(middle, middle)
    _arrows(axis, x, y, mean[..., 0], mean[..., 1])
    _key(side)
    return made


def colour_of(dx: Array, dy: Array) -> Array:
    """Return the colours (..., 3) of displacements; `STILL` where they are less than `LITTLE`."""
    turn = np.arctan2(dy, dx) / (2 * np.pi) % 1
    colours = DIMMED * colormaps[style.CYCLIC](turn)[..., :3]
    colours[np.hypot(dx, dy) < LITTLE] = to_rgb(STILL)
    return np.asarray(colours)


def mean_displacement(displacement: Array) -> Array:
    """Return the mean of displacements (6561, 2) over every square of 9 x 9 designs, (9, 9, 2)."""
    squares = SIDE // SQUARE
    laid = mapped(displacement).reshape(squares, SQUARE, squares, SQUARE, 2)
    return np.asarray(laid.mean(axis=(1, 3)))


def _arrows(axis: Axes, x: Any, y: Any, dx: Any, dy: Any) -> None:
    """Draw displacements with their middles at places, to be seen on any colour."""
    axis.quiver(
        x, y, dx, dy,
        pivot="mid", units="inches", scale=1 / INCHES, scale_units="inches",
        width=0.011, headwidth=4.5, headlength=5, headaxislength=4.5,
        color=style.INK, zorder=4,
        path_effects=[patheffects.withStroke(linewidth=1.6, foreground="white")],
    )  # fmt: skip


def _key(axis: Axes) -> None:
    """Draw the wheel, a ring of the colours, each where it points to seen from above; the rest."""
    side = np.linspace(-1, 1, SAMPLES)
    x, y = np.meshgrid(side, side)
    radius = np.hypot(x, y)
    ring = np.dstack([colour_of(x, y), (radius <= 1) & (radius >= HOLE)])
    axis.imshow(ring, origin="lower", extent=(-1, 1, -1, 1))
    axis.add_patch(Circle((0, 0), 1, fill=False, ec=style.INK, lw=0.5))
    axis.add_patch(Circle((0, 0), HOLE, fill=False, ec=style.INK, lw=0.5))
    for at, text in (((1.3, 0), "+x"), ((0, 1.22), "+y"), ((-1.3, 0), "\N{MINUS SIGN}x")):
        axis.text(at[0], at[1], text, ha="center", va="center", size=style.SMALL)
    axis.text(0, -1.22, "\N{MINUS SIGN}y", ha="center", va="center", size=style.SMALL)
    axis.set_title("heading,\nseen from above", size=style.SMALL)
    label: dict[str, Any] = {"ha": "center", "va": "top", "size": style.SMALL}
    axis.text(
        0, -2.25, f"arrows: mean of\n{SQUARE} \N{MULTIPLICATION SIGN} {SQUARE} designs", **label
    )
    _arrows(axis, 0, -3.35, 1, 0)
    axis.text(0, -3.6, "1 voxel width", **label)
    note = f"white, no arrow:\nless than\n{LITTLE:g} voxel widths"
    axis.text(0, -4.6, note, **label)
    axis.set(xlim=(-1.6, 1.6), ylim=(-6.1, 1.45), aspect="equal")
    axis.set_axis_off()
