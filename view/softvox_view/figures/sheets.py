"""Building sheets for robots: a plan, drawn on A4, with the simulator's expectations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from softvox_gym.build.bills import VOXEL_G, Bill
from softvox_gym.build.plans import (
    LEAK_CHECK,
    MEASUREMENTS,
    PER_GROUP,
    TOWARDS,
    Plan,
    digits_of,
    places,
)
from softvox_gym.design import ABSENT, Design
from softvox_gym.physics import Physics
from softvox_gym.real_tracks import VOXEL_CM, heading
from softvox_gym.simulation import simulate
from softvox_view.figures.pages import (
    ASCENT,
    HEIGHT,
    LEFT,
    LINE,
    RIGHT,
    WIDTH,
    Column,
    box,
    label,
    style,
    write,
)
from softvox_view.figures.robots import relative_volume
from softvox_view.figures.slices import draw_arrow, draw_robot, draw_slices
from softvox_view.figures.style import GREY, INK, PALE

__all__ = ["Facts", "draw_batch", "draw_sheet", "facts_of", "write"]

Array = NDArray[np.float64]

#: The most sites along x or y that have room on a sheet.
MOST = 10

#: Inches: a picture of the robot, and a panel; degrees: the views of the robot.
PICTURE, PANEL, AZIMUTHS = 1.45, 1.21, (-56.0, 124.0)

#: Moments at which the volume is measured, cycles.
MOMENTS = {0.0: "0", 0.25: "\xbc", 0.5: "\xbd", 0.75: "\xbe"}

#: A blank for the builder to fill in.
BLANK = "_" * 12

TRAVEL = (
    "Travel on cornstarch: 90 actuations at 6 kPa, three times, filmed from above. Headings are "
    "from +x towards +y."
)


@dataclass(frozen=True, eq=False)
class Facts:
    """The simulator's expectations of a robot under the published physics.

    Fitness in voxel widths, NaN if it diverges; heading in degrees from +x towards +y, None if it
    hardly moves; and its volume relative to rest, at moments of a cycle (0 to 1, shape (k,)).
    """

    fitness: float
    heading: float | None
    cycle: Array
    volume: Array

    def volume_at(self, moment: float) -> float:
        """Return the relative volume at a moment, cycles."""
        return float(np.interp(moment, self.cycle, self.volume))

    @property
    def way(self) -> str:
        """The heading in words, rounded."""
        if self.heading is None:
            return "no heading"
        return f"{self.heading:z.0f}\N{DEGREE SIGN}".replace("-", "\N{MINUS SIGN}")


def facts_of(designs: Sequence[Design]) -> list[Facts]:
    """Return the simulator's expectations of designs of one lattice, simulated in one batch."""
    result = simulate(designs)
    cycle, volume = relative_volume(designs)
    ways = [heading(moved[:2]) for moved in result.displacement]
    return [
        Facts(float(fitness), None if math.isnan(way) else way, cycle, own)
        for fitness, way, own in zip(result.fitness, ways, volume, strict=True)
    ]


def draw_sheet(plan: Plan, facts: Facts) -> tuple[Figure, ...]:
    """Draw the sheet of a robot: one A4 page, or more for a large robot.

    Raises
    ------
    ValueError
        If the lattice has more than `MOST` sites along x or y.
    """
    if max(plan.design.shape[:2]) > MOST:
        raise ValueError(
            f"a sheet has room for lattices of up to {MOST} sites along x and y, got "
            f"{plan.design.lattice}"
        )
    with style():
        column = Column(_name(plan.design))
        _head(column, plan)
        _pictures(column, plan, facts)
        draw_slices(column, plan)
        if plan.groups:
            _groups(column, plan)
        if not plan.problems:
            left, right = column.halves(0.56)
            left.heading("Order of assembly", follows=6 * LINE)
            left.numbered(plan.steps, gap=0.25)
            _measure(right, plan, facts)
    return tuple(column.figures)


def _name(design: Design) -> str:
    """Return a robot's name: its number, or its lattice if the number is long."""
    number = str(design.index)
    return f"Robot {number}" if len(number) <= 13 else f"Robot on {design.lattice}"


def _head(column: Column, plan: Plan) -> None:
    """Write which robot it is, its faults, and what needs care."""
    design, groups = plan.design, len(plan.groups)
    column.head()
    column.row((0, f"digits {digits_of(design)}, lattice {design.lattice}"))
    parts = [
        f"voxels of {VOXEL_CM:g} cm: {design.n_active} active, "
        f"{design.n_voxels - design.n_active} passive",
        f"actuator groups, a tube each: {groups}",
        f"connectors: {groups * PER_GROUP['connectors']}",
        f"holes to punch: {len(plan.holes)}",
    ]
    column.row((0, " \N{MIDDLE DOT} ".join(parts)))
    if plan.problems:
        column.heading("This robot can't be built with the kit")
        for problem in plan.problems:
            column.row((0, "\N{BULLET}"), (0.12, problem))
    for warning in plan.warnings:
        column.row((0, f"Take care: {warning}."))
    column.gap(0.5 * LINE)


def _pictures(column: Column, plan: Plan, facts: Facts) -> None:
    """Draw the robot from two sides, its simulated path, and its volume."""
    axis, top = column.room(LINE + PICTURE + LINE)
    lefts = np.linspace(LEFT, RIGHT - PICTURE, 4)
    words = ["from +x, \N{MINUS SIGN}y, above", "from \N{MINUS SIGN}x, +y, above"]
    words += ["simulated, from above", "volume / volume at rest"]
    for left, text in zip(lefts, words, strict=True):
        label(axis, (left + PICTURE / 2, top + ASCENT), text, va="baseline")
    for left, azimuth in zip(lefts, AZIMUTHS, strict=False):
        draw_robot(axis, plan, azimuth, np.array([left, top + LINE]), PICTURE)
    foot = 1 - (top + LINE + PANEL) / HEIGHT
    for left, draw in ((lefts[2] + (PICTURE - PANEL) / 2, _map), (lefts[3] + 0.19, _volume)):
        if draw == _map or (plan.design.n_voxels and np.isfinite(facts.volume).all()):
            bounds = left / WIDTH, foot, PANEL / WIDTH, PANEL / HEIGHT
            draw(axis.figure.add_axes(bounds), plan.design, facts)


def _map(own: Axes, design: Design, facts: Facts) -> None:
    """Draw, from above, the robot's place and its path."""
    nx, ny, _ = design.shape
    middle = np.array([nx, ny]) / 2
    angle = math.radians(facts.heading or 0)
    still = facts.heading is None
    way = 0 * middle if still else facts.fitness * np.array([math.cos(angle), math.sin(angle)])
    ends = np.array([[0, 0], [nx, ny], middle + way])
    low, high = ends.min(axis=0), ends.max(axis=0)
    half = 0.6 * (high - low).max() + 0.4
    for place in np.argwhere((design.array != ABSENT).any(axis=2)):
        own.add_patch(Rectangle(tuple(place), 1, 1, fc=PALE, ec="white", lw=0.4))
    if not still:
        draw_arrow(own, middle, middle + way, 1.4)
    corner = (low + high) / 2 - 0.87 * half
    for name, end in zip("xy", 0.5 * half * np.eye(2), strict=True):
        draw_arrow(own, corner, corner + end, 0.6)
        label(own, corner + 1.25 * end, name)
    words = f"{facts.fitness:.2f} voxel widths, {facts.way}"
    words = "the simulation diverges" if math.isnan(facts.fitness) else words
    own.set_xlabel(words, weight="bold")
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    own.set(xlim=(left, right), ylim=(bottom, top), xticks=[], yticks=[])
    own.spines[:].set(visible=True, color=GREY, lw=0.6)


def _volume(own: Axes, _: Design, facts: Facts) -> None:
    """Draw the volume over a cycle, with the moments at which it is measured."""
    own.plot(facts.cycle, facts.volume, color=INK, lw=1.2)
    values = [facts.volume_at(moment) for moment in MOMENTS]
    own.plot([*MOMENTS], values, "o", ms=4.5, mfc="white", mec=INK, clip_on=False, zorder=3)
    own.axhline(1, color=PALE, lw=0.8, zorder=0)
    own.set(xlim=(0, 1), ylim=(0.85, 2))
    own.set_xticks([*MOMENTS, 1], [*MOMENTS.values(), "1"])
    own.set_yticks([1, 1.5])
    own.set_xlabel("cycle; \N{WHITE CIRCLE} measured", labelpad=1)


def _groups(column: Column, plan: Plan) -> None:
    """Write where each group's tube goes in and why, with checkboxes."""
    ticks = ("slice", "robot") if not plan.problems else ()
    column.heading(
        "Actuator groups, tubes and leaks: tick the slice when it is tight, then the stacked robot"
        if ticks
        else "Actuator groups"
    )
    at = (0, 0.45, 0.7, 1.2, 2.45, 6.2, 6.65)
    rows = [("group", "z", "voxels", "inlet", "why there", *ticks)]
    for group in plan.groups:
        inlet, why = "none", "it does not reach the surface"
        if group.inlet:
            where = places(plan.design, [group.inlet.site])
            inlet, why = f"{where}, {TOWARDS[group.inlet.face]}", group.inlet.why
        if group.phase:
            why += f"; pumped {group.phase:g} cycles ahead"
        rows.append((group.name, str(group.z), str(len(group.sites)), inlet, why))
    for i, (axis, foot) in enumerate(column.table(at, *rows, end=at[5], gap=0.2)):
        for left in at[5:] if i and ticks else ():
            box(axis, LEFT + left + 0.1, foot)
    if ticks:
        column.gap(0.5 * LINE)
        column.numbered(LEAK_CHECK)


def _measure(column: Column, plan: Plan, facts: Facts) -> None:
    """Write the values to measure beside the expected ones."""
    column.heading("What to measure", follows=20 * LINE)
    at = (0, 1.25, 2.1)
    mass = f"{VOXEL_G * plan.design.n_voxels:.1f} g"
    column.table(at, ["", "expected", "measured"], ["mass with tubes", mass, BLANK], gap=0.2)
    column.gap(0.7 * LINE)
    column.row((0, TRAVEL))
    column.gap(0.4 * LINE)
    cycles, travel = float(Physics.published().cycles), f"{facts.fitness * VOXEL_CM:.1f}"
    rows = [["", "travel, cm", "heading"], [f"simulated, {cycles:g} cycles", travel, facts.way]]
    column.table(at, *rows, *([f"run {run}", BLANK, BLANK] for run in "123"), gap=0.3)
    column.gap(0.7 * LINE)
    column.row((0, "Volume under water at four moments of a cycle, relative to rest."))
    column.gap(0.4 * LINE)
    values = [f"{facts.volume_at(moment):.2f}" for moment in MOMENTS]
    rows = [["cycle", *MOMENTS.values()], ["simulated", *values], ["measured", *4 * ["_____"]]]
    column.table((0, 0.85, 1.4, 1.95, 2.5), *rows, gap=0.3)
    column.gap(0.7 * LINE)
    column.row((0, "Notes:"))


def draw_batch(plans: Sequence[Plan], bill: Bill) -> tuple[Figure, ...]:
    """Draw the batch: amounts and bill of all robots, and how to measure them."""
    robots = int(bill.quantities["robots"])
    copies = robots // max(len(plans), 1)
    with style():
        column = Column(f"Batch of {robots} robot{'s' * (robots != 1)}")
        column.head()
        left, right = column.halves(0.44)
        left.heading("What it takes")
        _figures(left, bill.amounts().cells()[1:], [2.9], is_headed=False)
        right.heading("How to measure")
        right.numbered(MEASUREMENTS)
        column.below(left, right)
        column.heading("Bill of materials")
        materials = bill.materials()
        _figures(column, materials.cells(), np.linspace(4.2, RIGHT - LEFT, 5).tolist())
        column.gap(0.3 * LINE)
        column.row((0, materials.text().splitlines()[-1] + "."))
        column.heading(f"Robots, {copies} of each")
        rows = [
            (
                _name(one.design).removeprefix("Robot "),
                digits_of(one.design),
                *(str(n) for n in (one.design.n_voxels, one.design.n_active, len(one.groups))),
            )
            for one in plans
        ]
        titles = ("robot", "digits", "voxels", "active", "groups")
        column.table((0, 1.5, 4.8, 5.5, 6.2), titles, *rows)
    return tuple(column.figures)


def _figures(
    column: Column, rows: Sequence[Sequence[str]], ends: Sequence[float], is_headed: bool = True
) -> None:
    """Write rows of a text and of numbers; the numbers end at given offsets from the left side."""
    for i, (words, *figures) in enumerate(rows):
        weight = "bold" if is_headed and i == 0 else "normal"
        axis, foot = column.row((0, words), end=ends[0] - 0.5, weight=weight)
        for end, text in zip(ends, figures, strict=True):
            axis.text(column.left + end, foot, text, ha="right", va="baseline", weight=weight)
