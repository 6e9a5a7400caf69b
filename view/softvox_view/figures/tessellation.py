"""The key to the maps (Fig. 3): the sites, the whole map, and the way down to one design."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

import softvox_gym
from softvox_gym.design import Design
from softvox_gym.landscapes.table import LATTICE, N_DESIGNS
from softvox_gym.rendering import ACTIVE, PASSIVE
from softvox_view.figures import Inputs, maps, style
from softvox_view.figures.robots import picture
from softvox_view.tessellation import PAIRS, cell_of

#: The design to which the key leads: the best one.
DESIGN = 6453

#: Pixels of a robot's picture, and the space under a whole one, a share of its square.
PIXELS, FOOT = 150, 0.2

#: Points: the frames of a chosen square and of the panel that enlarges it; the ring in the last.
FRAME, RING = 1.6, 3.2

#: The meaning of the digits.
MATERIALS = (("0 absent", "white"), ("1 passive, cyan", PASSIVE), ("2 active, red", ACTIVE))

#: Three designs, at the beginning, the middle and the end of the map.
LANDMARKS = (
    (0, "empty", (5, 4)),
    ((N_DESIGNS - 1) // 2, "all passive", (5, 4)),
    (N_DESIGNS - 1, "all active", (-5, -5)),
)


def draw_tessellation(_: Inputs) -> Figure:
    """Draw the sites and the map above, and four nested squares below."""
    made = style.figure(style.WIDTH, 0.72 * style.WIDTH)
    parts: Any = made.subfigures(2, 1, height_ratios=(1.75, 1))
    above, below = parts
    sites, whole = above.subplots(1, 2, width_ratios=(1, 1.15))
    _sites(sites)
    _whole(whole)
    for level, axis in enumerate(below.subplots(1, len(PAIRS))):
        _level(axis, level)
    return made


def _sites(axis: Axes) -> None:
    """Draw the lattice as eight cubes set apart, each with the digit that fills it."""
    right, back, up = np.array([1.0, 0.0]), np.array([0.52, 0.38]), np.array([0.0, 1.0])
    faces = (
        ((0 * up, right, right + up, up), "#F4F4F4"),
        ((up, right + up, right + up + back, up + back), "#E2E2E2"),
        ((right, right + back, right + back + up, right + up), "#CFCFCF"),
    )
    for site in sorted(range(LATTICE.sites), key=lambda i: (-(i >> 1 & 1), i >> 2, i & 1)):
        x, y, z = site & 1, site >> 1 & 1, site >> 2
        corner = 1.75 * x * right + 2.3 * y * back + 1.75 * z * up
        for points, shade in faces:
            face = [corner + point for point in points]
            axis.fill(*np.transpose(face), fc=shade, ec=style.INK, lw=0.7)
        x_middle, y_middle = corner + (right + up) / 2
        axis.text(x_middle, y_middle, f"$d_{site}$", ha="center", va="center", size=9)
    start, arrow = np.array([-0.75, -0.75]), {"arrowstyle": "->", "lw": 0.8, "shrinkA": 0}
    for along, name in ((right, "x"), (back, "y"), (up, "z")):
        unit = along / np.hypot(*along)
        axis.annotate("", tuple(start + 0.75 * unit), tuple(start), arrowprops=arrow)
        x, y = start + 0.95 * unit
        axis.text(x, y, name, ha="center", va="center")
    axis.set(xlim=(-1.0, 4.9), ylim=(-1.0, 4.3), aspect="equal")
    axis.set_title("a  the sites, a digit for each", loc="left")
    axis.set_axis_off()
    handles = [Patch(fc=colour, ec=style.INK, lw=0.6, label=name) for name, colour in MATERIALS]
    axis.legend(handles=handles, loc="lower right", handlelength=1.0, handleheight=1.0)


def _whole(axis: Axes) -> None:
    """Draw the map with all its lines, the landmarks, and the way down to the design."""
    axis.set_facecolor("#EDEDED")
    maps.frame(axis, color=style.GREY, widths={27: 1.0, 9: 0.5, 3: 0.15})
    for design, text, offset in LANDMARKS:
        maps.mark(axis, design, text, offset=offset)
    maps.mark(axis, DESIGN, f"{DESIGN}", offset=(4, 5), ring=RING)
    row, column = (int(place) for place in cell_of(DESIGN))
    for side in (27, 9, 3):
        _square(axis, (column // side * side - 0.5, row // side * side - 0.5), side)
    axis.set_title("b  the map: a cell for each of 6561 designs", loc="left")


def _square(axis: Axes, corner: tuple[float, float], side: float) -> None:
    """Draw the frame of the chosen square."""
    axis.add_patch(Rectangle(corner, side, side, fill=False, ec=style.INK, lw=FRAME, zorder=4))


def _level(axis: Axes, level: int) -> None:
    """Draw the 3 x 3 squares of a pair: the robot so far with each of the pair's values."""
    across, upward = PAIRS[level]
    digits = LATTICE.digits(DESIGN)
    fitness = softvox_gym.landscape()["fitness"]
    for values in np.ndindex(3, 3):
        part = np.zeros(LATTICE.sites, dtype=int)
        part[: 2 * level] = digits[: 2 * level]  # the pairs before
        part[[across, upward]] = values
        robot, (x, y) = Design(part), values
        is_whole = level == len(PAIRS) - 1
        side = 1 - FOOT * is_whole
        axis.imshow(picture(robot, PIXELS), extent=(x + 1 - side, x + 1, y + 1 - side, y + 1))
        if is_whole:
            text = f"{fitness[robot.index]:.2f}"
            axis.text(x + 0.06, y + 0.05, text, ha="left", va="bottom")
    for edge in (1, 2):
        axis.axhline(edge, color=style.GREY, lw=0.6)
        axis.axvline(edge, color=style.GREY, lw=0.6)
    _square(axis, (digits[across], digits[upward]), 1)
    axis.set(xlim=(0, 3), ylim=(0, 3), aspect="equal")
    maps.digits(axis, [0.5, 1.5, 2.5])
    axis.set_xlabel(f"$d_{across}$")
    axis.set_ylabel(f"$d_{upward}$", rotation=0, y=0.667, labelpad=3, va="center")
    within = f", within {'bcde'[level]}" if level else ", of all"
    axis.set_title(f"{'cdef'[level]}  pair {level + 1}{within}", loc="left")
    if level:
        axis.spines[:].set_linewidth(FRAME)
