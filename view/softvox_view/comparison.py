"""How far real robots went another way than simulated ones."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_view.tracks_csv import RealTrack

#: Voxel widths, which are cm for the paper's voxel of 1 cm: what travels less has no heading to
#: speak of. Robots that get nowhere sway by up to 0.18 within a cycle.
LITTLE = 0.25

#: The table for people.
HEAD = (
    "design  trial         cycles   heading    real   angle  distance    real  end error  RMS error"
)
ROW = "{:6}  {:12}  {:6.4g}  {:8.1f}  {:6.1f}  {:6.1f}  {:8.2f}  {:6.2f}  {:9.2f}  {:9.2f}"
FOOT = f"headings and angles in degrees (nan: went less than {LITTLE:g}), the rest in cm"

Array = NDArray[np.float64]


class Compared(NamedTuple):
    """A real track held against the simulated one, over the cycles of the real one."""

    design: int
    trial: str
    #: Where the real track ends; displacements are taken there.
    cycles: float
    #: Degrees from +x towards +y, above -180 and up to 180; NaN for less than `LITTLE`.
    heading_simulated: float
    heading_real: float
    #: Between the two displacements, degrees, 0 to 180; NaN where either is less than `LITTLE`.
    angle: float
    #: cm, of the displacements.
    distance_simulated: float
    distance_real: float
    #: cm, between the two ends.
    end_point_error: float
    #: cm, root of the mean squared distance over time; tracks are straight between their points.
    rms_error: float


def compare(real: RealTrack, simulated: Array, per_cycle: int) -> Compared:
    """Hold a real track against the simulated one of the same design.

    That is x, y in cm from the start, shape (m, 2), with `per_cycle` samples in each cycle, and at
    least as long.
    """
    own = np.arange(len(simulated)) / per_cycle
    end = float(real.cycle[-1])
    times = np.union1d(own[own <= end], real.cycle)
    ours, theirs = track_at(times, own, simulated), track_at(times, real.cycle, real.position)
    apart = theirs - ours
    a, b = apart[:-1], apart[1:]
    squares = ((a * a + a * b + b * b) / 3).sum(axis=1)  # exact where both are straight
    simulated_heading, real_heading = heading(ours[-1]), heading(theirs[-1])
    return Compared(
        real.design,
        real.trial,
        end,
        simulated_heading,
        real_heading,
        abs((real_heading - simulated_heading + 180) % 360 - 180),
        float(np.hypot(*ours[-1])),
        float(np.hypot(*theirs[-1])),
        float(np.hypot(*apart[-1])),
        float(np.sqrt(np.sum(squares * np.diff(times)) / end)),
    )


def track_at(times: Array, own: Array, position: Array) -> Array:
    """Return where a track is at some times, shape (m, 2), straight between its own points."""
    return np.stack([np.interp(times, own, along) for along in position.T], axis=1)


def heading(displacement: Array) -> float:
    """Return where a displacement points, degrees from +x towards +y; NaN below `LITTLE`."""
    x, y = displacement
    return math.degrees(math.atan2(y, x)) if math.hypot(x, y) >= LITTLE else math.nan


def as_csv(rows: Iterable[Compared]) -> bytes:
    """Return the comparisons as CSV, numbers to six figures, nothing for NaN."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Compared._fields)
    for number, trial, *values in rows:
        shown = ("" if math.isnan(value) else f"{value:.6g}" for value in values)
        writer.writerow([number, trial, *shown])
    return text.getvalue().encode()


def as_lines(rows: Iterable[Compared]) -> list[str]:
    """Return the comparisons for people."""
    shown = (row._replace(trial=short(row.trial)) for row in rows)
    return [HEAD, *(ROW.format(*row) for row in shown), FOOT]


def short(text: str, width: int = 12) -> str:
    """Return a trial's name as it is shown: so many characters at most, all of them printable.

    What is left out is in the middle: trials are often told apart by how their names end.
    """
    shown = "".join(c if c.isprintable() else "?" for c in text)
    if len(shown) <= width:
        return shown
    tail = width // 2
    return f"{shown[: width - 1 - tail]}\N{HORIZONTAL ELLIPSIS}{shown[-tail:]}"
