"""A robot for who builds it: seen from two sides, and its slices from below."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle
from numpy.typing import NDArray

from softvox_gym.build import Inlet, Plan
from softvox_gym.design import ABSENT, PASSIVE
from softvox_gym.lattice import FACES
from softvox_view.figures.pages import ASCENT, LEFT, LINE, RIGHT, SIZE, Column, label, rectangle
from softvox_view.figures.style import GREY, INK, PALE

Array = NDArray[np.float64]

#: Colours of the pigments, which differ in lightness; and of the stripes on what is passive.
PINK, BLUE, STRIPES = "#F9C0D4", "#62A0DA", "#8DBDE8"

#: Brightness of faces across x, y and z.
SHADES = (0.84, 0.92, 1.0)

#: Degrees above the floor from where a robot is seen.
ELEVATION = 27.0

#: Inches: of a site of a slice, least and most; around a slice, for inlets; of the key to slices.
SMALLEST, LARGEST, RING, KEY = 0.3, 0.6, 0.27, 1.7

#: Of a voxel's side: the punch is a quarter of an inch, a voxel one and a half centimetres.
VOXEL_CM = 1.5
PUNCH = 0.25 * 2.54 / VOXEL_CM


def draw_robot(axis: Axes, plan: Plan, azimuth: float, corner: Array, size: float) -> None:
    """Draw a robot with its tubes, seen in parallel from an azimuth, into a square."""
    up, about = math.radians(ELEVATION), math.radians(azimuth)
    right = np.array([-math.sin(about), math.cos(about), 0])
    view = np.array([math.cos(up) * math.cos(about), math.cos(up) * math.sin(about), math.sin(up)])
    screen = np.stack([right, -np.cross(view, right)])  # y of the page goes down
    shape = np.array(plan.design.shape, dtype=float)
    # The lattice, with room around its foot for the arrows along the axes.
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
    # The arrows lie before the two sides of the lattice that are nearer.
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
    """Yield what is seen of a robot: how near it is, its corners and its colour."""
    padded = np.pad(plan.design.kinds, 1)
    across = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    for site in np.argwhere(plan.design.kinds != ABSENT):
        colour = np.array(to_rgb(BLUE if plan.design.kinds[tuple(site)] == PASSIVE else PINK))
        for face in np.array(FACES):
            if face @ view <= 0 or padded[tuple(site + face + 1)] != ABSENT:
                continue
            corners = np.tile(site + 0.5 + face / 2, (4, 1))
            corners[:, np.flatnonzero(face == 0)] += np.stack(across, axis=1) / 2
            yield float((site + 0.5) @ view), corners, colour * SHADES[np.flatnonzero(face)[0]]
    for group in plan.groups:
        if group.inlet is not None:
            site = np.array(plan.design.lattice.place(group.inlet.site))
            face = np.array(group.inlet.face)
            wide = np.cross(face, view)
            wide = 0.05 * wide / np.linalg.norm(wide)
            ends = site + 0.5 + np.outer([0.5, 0.5, 1.3, 1.3], face)
            corners = ends + np.outer([-1, 1, 1, -1], wide)
            yield float((site + face + 0.5) @ view), corners, (1, 1, 1)


def draw_arrow(axis: Axes, start: Any, end: Any, lw: float = 0.8) -> None:
    """Draw an arrow."""
    looks = {"arrowstyle": "-|>,head_length=0.3,head_width=0.15", "color": INK, "lw": lw}
    axis.annotate("", end, start, arrowprops={**looks, "shrinkA": 0, "shrinkB": 0})


def draw_slices(column: Column, plan: Plan) -> None:
    """Draw every slice from below, and a key to them."""
    nx, ny, nz = plan.design.shape

    def fits(across: int) -> float:
        return min(((RIGHT - LEFT) / across - 2 * RING) / nx, LARGEST)

    def rows(across: int) -> float:
        return -(-nz // across) + (0 if nz % across else 0.3)

    options = [across for across in range(1, 5) if across == 1 or fits(across) >= SMALLEST]
    across = min(options, key=lambda one: (rows(one), -fits(one)))
    side, width = fits(across), (RIGHT - LEFT) / across
    high = max(side * ny + 2 * RING + LINE, KEY if nz % across else 0)
    column.heading("Slices, seen from below: open side up, x to the left", follows=high + KEY / 4)
    if nz % across == 0:
        axis, top = column.room(0.5)
        _key(axis, plan, [(LEFT + 1.77 * (i % 4), top + 0.21 * (i // 4)) for i in range(8)])
    for z in range(nz):
        if z % across == 0:
            axis, top = column.room(high)
        corner = LEFT + z % across * width + RING, top + LINE + RING
        _slice(axis, plan, z, _Frame(*corner, side, plan.design.shape))
    if nz % across:
        left = LEFT + nz % across * width + 0.1
        _key(axis, plan, [(left, top + 0.21 * i) for i in range(8)])


@dataclass(frozen=True)
class _Frame:
    """Where on the page the sites of a slice are that lies on its upper side."""

    left: float
    top: float
    side: float
    shape: tuple[int, int, int]

    def centre(self, site: int) -> Array:
        """Return the middle of a site: y goes up, and x to the left."""
        nx, ny, _ = self.shape
        x, y = site % nx, site // nx % ny
        place = (self.left + (nx - x - 0.5) * self.side, self.top + (ny - y - 0.5) * self.side)
        return np.array(place)


def _slice(axis: Axes, plan: Plan, z: int, frame: _Frame) -> None:
    """Draw a slice from below."""
    nx, ny, nz = plan.design.shape
    ends = {0: " (bottom)", nz - 1: " (top)"} if nz > 1 else {}
    title = f"z = {z}{ends.get(z, '')}"
    above = frame.top - RING - LINE + ASCENT
    axis.text(frame.left, above, title, weight="bold", va="baseline")
    own = range(nx * ny * z, nx * ny * (z + 1))
    names = {site: group.name for group in plan.groups for site in group.sites}
    digits = plan.design.digits
    for site in own:
        middle = frame.centre(site)
        _voxel(axis, middle, frame.side, digits[site], names.get(site, ""))
        if digits[site] != "0":
            words = f"{site % nx},{site // nx % ny}"
            label(axis, np.add(middle, (0, 0.19 * frame.side)), words)
    for bond in plan.bonds:
        if bond[0] in own:
            _seam(axis, frame.centre(bond[0]), frame.centre(bond[1]), 1.0, lw=2.0)
    for hole in plan.holes:
        if hole.sites[0] in own:
            _hole(axis, frame.centre(hole.sites[0]), frame.centre(hole.sites[1]))
    for group in plan.groups:
        if group.inlet is not None and group.inlet.site in own:
            _inlet(axis, frame, group.name, group.inlet)
    _directions(axis, frame)


def _voxel(
    axis: Axes, middle: Array, side: float, digit: str, name: str, size: float | None = None
) -> None:
    """Draw a site of a slice."""
    corner = middle - side / 2
    if digit == "0":
        looks: dict[str, Any] = {"fc": "none", "ec": GREY, "lw": 0.6, "ls": ":"}
        rectangle(axis, corner, side, side, **looks)
        return
    looks = {"fc": PINK, "lw": 0} if name else {"fc": BLUE, "ec": STRIPES, "hatch": "///", "lw": 0}
    rectangle(axis, corner, side, side, **looks)
    rectangle(axis, corner, side, side, lw=0.8)
    place = middle if size else middle - (0, 0.2 * side)
    size = size or (12 if side > 0.5 else SIZE)
    label(axis, place, name, size=size, weight="bold")


def _seam(axis: Axes, first: Array, second: Array, share: float, **looks: Any) -> None:
    """Draw a share of the face between two neighbours of a slice."""
    across = (second - first)[::-1] * share / 2
    ends = (first + second) / 2 + np.outer([-1, 1], across)
    axis.plot(*ends.T, **{"color": INK, "solid_capstyle": "butt", **looks})


def _hole(axis: Axes, first: Array, second: Array, share: float = PUNCH) -> None:
    """Draw the hole between two neighbours, as long as the punch."""
    wide = min(5.0, 14 * np.abs(second - first).sum())
    _seam(axis, first, second, share, lw=wide)
    _seam(axis, first, second, 0.88 * share, lw=wide - 1.6, color="white")


def _inlet(axis: Axes, frame: _Frame, name: str, inlet: Inlet) -> None:
    """Draw an inlet: an arrow onto a side, or a ring on the side below or above."""
    middle, side = frame.centre(inlet.site), frame.side
    x, y, z = inlet.face
    if z:
        _ring(axis, np.add(middle, (0.34 * side, -0.32 * side)), z)
        return
    out = np.array([-x, -y])
    start = middle + out * (side / 2 + 0.15)
    draw_arrow(axis, start, middle + out * side / 2, 1.2)
    nx, ny, _ = frame.shape
    low, high = np.array([frame.left, frame.top]), np.array([nx, ny]) * side
    inside = ((start > low) & (start < low + high)).all()
    if not inside or side > 0.5:
        label(axis, start + 0.07 * out, name, weight="bold")


def _ring(axis: Axes, middle: Array, z: int) -> None:
    """Draw the sign of what comes towards the reader, from below, or goes away from him."""
    x, y = middle
    axis.add_patch(Circle((x, y), 0.045, fc="white", ec=INK, lw=0.9))
    if z < 0:
        axis.add_patch(Circle((x, y), 0.012, fc=INK, lw=0))
        return
    for slope in (1, -1):
        axis.plot(*(middle + np.outer([-0.03, 0.03], [1, slope])).T, color=INK, lw=0.9)


def _directions(axis: Axes, frame: _Frame) -> None:
    """Draw which way x and y go."""
    nx, ny, _ = frame.shape
    corner = np.array([frame.left + nx * frame.side, frame.top + ny * frame.side])
    for name, way in (("x", np.array([-1, 0])), ("y", np.array([0, -1]))):
        start = corner + 0.1
        draw_arrow(axis, start, start + (0.1 + 0.3 * frame.side) * way)
        beside = 0.1 + 0.1 * (1 + way) - 0.26 * frame.side * np.abs(way)
        label(axis, corner + beside, name)


def _key(axis: Axes, plan: Plan, places: Sequence[tuple[float, float]]) -> None:
    """Explain the slices' signs, each at a place."""
    faces = {group.inlet.face for group in plan.groups if group.inlet is not None}
    words = ["active (pink), of group A", "passive (blue or yellow)", "no voxel"]
    words += ["bonded with Sil-Poxy", "hole to punch", "inlet of group A"]
    words += ["inlet, on this side"] * ((0, 0, -1) in faces)
    words += ["inlet, on the far side"] * ((0, 0, 1) in faces)
    for row, (text, place) in enumerate(zip(words, places, strict=False)):
        middle = np.add(place, (0.09, 0.09))
        if row < 3:
            _voxel(axis, middle, 0.17, "210"[row], "A" * (row == 0), SIZE)
        elif row < 5:
            ends = middle - (0.1, 0), np.add(middle, (0.1, 0))
            _seam(axis, *ends, 1.0, lw=2)
            if row == 4:
                _hole(axis, *ends, 0.6)
        elif row == 5:
            draw_arrow(axis, middle - (0.1, 0), np.add(middle, (0.08, 0)), 1.2)
        else:
            _ring(axis, middle, -1 if "this" in text else 1)
        label(axis, np.add(middle, (0.19, 0)), text, ha="left")
