"""Robots as built, the published gallery of them, and their volume over a cycle of actuation."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

import softvox_gym
from softvox_gym.design import ABSENT, Design
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.landscapes.analysis.graph import all_digits
from softvox_gym.landscapes.analysis.symmetry import symmetries
from softvox_gym.motion import rest_pose
from softvox_gym.physics import ACTUATIONS, Physics
from softvox_gym.rendering import ACTIVE, PASSIVE, render
from softvox_gym.simulation import simulate
from softvox_view.figures import Inputs, style

Array = NDArray[np.float64]

BODIES = 9

#: Voxel widths from the camera to the middle of the lattice, which then fills the picture.
DISTANCE = 6.6
MIDDLE = (1.0, 1.0, 0.86)

#: Columns of the gallery, and of the gallery with one robot per class.
ACROSS, ACROSS_CLASSES = 10, 8

#: Inches: the two lines under a picture; the strip of floor cut off at its sides; the key above
#: all pictures.
CAPTION, MARGIN, HEAD = 0.28, 0.015, 0.26

#: The cycle shown, counted from 0 (the first starts from rest); time steps between frames.
CYCLE, EVERY = 1, 2

#: Line style and lightness of each mode.
LOOKS = {
    "hold": {"color": "#000000", "ls": "-", "lw": 1.6},
    "clamp": {"color": "#D55E00", "ls": "--", "lw": 1.4},
    "expand_and_contract": {"color": "#56B4E9", "ls": "-.", "lw": 1.4},
}


@lru_cache(maxsize=1)
def best_of_bodies() -> tuple[Design, ...]:
    """Return the fittest design of each of nine bodies, fittest first.

    A body is the set of filled sites, whatever fills them; bodies turned about the vertical or
    mirrored are the same. The nine are those with the fittest designs.
    """
    filled = (all_digits() > 0).astype(np.int64)
    bodies = np.min([filled[:, order] @ (1 << np.arange(8)) for order in symmetries()], axis=0)
    best: dict[int, Design] = {}
    for number in np.argsort(-softvox_gym.landscape()["fitness"], kind="stable"):
        best.setdefault(int(bodies[number]), Design(int(number)))
        if len(best) == BODIES:
            break
    return tuple(best.values())


@lru_cache(maxsize=512)
def picture(design: Design, size: int) -> NDArray[np.uint8]:
    """Return a picture of a design as built, with the given number of pixels along a side.

    Read-only. All designs of a lattice are seen from the same place, so sites can be compared.
    """
    look_at = (np.multiply(MIDDLE, design.shape) / 2).tolist()
    distance = DISTANCE * max(design.shape) / 2
    made: NDArray[Any] = render(
        rest_pose(design.array), width=size, height=size, look_at=look_at, distance=distance
    )
    made.flags.writeable = False
    return made


def published() -> list[tuple[Design, str]]:
    """Return the published top hundred in order: each design and its fitness as printed."""
    path = files("softvox_gym") / "data" / "authors" / "published_top100.csv"
    rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    return [(Design(int(row["design"])), row["fitness"]) for row in rows]


def draw_gallery(inputs: Inputs) -> Figure:
    """Draw robots as built, in the paper's order, each with its fitness, rank and number.

    These are all of the published hundred, or the first of each symmetry class among them.
    """
    robots = [(rank, *robot) for rank, robot in enumerate(published(), start=1)]
    class_of, across = symmetry_classes(), ACROSS
    members = Counter(class_of[design.index] for _, design, _ in robots)
    if inputs.one_per_class:
        firsts = np.unique([class_of[one[1].index] for one in robots], return_index=True)[1]
        robots, across = [robots[i] for i in sorted(firsts)], ACROSS_CLASSES
    side = style.WIDTH / across
    height = HEAD + -(-len(robots) // across) * (side + CAPTION)
    made = style.figure(style.WIDTH, height, layout=None)
    axis = made.add_axes((0, 0, 1, 1))
    under: dict[str, Any] = {"ha": "center", "va": "top", "size": style.SMALL}
    for i, (rank, design, fitness) in enumerate(robots):
        x, top = (i % across + 0.5) * side, HEAD + i // across * (side + CAPTION)
        half, foot = side / 2 - MARGIN, top + side
        shown = picture(design, round(style.DPI * side))
        extent = (x - half, x + half, top + side - MARGIN, top + MARGIN)
        axis.imshow(shown, extent=extent, interpolation="antialiased")
        axis.text(x, foot + 0.01, fitness, weight="bold", **under)
        words = f"{rank}: {design.index}"
        if inputs.one_per_class:
            words += f" \N{MULTIPLICATION SIGN}{members[class_of[design.index]]}"
        axis.text(x, foot + 0.135, words, **under)
    axis.set(xlim=(0, style.WIDTH), ylim=(height, 0))
    axis.set_axis_off()
    for x, name, colour in ((0.02, "passive", PASSIVE), (0.72, "active", ACTIVE)):
        axis.add_patch(Rectangle((x, 0.07), 0.12, 0.12, fc=colour, ec=style.INK, lw=0.6))
        axis.text(x + 0.17, 0.13, name, va="center", size=style.SMALL)
    key = "bold: fitness, voxel widths; below: rank, number of the design"
    if inputs.one_per_class:
        key += ", \N{MULTIPLICATION SIGN} designs of its class in the hundred"
    axis.text(style.WIDTH - 0.02, 0.13, key, ha="right", va="center", size=style.SMALL)
    return made


def relative_volume(designs: Sequence[Design], actuation: str = "hold") -> tuple[Array, Array]:
    """Return times (k,), 0 to 1 cycles, and volumes (n, k): cubed edges, relative to rest."""
    physics = replace(Physics.published(), actuation=actuation).lasting(CYCLE + 2)
    result = simulate(designs, physics, frames=EVERY)
    frames = result.frames
    assert frames is not None
    cycle = (frames.time[0] - physics.settle_time) * float(physics.frequency_hz) - CYCLE
    shown = (cycle >= 0) & (cycle <= 1)
    present = result.designs[:, np.newaxis] != ABSENT
    cubes = np.where(present, (frames.edge[:, shown] / physics.edge) ** 3, 0.0)
    sites = (-3, -2, -1)
    return cycle[shown], cubes.sum(axis=sites) / np.maximum(present.sum(axis=sites), 1)


def draw_volume(_: Inputs) -> Figure:
    """Draw an active voxel in each mode, and the best of nine bodies in the paper's mode."""
    physics = Physics.published()
    made = style.figure(style.WIDTH, 0.42 * style.WIDTH)
    left, right = made.subplots(1, 2, sharey=True, width_ratios=(1, 1.12))
    for mode in ACTUATIONS:
        time, volume = relative_volume([Design("20000000")], mode)
        left.plot(time, volume[0], label=mode.replace("_", " "), **LOOKS[mode])
    left.legend(loc="upper right")
    left.set_title("a  one active voxel, by mode of actuation", loc="left")
    rest = (100 * physics.edge) ** 3
    left.set_ylabel(f"volume / volume at rest (1: {rest:.3g} cm\N{SUPERSCRIPT THREE} a voxel)")
    peak = f"{volume.max():.2f}, pumped up"
    left.annotate(
        peak, (0.25, volume.max()), xytext=(0, 4), textcoords="offset points", ha="center"
    )
    left.annotate("1, at rest", (1, 1), xytext=(0, 4), textcoords="offset points", ha="right")
    # One line per share of active voxels, as the lines of robots with the same share coincide.
    designs = best_of_bodies()
    time, volume = relative_volume(designs)
    shares = np.array([Fraction(design.n_active, design.n_voxels) for design in designs])
    for line, share in enumerate(sorted(set(shares), reverse=True)):
        places = np.flatnonzero(shares == share)
        names = ", ".join(str(designs[i].index) for i in places)
        looks = {"color": str(0.14 * line), "ls": ("-", "--", "-.", ":")[line % 4], "lw": 1.3}
        label = f"{share} active, to {volume[places[0]].max():.2f}: {names}"
        right.plot(time, volume[places[0]], label=label, **looks)
    right.legend(loc="upper right", handlelength=2.6)
    right.set_title("b  the best of nine bodies, mode hold", loc="left")
    for axis in (left, right):
        axis.set_xlabel(f"time, cycles of {1 / float(physics.frequency_hz):.3g} s")
        axis.set_ylim(0.3, 2.3)
        axis.spines[["top", "right"]].set_visible(False)
        axis.axhline(1, color=style.PALE, lw=0.8, zorder=0)
        axis.set_xlim(0, 1)
    return made
