"""A robot as its builder needs it: seen from two sides, and its slices from below."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle
from numpy.typing import NDArray

from softvox_gym.build import Plan
from softvox_gym.design import ABSENT, PASSIVE
from softvox_gym.lattice import FACES
from softvox_gym.real_tracks import VOXEL_CM
from softvox_view.figures.pages import ASCENT, LEFT, LINE, RIGHT, SIZE, Column, label, rectangle
from softvox_view.figures.style import GREY, INK, PALE

Array = NDArray[np.float64]

#: Colours of the pigments, which differ in lightness; and of the stripes on passive voxels.
PINK, BLUE, STRIPES = "#F9C0D4", "#62A0DA", "#8DBDE8"

#: Brightness of the faces normal to x, y and z.
SHADES = (0.84, 0.92, 1.0)

#: Degrees above the floor, of the views of a robot.
ELEVATION = 27.0

#: Inches: a site of a slice, least and most; the margin of a slice, for inlets; the key beside
#: the slices, and the step between its signs.
SMALLEST, LARGEST, RING, KEY, STEP = 0.3, 0.6, 0.3, 1.8, 0.22

#: The most slices beside each other.
ACROSS = 4

#: The punch, a quarter of an inch, as a share of a voxel's side.
PUNCH = 0.25 * 2.54 / VOXEL_CM


def draw_robot(axis: Axes, plan: Plan, azimuth: float, corner: Array, size: float) -> None:
    """Draw a robot with its tubes in parallel projection from an azimuth, into a square."""
    up, about = math.radians(ELEVATION), math.radians(azimuth)
    right = np.array([-math.sin(about), math.cos(about), 0])
    view = np.array([math.cos(up) * math.cos(about), math.cos(up) * math.sin(about), math.sin(up)])
    screen = np.stack([right, -np.cross(view, right)])  # y of the page goes down
    shape = np.array(plan.design.shape, dtype=float)
    # The lattice, with room around its foot for the axis arrows.
    unit = 0.5 + shape.max() / 4
    foot = np.array([1.2, 1.2, 0]) * unit
    corners = np.indices((2, 2, 2)).reshape(3, -1).T * (shape + foot) - foot / 2
    seen = corners @ screen.T
    scale = size / np.ptp(seen, axis=0).max()
    shift = corner + size / 2 - scale * (seen.min(axis=0) + seen.max(axis=0)) / 2

    def place(points: Any) -> Array:
        return np.asarray(np.asarray(points) @ screen.T * scale + shift)

    ground = place([(0, 0, 0), (shape[0], 0, 0), (*shape[:2], 0), (0, shape[1], 0)])
    axis.fill(*ground.T, fc="none", ec=PALE, lw=0.6)
    # The arrows lie before the two nearer sides of the lattice.
    for k, name in enumerate("xy"):
        start = np.zeros(3)
        start[1 - k] = shape[1 - k] + 0.35 * unit if view[1 - k] > 0 else -0.35 * unit
        way = np.eye(3)[k] * unit
        draw_arrow(axis, *place([start, start + way]))
        label(axis, place(start + 1.25 * way), name)
    shown = sorted(_drawn(plan, view), key=lambda one: one[0])
    faces = [place(points) for _, points, _ in shown]
    colours = [colour for _, _, colour in shown]
    looks: dict[str, Any] = {"edgecolors": INK, "lw": 0.5, "joinstyle": "round"}
    axis.add_collection(PolyCollection(faces, facecolors=colours, **looks), autolim=False)


def _drawn(plan: Plan, view: Array) -> Iterator[tuple[float, Array, Any]]:
    """Yield the visible parts of a robot: nearness, corners and colour of each."""
    kinds = plan.design.kinds
    padded = np.pad(kinds, 1)
    for site in np.argwhere(kinds != ABSENT):
        colour = np.array(to_rgb(BLUE if kinds[tuple(site)] == PASSIVE else PINK))
        for face in np.array(FACES):
            if face @ view > 0 and padded[tuple(site + face + 1)] == ABSENT:
                corners = np.tile(site + 0.5 + face / 2, (4, 1))
                square = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
                corners[:, face == 0] += square
                yield float((site + 0.5) @ view), corners, colour * SHADES[np.argmax(face != 0)]
    for inlet in (group.inlet for group in plan.groups if group.inlet):
        site, face = np.array(plan.design.lattice.place(inlet.site)), np.array(inlet.face)
        wide = np.cross(face, view)
        across = np.outer([-1, 1, 1, -1], 0.05 * wide / np.linalg.norm(wide))
        corners = site + 0.5 + np.outer([0.5, 0.5, 1.3, 1.3], face) + across
        yield float((site + face + 0.5) @ view), corners, (1, 1, 1)


def draw_arrow(axis: Axes, start: Any, end: Any, lw: float = 0.8) -> None:
    """Draw an arrow."""
    looks = {"arrowstyle": "-|>,head_length=0.3,head_width=0.15", "color": INK, "lw": lw}
    axis.annotate("", end, start, arrowprops={**looks, "shrinkA": 0, "shrinkB": 0})


def draw_slices(column: Column, plan: Plan) -> None:
    """Draw every slice from below, and a key to the signs."""
    nx, ny, nz = plan.design.shape
    room = RIGHT - LEFT - KEY
    fits = [n for n in range(2, ACROSS + 1) if n <= nz and room / n - 2 * RING >= SMALLEST * nx]
    across = max(fits, default=1)
    side = min((room / across - 2 * RING) / nx, LARGEST)
    high = side * ny + 2 * RING + LINE
    key = max(high, 8 * STEP)
    heading = "Slices, seen from below (mirrored: x to the left), as they lie with open sides up"
    column.heading(heading, follows=key)
    for z in range(nz):
        if z % across == 0:
            axis, top = column.room(high if z else key)
        corner = LEFT + z % across * room / across + RING, top + LINE + RING
        _slice(axis, plan, z, np.array(corner), side)
        if z == 0:
            _key(axis, plan, RIGHT - KEY + 0.1, top)


def _slice(axis: Axes, plan: Plan, z: int, corner: Array, side: float) -> None:
    """Draw a slice that lies on its upper side, from its upper left corner: x goes left."""
    nx, ny, nz = plan.design.shape
    ends = {0: " (bottom)", nz - 1: " (top)"} if nz > 1 else {}
    place = corner[0], corner[1] - RING - LINE + ASCENT
    axis.text(*place, f"z = {z}{ends.get(z, '')}", weight="bold", va="baseline")
    own = range(nx * ny * z, nx * ny * (z + 1))
    names = {site: group.name for group in plan.groups for site in group.sites}

    def centre(site: int) -> Array:
        x, y, _ = plan.design.lattice.place(site)
        return np.asarray(corner + np.array([nx - x - 0.5, ny - y - 0.5]) * side)

    for site in own:
        words = f"{site % nx},{site // nx % ny}"
        _voxel(axis, centre(site), side, plan.design.digits[site], names.get(site, ""), words)
    for first, second in plan.bonds:
        if first in own:
            _bond(axis, centre(first), centre(second), (first, second) in plan.holes)
    for group in plan.groups:
        if group.inlet and group.inlet.site in own:
            middle, (x, y, up) = centre(group.inlet.site), group.inlet.face
            if up:
                _ring(axis, np.add(middle, (0.34 * side, -0.32 * side)), up)
                continue
            out = np.array([-x, -y])
            start = middle + out * (side / 2 + 0.15)
            draw_arrow(axis, start, middle + out * side / 2, 1.2)
            beyond = (start - corner) / (np.array([nx, ny]) * side)
            if side > 0.5 or not ((beyond > 0) & (beyond < 1)).all():
                label(axis, start + 0.07 * len(group.name) * out, group.name, weight="bold")
    start, length = corner + np.array([nx, ny]) * side + 0.1, 0.1 + 0.3 * side
    for name, way in (("x", (-1, 0)), ("y", (0, -1))):
        along = length * np.array(way)
        draw_arrow(axis, start, start + along)
        label(axis, start + 0.5 * along - 0.1 * np.array(way[::-1]), name)


def _voxel(
    axis: Axes, middle: Array, side: float, digit: str, name: str = "", words: str = ""
) -> None:
    """Draw a site of a slice."""
    corner = middle - side / 2
    if digit == "0":
        rectangle(axis, corner, side, side, ec=GREY, lw=0.6, ls=":")
        return
    looks: dict[str, Any] = {"fc": BLUE, "ec": STRIPES, "hatch": "///", "lw": 0}
    rectangle(axis, corner, side, side, **({"fc": PINK, "lw": 0} if name else looks))
    rectangle(axis, corner, side, side, lw=0.8)
    size = 12 if side > 0.5 else SIZE
    label(axis, middle - (0, 0.2 * side * bool(words)), name, size=size, weight="bold")
    label(axis, middle - (0, -0.19 * side), words)


def _bond(axis: Axes, first: Array, second: Array, has_hole: bool) -> None:
    """Draw the face between two neighbours of a slice, and the hole in it, as long as the punch."""
    across = (second - first)[::-1] / 2
    wide = min(5.0, 14 * np.abs(across).sum() * 2)
    looks = [(1.0, 2.0, INK)]
    looks += [(PUNCH, wide, INK), (0.88 * PUNCH, wide - 1.6, "white")] if has_hole else []
    for share, lw, colour in looks:
        ends = (first + second) / 2 + np.outer([-share, share], across)
        axis.plot(*ends.T, color=colour, lw=lw, solid_capstyle="butt")


def _ring(axis: Axes, middle: Array, up: int) -> None:
    """Draw the sign of what comes towards the reader, who looks from below, or goes away."""
    axis.add_patch(Circle(tuple(middle), 0.045, fc="white", ec=INK, lw=0.9))
    looks: dict[str, Any] = {"color": INK, "ms": 1.6 if up < 0 else 4.2}
    axis.plot(*middle, "o" if up < 0 else "x", mew=0.9, **looks)


def _key(axis: Axes, plan: Plan, left: float, top: float) -> None:
    """Explain the slices' signs."""
    words = ["active (pink), of group A", "passive (blue or yellow)", "no voxel"]
    words += ["bonded with Sil-Poxy", "hole to punch", "inlet of group A"]
    ways = {group.inlet.face[2] for group in plan.groups if group.inlet}
    words += ["inlet, on this side"] * (-1 in ways) + ["inlet, on the far side"] * (1 in ways)
    for row, text in enumerate(words):
        middle = np.array([left + 0.09, top + STEP * row + 0.09])
        aside, above = np.array([0.1, 0]), np.array([0, 0.12])
        if row < 3:
            _voxel(axis, middle, 0.17, "210"[row], "A" * (row == 0))
        elif row < 5:
            _bond(axis, middle - above, middle + above, row == 4)
        elif row == 5:
            draw_arrow(axis, middle - aside, middle + aside, 1.2)
        else:
            _ring(axis, middle, -1 if "this" in text else 1)
        label(axis, middle + 2.2 * aside, text, ha="left")
