"""The direction in which every design travels, as a map."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle
from numpy.typing import NDArray

import softvox_gym
from softvox_view.figures import Inputs, Made, maps, style
from softvox_view.headings import LITTLE

Array = NDArray[np.float64]

#: Lighter than any colour of the wheel, dimmed, so that it stays apart without colour as well.
STILL, DIMMED = "white", 0.86


#: Of the wheel, in its radius: where the ring begins, and samples along a side.
HOLE, SAMPLES = 0.5, 600


def draw(_: Inputs) -> Made:
    """Draw the map and the wheel that is its key."""
    table = softvox_gym.landscape()
    made = style.figure(0.84 * style.WIDTH, 0.68 * style.WIDTH)
    axis, side = made.subplots(1, 2, width_ratios=(5, 1))
    maps.show(axis, colour_of(table["dx"], table["dy"]), lines=style.GREY)
    _wheel(side)
    return Made({"heading": made})


def colour_of(dx: Array, dy: Array) -> Array:
    """Return the colours (..., 3) of displacements; `STILL` where they are less than `LITTLE`."""
    turn = np.arctan2(dy, dx) / (2 * np.pi) % 1
    colours = DIMMED * colormaps[style.CYCLIC](turn)[..., :3]
    colours[np.hypot(dx, dy) < LITTLE] = to_rgb(STILL)
    return np.asarray(colours)


def _wheel(axis: Axes) -> None:
    """Draw the key: a ring of the colours, each where it points to, seen from above."""
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
    note = f"white: travels\nless than\n{LITTLE:g} voxel widths"
    axis.text(0, -1.75, note, ha="center", va="top", size=style.SMALL)
    axis.set(xlim=(-1.6, 1.6), ylim=(-3.3, 1.45), aspect="equal")
    axis.set_axis_off()
