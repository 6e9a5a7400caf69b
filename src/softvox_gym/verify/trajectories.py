"""Comparison of the trajectories of every voxel, not only of the final displacement."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softvox_gym.data import Records, numbers, records, trajectory_names
from softvox_gym.physics import Physics
from softvox_gym.simulation import Frames, simulate
from softvox_gym.verify.agreement import UNJUDGED, Row, differences, judge

#: The files have some of the steps up to the first number, then every `COARSE`-th.
LAST_FINE_STEP, COARSE = 564, 100


def trajectories(
    sensitive: Collection[int], tolerance: float, *, threads: int | None = None
) -> Iterator[Row]:
    """Compare positions and edges of every voxel, in voxel widths, with the reference trajectories.

    Each design runs at the time step of its file: a tenth of the usual one for designs whose voxels
    do not touch. Sensitive designs are only reported.
    """
    names = trajectory_names()
    files = [records(f"trajectories/{name}.csv") for name in names]
    step = np.array([_time_step(file) for file in files])
    published = Physics.published()
    fraction = published.time_step_fraction * np.rint(10 * step / published.time_step) / 10
    physics = replace(published, time_step_fraction=fraction)
    actuation_starts = replace(physics, duration=published.settle_time + 0.01)

    designs = [int(name) for name in names]
    fine = simulate(designs, actuation_starts, frames=1, threads=threads).frames
    coarse = simulate(designs, physics, frames=COARSE, threads=threads).frames
    assert fine is not None
    assert coarse is not None
    found = [_rows(fine, coarse, i, file) / published.edge for i, file in enumerate(files)]
    wanted = [numbers(file, "x", "y", "z", "edge") / published.edge for file in files]
    difference = [differences(*pair) for pair in zip(found, wanted, strict=True)]

    steady = [d for d, design in zip(difference, designs, strict=True) if design not in sensitive]
    yield judge("trajectories", np.concatenate(steady), tolerance, note="every voxel")
    for design, each in zip(designs, difference, strict=True):
        if design in sensitive:
            name = f"trajectory {design}"
            yield judge(name, each, tolerance, verdicts=UNJUDGED, note="sensitive")


def _time_step(file: Records) -> float:
    return next(float(row["time"]) for row in file if row["step"] == "1")


def _rows(fine: Frames, coarse: Frames, design: int, file: Records) -> NDArray[np.float64]:
    """Return x, y, z, edge in m for every row of a file."""
    rows = []
    for row in file:
        step, site = int(row["step"]), int(row["voxel"])
        frames, k = (fine, step) if step <= LAST_FINE_STEP else (coarse, step // COARSE)
        at = (design, k, site % 2, site // 2 % 2, site // 4)
        rows.append([*frames.position[at], frames.edge[at]])
    return np.array(rows)
