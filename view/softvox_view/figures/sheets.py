"""Sheets to build robots from: what a plan says, drawn on A4, beside what the simulator expects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from softvox_gym.build import (
    CURE_MINUTES,
    CURE_MINUTES_ROOM,
    LEAK_CHECK,
    MEASUREMENTS,
    TOWARDS,
    VOXEL_G,
    Bill,
    Inlet,
    Plan,
)
from softvox_gym.design import ABSENT, PASSIVE, Design
from softvox_gym.lattice import FACES
from softvox_gym.physics import Physics
from softvox_gym.real_tracks import heading
from softvox_gym.simulation import simulate
from softvox_view.figures.pages import (
    ASCENT,
    HEIGHT,
    LEFT,
    LINE,
    RIGHT,
    SIZE,
    WIDTH,
    Column,
    Pages,
    box,
    style,
    write,
)
from softvox_view.figures.robots import relative_volume
from softvox_view.figures.style import GREY, INK, PALE

__all__ = ["Facts", "draw_batch", "draw_sheet", "facts_of", "write"]

Array = NDArray[np.float64]

#: Colours of the pigments, which differ in lightness; and of the stripes on what is passive.
PINK, BLUE, STRIPES = "#F9C0D4", "#62A0DA", "#8DBDE8"

#: Brightness of faces across x, y and z.
SHADES = (0.84, 0.92, 1.0)

#: Degrees: above the floor, and about the vertical, from where the two pictures are seen.
ELEVATION, AZIMUTHS = 27.0, (-56.0, 124.0)

#: Inches: of a site of a slice, least and most; around a slice, for inlets; the side of a picture
#: of the robot.
SMALLEST, LARGEST, RING, PICTURE = 0.3, 0.64, 0.27, 1.5

#: Inches: of the key to the slices.
KEY = 1.8

#: Of a voxel's side: the punch is a quarter of an inch, a voxel one and a half centimetres.
VOXEL_CM = 1.5
PUNCH = 0.25 * 2.54 / VOXEL_CM

#: Sites along x or y that a sheet has room for.
MOST = 10

#: When the volume is measured, cycles.
MOMENTS = (0.0, 0.25, 0.5, 0.75)
FRACTIONS = ("0", "\N{VULGAR FRACTION ONE QUARTER}", "\N{VULGAR FRACTION ONE HALF}")
FRACTIONS += ("\N{VULGAR FRACTION THREE QUARTERS}",)

#: Where a robot's maker writes.
BLANK = "_" * 12

#: Groups that have their boxes in one line.
TICKS = 8

#: Fillings of the mould that have a line to note their cures.
MOST_FILLINGS = 10

CURES = (
    f"Two layers a filling. Each cures for 25 min, then {CURE_MINUTES - 25} min at 60 "
    f"\N{DEGREE SIGN}C; or for {CURE_MINUTES_ROOM} min at room temperature."
)
TRAVEL = (
    "Travel on cornstarch: 90 actuations at 6 kPa, filmed from above with a ruler in the picture, "
    "three times. Headings from +x towards +y."
)
VOLUME = "Volume under water at four moments of a cycle, relative to rest."


@dataclass(frozen=True, eq=False)
class Facts:
    """What the simulator expects of a robot under the published physics.

    Parameters
    ----------
    fitness : float
        Voxel widths; NaN where the simulation diverges.
    heading : float, or None
        Degrees from +x towards +y; None for a robot that hardly moves, or diverges.
    cycle, volume : array, shape (k,)
        Moments of one cycle of actuation, 0 to 1, and the robot's volume then, relative to rest.
    """

    fitness: float
    heading: float | None
    cycle: Array
    volume: Array

    def volume_at(self, moment: float) -> float:
        """Return the relative volume at a moment, cycles."""
        return float(np.interp(moment, self.cycle, self.volume))


def facts_of(designs: Sequence[Design]) -> list[Facts]:
    """Return what the simulator expects of designs of one lattice, simulated in one batch.

    ValueError for designs of several lattices.
    """
    if not designs:
        return []
    result = simulate(designs)
    cycle, volume = relative_volume(designs)
    ways = [heading(moved[:2]) for moved in result.displacement]
    return [
        Facts(float(fitness), None if math.isnan(way) else way, cycle, own)
        for fitness, way, own in zip(result.fitness, ways, volume, strict=True)
    ]


def draw_sheet(plan: Plan, facts: Facts) -> tuple[Figure, ...]:
    """Draw the sheet of a robot: one A4 page, and more where a large one needs them.

    Raises
    ------
    ValueError
        For a lattice of more than `MOST` sites along x or y.
    """
    nx, ny, _ = plan.design.shape
    if max(nx, ny) > MOST:
        raise ValueError(
            f"a sheet has room for lattices of up to {MOST} sites along x and y, got "
            f"{plan.design.lattice}; build it of parts"
        )
    with style():
        made = Pages(_name(plan.design))
        column = Column(made)
        _head(column, plan)
        _pictures(column, plan, facts)
        _slices(column, plan)
        if plan.groups:
            _groups(column, plan)
        left, right = column.halves(0.56)
        if not plan.problems:
            left.heading("Order of assembly", follows=6 * LINE)
            for i, step in enumerate(plan.steps, start=1):
                _item(left, f"{i}", step)
            _measure(right, plan, facts)
    return tuple(made.figures)


def _name(design: Design) -> str:
    """Return a robot's name; a number of many digits is none."""
    number = str(design.index)
    return f"Robot {number}" if len(number) <= 13 else f"Robot on {design.lattice}"


def _heading(facts: Facts) -> str:
    """Return a heading in words, rounded."""
    if facts.heading is None:
        return "no heading"
    return f"{facts.heading:.0f}\N{DEGREE SIGN}".replace("-", "\N{MINUS SIGN}")


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _head(column: Column, plan: Plan) -> None:
    """Write what robot it is, who built it, and what is wrong with it."""
    design = plan.design
    column.title()
    passive = design.n_voxels - design.n_active
    dot = " \N{MIDDLE DOT} "
    column.row((0, f"digits {design.digits}{dot}lattice {design.lattice}"))
    kinds = f"{design.n_active} active, {passive} passive"
    parts = [f"{_count(design.n_voxels, 'voxel')} of {VOXEL_CM:g} cm: {kinds}"]
    parts += [_count(len(plan.groups), "actuator group")]
    parts += [f"{_count(len(plan.holes), 'hole')} to punch"]
    column.row((0, dot.join(parts)))
    if plan.problems:
        column.gap(0.5 * LINE)
        begin = column.page, column.top
        column.gap(0.4 * LINE)
        column.row((0.12, "This robot can't be built with the kit:"), weight="bold")
        for problem in plan.problems:
            column.row((0.12, "\N{BULLET}"), (0.24, problem))
        column.gap(0.4 * LINE)
        if column.page == begin[0]:
            axis = column.pages.axis(column.page)
            frame = {"fc": "none", "ec": INK, "lw": 1.6}
            size = RIGHT - LEFT, column.top - begin[1]
            axis.add_patch(Rectangle((LEFT, begin[1]), *size, **frame))
    for warning in plan.warnings:
        column.row((0, "Take care: " + warning))
    column.gap(0.5 * LINE)


def _pictures(column: Column, plan: Plan, facts: Facts) -> None:
    """Draw the robot from two sides, where the simulator sends it, and its volume."""
    axis, top = column.room(LINE + PICTURE + LINE)
    lefts = np.linspace(LEFT, RIGHT - PICTURE, 4)
    words = ["from +x, \N{MINUS SIGN}y, above", "from \N{MINUS SIGN}x, +y, above"]
    words += ["simulated, from above", "volume / volume at rest"]
    for left, text in zip(lefts, words, strict=True):
        axis.text(left + PICTURE / 2, top + ASCENT, text, ha="center", va="baseline")
    for left, azimuth in zip(lefts, AZIMUTHS, strict=False):
        draw_robot(axis, plan, azimuth, left, top + LINE)
    _map(axis, plan.design, facts, lefts[2], top + LINE)
    if plan.design.n_voxels and np.isfinite(facts.volume).all():
        _volume(axis, facts, lefts[3], top + LINE)


def draw_robot(axis: Axes, plan: Plan, azimuth: float, left: float, top: float) -> None:
    """Draw a robot with its tubes, seen in parallel from an azimuth, into a square of `PICTURE`."""
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
    scale = PICTURE / np.ptp(seen, axis=0).max()
    shift = np.array([left, top]) + PICTURE / 2 - scale * (seen.min(axis=0) + seen.max(axis=0)) / 2

    def place(points: Any) -> Array:
        return np.asarray(np.asarray(points) @ screen.T * scale + shift)

    ground = place([(0, 0, 0), (shape[0], 0, 0), (*shape[:2], 0), (0, shape[1], 0)])
    axis.fill(*ground.T, fc="none", ec=PALE, lw=0.6)
    # The arrows lie before the two sides of the lattice that are nearer.
    for k, name in enumerate("xy"):
        start = np.zeros(3)
        start[1 - k] = shape[1 - k] + 0.35 * unit if view[1 - k] > 0 else -0.35 * unit
        way = np.eye(3)[k] * unit
        _arrow(axis, *place([start, start + way]))
        axis.text(*place(start + 1.25 * way), name, ha="center", va="center")
    shown = sorted(_drawn(plan, view), key=lambda one: one[0])
    faces = [place(points) for _, points, _ in shown]
    looks = {"facecolors": [colour for _, _, colour in shown], "edgecolors": INK, "lw": 0.5}
    axis.add_collection(PolyCollection(faces, joinstyle="round", **looks), autolim=False)


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
            yield (site + 0.5) @ view, corners, colour * SHADES[np.flatnonzero(face)[0]]
    for group in plan.groups:
        if group.inlet is not None:
            site, face = (
                np.array(plan.design.lattice.place(group.inlet.site)),
                np.array(group.inlet.face),
            )
            wide = np.cross(face, view)
            wide = 0.05 * wide / np.linalg.norm(wide)
            ends = site + 0.5 + np.outer([0.5, 0.5, 1.3, 1.3], face)
            yield (site + face + 0.5) @ view, ends + np.outer([-1, 1, 1, -1], wide), (1, 1, 1)


def _arrow(axis: Axes, start: Any, end: Any, lw: float = 0.8) -> None:
    looks = {"arrowstyle": "-|>,head_length=0.3,head_width=0.15", "color": INK, "lw": lw}
    axis.annotate("", end, start, arrowprops={**looks, "shrinkA": 0, "shrinkB": 0})


def _map(axis: Axes, design: Design, facts: Facts, left: float, top: float) -> None:
    """Draw, from above, where the robot stands and where it travels."""
    side = PICTURE - LINE - 0.1
    left += (PICTURE - side) / 2
    axis.add_patch(Rectangle((left, top), side, side, fc="none", ec=GREY, lw=0.6))
    nx, ny, _ = design.shape
    way = np.zeros(2)
    if facts.heading is not None:
        angle = math.radians(facts.heading)
        way = facts.fitness * np.array([math.cos(angle), math.sin(angle)])
    middle = np.array([nx, ny]) / 2
    ends = np.array([[0, 0], [nx, ny], middle + way])
    low, high = ends.min(axis=0), ends.max(axis=0)
    scale = side / (1.2 * (high - low).max() + 0.8)

    def place(points: Any) -> Array:
        moved = (np.asarray(points) - (low + high) / 2) * (scale, -scale)
        return np.asarray(np.add(moved, (left + side / 2, top + side / 2)))

    for x, y in np.argwhere((design.array != ABSENT).any(axis=2)):
        corner = place((x, y + 1))
        axis.add_patch(Rectangle(corner, scale, scale, fc=PALE, ec="white", lw=0.4))
    if facts.heading is not None:
        _arrow(axis, place(middle), place(middle + way), 1.4)
    for text, end, shift in (("x", (0.3, 0), (0.06, 0)), ("y", (0, -0.3), (0, -0.06))):
        start = np.array([left + 0.08, top + side - 0.08])
        _arrow(axis, start, start + end, 0.6)
        axis.text(*(start + end + shift), text, ha="center", va="center")
    words = f"{facts.fitness:.2f} voxel widths, {_heading(facts)}"
    if math.isnan(facts.fitness):
        words = "the simulation diverges"
    place_of = left + side / 2, top + side + LINE
    axis.text(*place_of, words, ha="center", va="baseline", weight="bold")


def _volume(axis: Axes, facts: Facts, left: float, top: float) -> None:
    """Draw the volume over a cycle, with the moments at which it is measured."""
    side = PICTURE - LINE - 0.1
    bounds = (left + 0.3) / WIDTH, 1 - (top + side) / HEIGHT, (PICTURE - 0.36) / WIDTH
    figure = axis.figure
    own = figure.add_axes((*bounds, side / HEIGHT))
    own.plot(facts.cycle, facts.volume, color=INK, lw=1.2)
    values = [facts.volume_at(moment) for moment in MOMENTS]
    own.plot(MOMENTS, values, "o", ms=4.5, mfc="white", mec=INK, clip_on=False, zorder=3)
    own.axhline(1, color=PALE, lw=0.8, zorder=0)
    own.set(xlim=(0, 1), ylim=(0.85, 2))
    own.set_xticks([*MOMENTS, 1], [*FRACTIONS, "1"])
    own.set_yticks([1, 1.5])
    own.set_xlabel("cycle; \N{WHITE CIRCLE} measured", labelpad=1)


def _slices(column: Column, plan: Plan) -> None:
    """Draw every slice from below, and a key to them."""
    nx, ny, nz = plan.design.shape
    around = 2 * RING

    def fits(across: int) -> float:
        return min(((RIGHT - LEFT) / across - around) / nx, LARGEST)

    def rows(across: int) -> float:
        return -(-nz // across) + (0 if nz % across else 0.3)

    options = [across for across in range(1, 5) if across == 1 or fits(across) >= SMALLEST]
    across = min(options, key=lambda one: (rows(one), -fits(one)))
    side, width = fits(across), (RIGHT - LEFT) / across
    high = max(side * ny + around + LINE, KEY if nz % across else 0)
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
        left = LEFT + nz % across * width
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
            axis.text(*np.add(middle, (0, 0.19 * frame.side)), words, ha="center", va="center")
    for bond in plan.bonds:
        if bond[0] in own:
            _seam(axis, *map(frame.centre, bond), 1.0, lw=2.0)
    for hole in plan.holes:
        if hole.sites[0] in own:
            _hole(axis, *map(frame.centre, hole.sites))
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
        axis.add_patch(Rectangle(corner, side, side, **looks))
        return
    looks = {"fc": PINK, "lw": 0} if name else {"fc": BLUE, "ec": STRIPES, "hatch": "///", "lw": 0}
    axis.add_patch(Rectangle(corner, side, side, **looks))
    axis.add_patch(Rectangle(corner, side, side, fc="none", ec=INK, lw=0.8))
    place = middle if size else middle - (0, 0.2 * side)
    size = size or (12 if side > 0.5 else SIZE)
    axis.text(*place, name, size=size, weight="bold", ha="center", va="center")


def _seam(axis: Axes, first: Array, second: Array, share: float, **looks: Any) -> None:
    """Draw a share of the face between two neighbours of a slice."""
    across = (second - first)[::-1] * share / 2
    ends = (first + second) / 2 + np.outer([-1, 1], across)
    axis.plot(*ends.T, **{"color": INK, "solid_capstyle": "butt", **looks})


def _hole(axis: Axes, first: Array, second: Array) -> None:
    """Draw the hole between two neighbours, as long as the punch."""
    wide = min(5.0, 11 * np.abs(second - first).sum())
    _seam(axis, first, second, PUNCH, lw=wide)
    _seam(axis, first, second, PUNCH - 0.04, lw=wide - 1.6, color="white")


def _inlet(axis: Axes, frame: _Frame, name: str, inlet: Inlet) -> None:
    """Draw an inlet: an arrow onto a side, or a ring on the side below or above."""
    middle, side = frame.centre(inlet.site), frame.side
    x, y, z = inlet.face
    if z:
        _ring(axis, np.add(middle, (0.34 * side, -0.32 * side)), z)
        return
    out = np.array([-x, -y])
    start = middle + out * (side / 2 + 0.15)
    _arrow(axis, start, middle + out * side / 2, 1.2)
    nx, ny, _ = frame.shape
    low, high = np.array([frame.left, frame.top]), np.array([nx, ny]) * side
    inside = ((start > low) & (start < low + high)).all()
    if not inside or side > 0.5:
        axis.text(*(start + 0.07 * out), name, weight="bold", ha="center", va="center")


def _ring(axis: Axes, middle: Array, z: int) -> None:
    """Draw the sign of what comes towards the reader, from below, or goes away from him."""
    axis.add_patch(Circle(middle, 0.045, fc="white", ec=INK, lw=0.9))
    if z < 0:
        axis.add_patch(Circle(middle, 0.012, fc=INK, lw=0))
        return
    for slope in (1, -1):
        axis.plot(*(middle + np.outer([-0.03, 0.03], [1, slope])).T, color=INK, lw=0.9)


def _directions(axis: Axes, frame: _Frame) -> None:
    """Draw which way x and y go."""
    nx, ny, _ = frame.shape
    corner = np.array([frame.left + nx * frame.side, frame.top + ny * frame.side])
    for name, way in (("x", np.array([-1, 0])), ("y", np.array([0, -1]))):
        start = corner + 0.1
        _arrow(axis, start, start + (0.1 + 0.3 * frame.side) * way)
        beside = 0.1 + 0.1 * (1 + way) - 0.26 * frame.side * np.abs(way)
        axis.text(*(corner + beside), name, ha="center", va="center")


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
                _seam(axis, *ends, 0.6, lw=5)
                _seam(axis, *ends, 0.4, lw=3.4, color="white")
        elif row == 5:
            _arrow(axis, middle - (0.1, 0), np.add(middle, (0.08, 0)), 1.2)
        else:
            _ring(axis, middle, -1 if "this" in text else 1)
        axis.text(*np.add(middle, (0.19, 0)), text, va="center")


def _groups(column: Column, plan: Plan) -> None:
    """Write where each group's tube goes in and why, with boxes to tick."""
    if plan.problems:
        column.heading("Actuator groups")
    else:
        column.heading("Actuator groups, tubes and leaks")
    phases = plan.design.lattice.phases > 1
    at = (0, 0.5, 0.8, 1.4, 2.55, 6.15, 6.6)
    heads = ["group", "z", "voxels", "inlet", "why there", "slice", "robot"]
    shown = 5 if plan.problems else 7
    column.row(*zip(at[:shown], heads[:shown], strict=True), weight="bold")
    for group in plan.groups:
        inlet, why = "none", "it does not reach the surface"
        if group.inlet is not None:
            place = ",".join(map(str, plan.design.lattice.place(group.inlet.site)))
            inlet, why = f"({place}), {TOWARDS[group.inlet.face]}", group.inlet.why
        if phases:
            why = f"{why}; pumped {group.phase:g} cycles ahead" if group.phase else why
        cells = [group.name, str(group.z), str(len(group.sites)), inlet, why]
        axis, foot = column.row(*zip(at, cells, strict=False), end=at[5])
        for left in at[5:shown]:
            box(axis, LEFT + left + 0.1, foot)
        column.gap(0.2 * LINE)
    if not plan.problems:
        column.gap(0.3 * LINE)
        column.row((0, "Tick what is tight: every slice before it is stacked, then the robot."))
        for i, check in enumerate(LEAK_CHECK, start=1):
            column.row((0, str(i)), (0.22, check))


def _item(column: Column, mark: str, text: str) -> None:
    """Write an item of a list."""
    column.row((0, mark), (0.22, text))
    column.gap(0.25 * LINE)


def _measure(column: Column, plan: Plan, facts: Facts) -> None:
    """Write what to measure beside what is expected."""
    column.heading("What to measure", follows=20 * LINE)
    at = (0, 1.1, 2.05)
    column.row((0, "Mass with tubes, without connectors."))
    column.gap(0.4 * LINE)
    mass = f"{VOXEL_G * plan.design.n_voxels:.1f} g"
    column.row(*zip(at, ("expected", mass, BLANK), strict=True))
    column.gap(0.7 * LINE)
    column.row((0, TRAVEL))
    column.gap(0.4 * LINE)
    cycles = float(Physics.published().cycles)
    column.row(*zip(at, ("", "distance, cm", "heading"), strict=True), weight="bold")
    distance = f"{facts.fitness * VOXEL_CM:.1f} in {cycles:g}"
    column.row(*zip(at, ("simulated", distance, _heading(facts)), strict=True))
    for run in "123":
        column.gap(0.4 * LINE)
        column.row(*zip(at, (f"run {run}", *2 * [BLANK]), strict=True))
    column.gap(0.7 * LINE)
    column.row((0, VOLUME))
    column.gap(0.4 * LINE)
    at = (0, 0.85, 1.4, 1.95, 2.5)
    column.row(*zip(at, ("cycle", *FRACTIONS), strict=True), weight="bold")
    values = [f"{facts.volume_at(moment):.2f}" for moment in MOMENTS]
    column.row(*zip(at, ("simulated", *values), strict=True))
    column.gap(0.4 * LINE)
    column.row(*zip(at, ("measured", *4 * ["_____"]), strict=True))
    column.gap(0.7 * LINE)
    column.row((0, "Notes:"))


def draw_batch(plans: Sequence[Plan], bill: Bill) -> tuple[Figure, ...]:
    """Draw what robots take together: quantities, bill, cures, leaks and how they are measured."""
    with style():
        robots = _count(int(bill.quantities["robots"]), "robot")
        made = Pages(f"Batch of {robots}")
        column = Column(made)
        column.title()
        left, right = column.halves(0.5)
        left.heading("What it takes")
        for what, amount, unit in bill.amounts().cells()[1:]:
            axis, foot = left.row((0, what), (3.05, unit))
            axis.text(LEFT + 2.95, foot, amount, ha="right", va="baseline")
        right.heading("Mould and cures")
        right.row((0, CURES))
        fillings = int(bill.quantities["mould_fillings"])
        at = (0, 0.6, 1.95)
        right.gap(0.4 * LINE)
        right.row(*zip(at, ("filling", "layer 1, from \N{EN DASH} to", "layer 2"), strict=True))
        for filling in range(1, min(fillings, MOST_FILLINGS) + 1):
            right.gap(0.3 * LINE)
            right.row(*zip(at, (f"{filling} of {fillings}", BLANK, BLANK), strict=True))
        column.below(left, right)
        _materials(column, bill)
        _robots(column, plans, int(bill.quantities["robots"]) // max(len(plans), 1))
        column.heading("Leak check, of every slice with active voxels")
        for i, check in enumerate(LEAK_CHECK, start=1):
            column.row((0, str(i)), (0.22, check))
        column.heading("How to measure")
        for i, item in enumerate(MEASUREMENTS, start=1):
            column.row((0, str(i)), (0.22, item))
    return tuple(made.figures)


def _materials(column: Column, bill: Bill) -> None:
    """Write the bill of materials."""
    column.heading("Bill of materials")
    table = bill.materials()
    head, *rows = table.cells()
    ends = np.linspace(4.2, RIGHT - LEFT, len(head) - 1)
    for cells in (head, *rows):
        weight = "bold" if cells is head else "normal"
        axis, foot = column.row((0, cells[0]), end=ends[0] - 0.5, weight=weight)
        for end, cell in zip(ends, cells[1:], strict=True):
            axis.text(LEFT + end, foot, cell, ha="right", va="baseline", weight=weight)
    column.gap(0.3 * LINE)
    words = (
        f"{bill.total_usd:,.2f} USD to buy, in whole packages; {bill.used_usd:,.2f} USD where a "
    )
    column.row((0, f"{words}package counts by the share that is used."))


def _robots(column: Column, plans: Sequence[Plan], copies: int) -> None:
    """Write which robots there are, with a box for each group that is tight."""
    column.heading(f"Robots, {copies} of each; tick the groups that are tight")
    at = (0, 1.2, 3.6, 4.2)
    column.row(*zip(at, ("robot", "digits", "voxels", "groups"), strict=True), weight="bold")
    for plan in plans:
        design, names = plan.design, [group.name for group in plan.groups]
        cells = (_name(design), design.digits, str(design.n_voxels))
        for i in range(0, max(len(names), 1), TICKS):
            axis, foot = column.row(*zip(at, cells if i == 0 else (), strict=False), end=at[3])
            for k, name in enumerate(names[i : i + TICKS]):
                place = LEFT + at[3] + 0.36 * k
                axis.text(place, foot, name, va="baseline")
                box(axis, place + 0.18, foot)
        column.gap(0.2 * LINE)
