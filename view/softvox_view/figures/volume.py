"""The volume of a voxel and of robots over one cycle of actuation (Fig. 7'')."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, Design
from softvox_gym.physics import ACTUATIONS, Physics
from softvox_gym.simulation import simulate
from softvox_view.figures import Inputs, style
from softvox_view.figures.robots import best_of_bodies

#: The cycle shown, counted from 0: the first one starts from rest; time steps between frames.
CYCLE, EVERY = 1, 2

#: By mode: an own line and lightness.
LOOKS = {
    "hold": {"color": "#000000", "ls": "-", "lw": 1.6},
    "clamp": {"color": "#D55E00", "ls": "--", "lw": 1.4},
    "expand_and_contract": {"color": "#56B4E9", "ls": "-.", "lw": 1.4},
}

Array = NDArray[np.float64]


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
    return cycle[shown], cubes.sum(axis=sites) / present.sum(axis=sites)


def draw_volume(_: Inputs) -> Figure:
    """Draw an active voxel under each mode, and the best of nine bodies under the paper's."""
    made = style.figure(style.WIDTH, 0.4 * style.WIDTH)
    left, right = made.subplots(1, 2, sharey=True, width_ratios=(1, 1.12))
    for mode in ACTUATIONS:
        time, volume = relative_volume([Design("20000000")], mode)
        left.plot(time, volume[0], label=mode.replace("_", " "), **LOOKS[mode])
    left.legend(loc="upper right")
    left.set_title("a\N{DOUBLE PRIME}  one active voxel, by mode of actuation", loc="left")
    left.set_ylabel("volume relative to rest")
    # A line per share of active voxels; robots that share it lie on each other.
    designs = best_of_bodies()
    time, volume = relative_volume(designs)
    shares = np.array([Fraction(design.n_active, design.n_voxels) for design in designs])
    for line, share in enumerate(sorted(set(shares), reverse=True)):
        places = np.flatnonzero(shares == share)
        names = ", ".join(str(designs[i].index) for i in places)
        looks = {"color": str(0.14 * line), "ls": ("-", "--", "-.", ":")[line % 4], "lw": 1.3}
        right.plot(time, volume[places[0]], label=f"{share} active: {names}", **looks)
    right.legend(loc="upper right", fontsize=style.TINY, handlelength=2.6)
    right.set_title("b\N{DOUBLE PRIME}  the best of nine bodies, mode hold", loc="left")
    for axis in (left, right):
        axis.set_xlabel("time, cycles")
        axis.spines[["top", "right"]].set_visible(False)
        axis.axhline(1, color=style.PALE, lw=0.8, zorder=0)
        axis.set_xlim(0, 1)
    return made
