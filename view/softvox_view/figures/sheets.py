"""Sheets to build robots from: what a plan says, drawn on A4, beside what the simulator expects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from softvox_gym.build import (
    CURE_MINUTES,
    CURE_MINUTES_ROOM,
    LEAK_CHECK,
    MEASUREMENTS,
    TOWARDS,
    VOXEL_G,
    Bill,
    Plan,
)
from softvox_gym.design import ABSENT, Design
from softvox_gym.physics import Physics
from softvox_gym.real_tracks import heading
from softvox_gym.simulation import simulate
from softvox_view.figures.pages import (
    ASCENT,
    HEIGHT,
    LEFT,
    LINE,
    RIGHT,
    WIDTH,
    Column,
    Pages,
    box,
    label,
    rectangle,
    style,
    write,
)
from softvox_view.figures.robots import relative_volume
from softvox_view.figures.slices import VOXEL_CM, draw_arrow, draw_robot, draw_slices
from softvox_view.figures.style import GREY, INK, PALE

__all__ = ["Facts", "draw_batch", "draw_sheet", "facts_of", "write"]

Array = NDArray[np.float64]

#: Sites along x or y that a sheet has room for.
MOST = 10

#: Inches: of a picture of the robot; degrees: from where it is seen.
PICTURE, AZIMUTHS = 1.45, (-56.0, 124.0)

#: When the volume is measured, cycles.
MOMENTS = {
    0.0: "0",
    0.25: "\N{VULGAR FRACTION ONE QUARTER}",
    0.5: "\N{VULGAR FRACTION ONE HALF}",
    0.75: "\N{VULGAR FRACTION THREE QUARTERS}",
}

#: Where the maker writes.
BLANK = "_" * 12

#: Groups that have their boxes in one line; fillings of the mould that have a line for their cures.
TICKS, MOST_FILLINGS = 8, 10

TICK = ", tubes and leaks: tick the slice when it is tight, then the stacked robot"
TRAVEL = (
    "Travel on cornstarch: 90 actuations at 6 kPa, three times, filmed from above. Headings are "
    "from +x towards +y."
)
VOLUME = "Volume under water at four moments of a cycle, relative to rest."
CURES = (
    f"Two layers a filling. Each cures for 25 min, then {CURE_MINUTES - 25} min at "
    f"60 \N{DEGREE SIGN}C; or for {CURE_MINUTES_ROOM} min at room temperature."
)


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
    if max(plan.design.shape[:2]) > MOST:
        raise ValueError(
            f"a sheet has room for lattices of up to {MOST} sites along x and y, got "
            f"{plan.design.lattice}"
        )
    with style():
        made = Pages(_name(plan.design))
        column = Column(made)
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
    """Write which robot it is, what is wrong with it and what needs care."""
    design, dot = plan.design, " \N{MIDDLE DOT} "
    column.title()
    column.row((0, f"digits {design.digits}{dot}lattice {design.lattice}"))
    kinds = f"{design.n_active} active, {design.n_voxels - design.n_active} passive"
    parts = [f"{_count(design.n_voxels, 'voxel')} of {VOXEL_CM:g} cm: {kinds}"]
    parts += [_count(len(plan.groups), "actuator group")]
    parts += [f"{_count(len(plan.holes), 'hole')} to punch"]
    column.row((0, dot.join(parts)))
    if plan.problems:
        column.gap(0.5 * LINE)
        page, top = column.page, column.top
        column.gap(0.4 * LINE)
        column.row((0.12, "This robot can't be built with the kit:"), weight="bold")
        for problem in plan.problems:
            column.row((0.12, "\N{BULLET}"), (0.24, problem), end=RIGHT - LEFT)
        column.gap(0.4 * LINE)
        high = column.top - top if column.page == page else HEIGHT
        rectangle(column.pages.axis(page), (LEFT, top), RIGHT - LEFT, high, lw=1.6)
    for warning in plan.warnings:
        column.row((0, f"Take care: {warning}."))
    column.gap(0.5 * LINE)


def _pictures(column: Column, plan: Plan, facts: Facts) -> None:
    """Draw the robot from two sides, where the simulator sends it, and its volume."""
    axis, top = column.room(LINE + PICTURE + LINE)
    lefts = np.linspace(LEFT, RIGHT - PICTURE, 4)
    words = ["from +x, \N{MINUS SIGN}y, above", "from \N{MINUS SIGN}x, +y, above"]
    words += ["simulated, from above", "volume / volume at rest"]
    for left, text in zip(lefts, words, strict=True):
        label(axis, (left + PICTURE / 2, top + ASCENT), text, va="baseline")
    for left, azimuth in zip(lefts, AZIMUTHS, strict=False):
        draw_robot(axis, plan, azimuth, np.array([left, top + LINE]), PICTURE)
    _map(axis, plan.design, facts, lefts[2], top + LINE)
    if plan.design.n_voxels and np.isfinite(facts.volume).all():
        _volume(axis, facts, lefts[3], top + LINE)


def _map(axis: Axes, design: Design, facts: Facts, left: float, top: float) -> None:
    """Draw, from above, where the robot stands and where it travels."""
    side = PICTURE - LINE - 0.1
    left += (PICTURE - side) / 2
    rectangle(axis, (left, top), side, side, ec=GREY, lw=0.6)
    nx, ny, _ = design.shape
    way = np.zeros(2)
    if facts.heading is not None:
        angle = math.radians(facts.heading)
        way = facts.fitness * np.array([math.cos(angle), math.sin(angle)])
    middle = np.array([nx, ny]) / 2
    ends = np.array([[0, 0], [nx, ny], middle + way])
    low, high = ends.min(axis=0), ends.max(axis=0)
    scale = side / (1.2 * (high - low).max() + 0.8)

    def place(points: ArrayLike) -> Array:
        moved = (np.asarray(points) - (low + high) / 2) * (scale, -scale)
        return np.asarray(np.add(moved, (left + side / 2, top + side / 2)))

    for x, y in np.argwhere((design.array != ABSENT).any(axis=2)):
        rectangle(axis, place((x, y + 1)), scale, scale, fc=PALE, ec="white", lw=0.4)
    if facts.heading is not None:
        draw_arrow(axis, place(middle), place(middle + way), 1.4)
    for text, end, shift in (("x", (0.3, 0), (0.06, 0)), ("y", (0, -0.3), (0, -0.06))):
        start = np.array([left + 0.08, top + side - 0.08])
        draw_arrow(axis, start, start + end, 0.6)
        label(axis, start + end + shift, text)
    words = f"{facts.fitness:.2f} voxel widths, {_heading(facts)}"
    if math.isnan(facts.fitness):
        words = "the simulation diverges"
    label(axis, (left + side / 2, top + side + LINE), words, va="baseline", weight="bold")


def _volume(axis: Axes, facts: Facts, left: float, top: float) -> None:
    """Draw the volume over a cycle, with the moments at which it is measured."""
    side = PICTURE - LINE - 0.1
    bounds = (left + 0.3) / WIDTH, 1 - (top + side) / HEIGHT, (PICTURE - 0.36) / WIDTH
    figure = axis.figure
    own = figure.add_axes((*bounds, side / HEIGHT))
    own.plot(facts.cycle, facts.volume, color=INK, lw=1.2)
    values = [facts.volume_at(moment) for moment in MOMENTS]
    own.plot([*MOMENTS], values, "o", ms=4.5, mfc="white", mec=INK, clip_on=False, zorder=3)
    own.axhline(1, color=PALE, lw=0.8, zorder=0)
    own.set(xlim=(0, 1), ylim=(0.85, 2))
    own.set_xticks([*MOMENTS, 1], [*MOMENTS.values(), "1"])
    own.set_yticks([1, 1.5])
    own.set_xlabel("cycle; \N{WHITE CIRCLE} measured", labelpad=1)


def _groups(column: Column, plan: Plan) -> None:
    """Write where each group's tube goes in and why, with boxes to tick."""
    column.heading("Actuator groups" + ("" if plan.problems else TICK))
    at = (0, 0.5, 0.8, 1.4, 2.55, 6.15, 6.6)[: 5 if plan.problems else 7]
    rows = [["group", "z", "voxels", "inlet", "why there"]]
    for group in plan.groups:
        inlet, why = "none", "it does not reach the surface"
        if group.inlet is not None:
            place = ",".join(map(str, plan.design.lattice.place(group.inlet.site)))
            inlet, why = f"({place}), {TOWARDS[group.inlet.face]}", group.inlet.why
        if group.phase:
            why += f"; pumped {group.phase:g} cycles ahead"
        rows.append([group.name, str(group.z), str(len(group.sites)), inlet, why])
    places = column.table(at, *rows, end=6.15, gap=0.2)
    for left, word in zip(at[5:], ("slice", "robot"), strict=False):
        axis, foot = places[0]
        axis.text(LEFT + left, foot, word, weight="bold", va="baseline")
        for axis, foot in places[1:]:
            box(axis, LEFT + left + 0.1, foot)
    if not plan.problems:
        column.gap(0.5 * LINE)
        column.numbered(LEAK_CHECK)


def _measure(column: Column, plan: Plan, facts: Facts) -> None:
    """Write what to measure beside what is expected."""
    column.heading("What to measure", follows=20 * LINE)
    at = (0, 1.25, 2.1)
    mass = f"{VOXEL_G * plan.design.n_voxels:.1f} g"
    column.table(at, ["", "expected", "measured"], ["mass with tubes", mass, BLANK], gap=0.2)
    column.gap(0.7 * LINE)
    column.row((0, TRAVEL))
    column.gap(0.4 * LINE)
    cycles = float(Physics.published().cycles)
    told = f"simulated, {cycles:g} cycles", f"{facts.fitness * VOXEL_CM:.1f}", _heading(facts)
    rows = [["", "travel, cm", "heading"], [*told]]
    column.table(at, *rows, *([f"run {run}", BLANK, BLANK] for run in "123"), gap=0.3)
    column.gap(0.7 * LINE)
    column.row((0, VOLUME))
    column.gap(0.4 * LINE)
    values = [f"{facts.volume_at(moment):.2f}" for moment in MOMENTS]
    rows = [["cycle", *MOMENTS.values()], ["simulated", *values], ["measured", *4 * ["_____"]]]
    column.table((0, 0.85, 1.4, 1.95, 2.5), *rows, gap=0.3)
    column.gap(0.7 * LINE)
    column.row((0, "Notes:"))


def draw_batch(plans: Sequence[Plan], bill: Bill) -> tuple[Figure, ...]:
    """Draw what robots take together: amounts, bill, cures, leaks, and how they are measured."""
    robots = int(bill.quantities["robots"])
    with style():
        made = Pages(f"Batch of {_count(robots, 'robot')}")
        column = Column(made)
        column.title()
        left, right = column.halves(0.5)
        left.heading("What it takes")
        for what, amount, unit in bill.amounts().cells()[1:]:
            axis, foot = left.row((0, what), end=2.5)
            axis.text(LEFT + 2.95, foot, amount, ha="right", va="baseline")
            axis.text(LEFT + 3.05, foot, unit, va="baseline")
        _cures(right, int(bill.quantities["mould_fillings"]))
        column.below(left, right)
        _materials(column, bill)
        _robots(column, plans, robots // max(len(plans), 1))
        column.heading("Leak check, of every slice with active voxels")
        column.numbered(LEAK_CHECK)
        column.heading("How to measure")
        column.numbered(MEASUREMENTS)
    return tuple(made.figures)


def _cures(column: Column, fillings: int) -> None:
    """Write when the fillings of the mould cure, with room to note it."""
    column.heading("Mould and cures")
    column.row((0, CURES))
    column.gap(0.4 * LINE)
    rows = [["filling", "layer 1, from \N{EN DASH} to", "layer 2, from \N{EN DASH} to"]]
    for filling in range(1, min(fillings, MOST_FILLINGS) + 1):
        rows.append([f"{filling} of {fillings}", *2 * [BLANK + BLANK[:6]]])
    column.table((0, 0.75, 2.1), *rows, gap=0.25)


def _materials(column: Column, bill: Bill) -> None:
    """Write the bill of materials."""
    column.heading("Bill of materials")
    rows = bill.materials().cells()
    ends = np.linspace(4.2, RIGHT - LEFT, len(rows[0]) - 1)
    for i, (axis, foot) in enumerate(column.table([0], *rows, end=3.7)):
        for end, cell in zip(ends, rows[i][1:], strict=True):
            weight = "normal" if i else "bold"
            axis.text(LEFT + end, foot, cell, ha="right", va="baseline", weight=weight)
    column.gap(0.3 * LINE)
    bought = f"{bill.total_usd:,.2f} USD to buy, in whole packages"
    used = f"{bill.used_usd:,.2f} USD where a package counts by the share that is used"
    column.row((0, f"{bought}; {used}."))


def _robots(column: Column, plans: Sequence[Plan], copies: int) -> None:
    """Write which robots there are, with a box for each group that is tight."""
    column.heading(f"Robots, {copies} of each; tick the groups that are tight")
    at = (0, 1.5, 3.6, 4.2)
    column.table(at, ("robot", "digits", "voxels", "groups"))
    column.gap(0.2 * LINE)
    for plan in plans:
        names = [group.name for group in plan.groups]
        cells = (
            _name(plan.design).removeprefix("Robot "),
            plan.design.digits,
            str(plan.design.n_voxels),
        )
        for i in range(0, max(len(names), 1), TICKS):
            axis, foot = column.row(*zip(at, cells if i == 0 else (), strict=False), end=at[3])
            for k, name in enumerate(names[i : i + TICKS]):
                left = LEFT + at[3] + 0.4 * k
                axis.text(left, foot, name, va="baseline")
                box(axis, left + 0.18, foot)
        column.gap(0.2 * LINE)
