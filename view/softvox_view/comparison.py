"""How far real robots went another way than simulated ones."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from softvox_view.tracks_csv import RealTrack

#: Voxel widths, which are cm for the paper's voxel of 1 cm: what travels less has no heading to
#: speak of. Robots that get nowhere sway by up to 0.18 within a cycle.
LITTLE = 0.25


@dataclass(frozen=True)
class Compared:
    """A real track held against the simulated one, over the cycles of the real one.

    Parameters
    ----------
    design : int
    trial : str
    cycles : float
        Where the real track ends; displacements are taken there.
    heading_simulated, heading_real : float
        Degrees from +x towards +y, above -180 and up to 180; NaN for a robot that went less
        than `LITTLE`.
    angle : float
        Between the two displacements, degrees, 0 to 180; NaN where either is less than
        `LITTLE`.
    distance_simulated, distance_real : float
        cm, of the displacements.
    end_point_error : float
        cm, between the two ends.
    rms_error : float
        cm, root of the mean squared distance between the two over time; both tracks are taken to be
        straight between their points.
    """

    design: int
    trial: str
    cycles: float
    heading_simulated: float
    heading_real: float
    angle: float
    distance_simulated: float
    distance_real: float
    end_point_error: float
    rms_error: float


def compare(real: RealTrack, simulated: NDArray[np.float64], per_cycle: int) -> Compared:
    """Hold a real track against the simulated one of the same design.

    That is x, y in cm from the start, shape (m, 2), with `per_cycle` samples in each cycle, and at
    least as long.
    """
    own = np.arange(len(simulated)) / per_cycle
    end = float(real.cycle[-1])
    times = np.union1d(own[own <= end], real.cycle)
    ours, theirs = track_at(times, own, simulated), track_at(times, real.cycle, real.position)
    apart = theirs - ours
    there, here = theirs[-1], ours[-1]
    return Compared(
        design=real.design,
        trial=real.trial,
        cycles=end,
        heading_simulated=heading(here),
        heading_real=heading(there),
        angle=abs((heading(there) - heading(here) + 180) % 360 - 180),
        distance_simulated=float(np.hypot(*here)),
        distance_real=float(np.hypot(*there)),
        end_point_error=float(np.hypot(*apart[-1])),
        rms_error=_root_mean_square(times, apart),
    )


def track_at(
    times: NDArray[np.float64], own: NDArray[np.float64], position: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return where a track is at some times, shape (m, 2), straight between its own points."""
    return np.stack([np.interp(times, own, position[:, axis]) for axis in range(2)], axis=1)


def _root_mean_square(times: NDArray[np.float64], apart: NDArray[np.float64]) -> float:
    """Return the root of the time's mean of the squared length, linear between the times."""
    a, b = apart[:-1], apart[1:]
    squares = ((a * a + a * b + b * b) / 3).sum(axis=1)  # exact where both are straight
    return float(np.sqrt(np.sum(squares * np.diff(times)) / (times[-1] - times[0])))


def heading(displacement: NDArray[np.float64]) -> float:
    """Return where a displacement points, degrees from +x towards +y; NaN below `LITTLE`."""
    x, y = displacement
    return math.degrees(math.atan2(y, x)) if math.hypot(x, y) >= LITTLE else math.nan


def as_csv(rows: Iterable[Compared]) -> bytes:
    """Return the comparisons as CSV, numbers to six figures, nothing for NaN."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(field.name for field in fields(Compared))
    for row in rows:
        values = asdict(row).values()
        writer.writerow(
            ("" if math.isnan(value) else f"{value:.6g}") if isinstance(value, float) else value
            for value in values
        )
    return text.getvalue().encode()


def as_lines(rows: Iterable[Compared]) -> list[str]:
    """Return the comparisons for people."""
    lines = [
        f"{'design':>6}  {'trial':12}  {'cycles':>6}  {'heading':>8}  {'real':>6}  {'angle':>6}  "
        f"{'distance':>8}  {'real':>6}  {'end error':>9}  {'RMS error':>9}"
    ]
    for row in rows:
        lines.append(
            f"{row.design:6}  {short(row.trial):12}  {row.cycles:6.4g}  "
            f"{_degrees(row.heading_simulated):>8}  {_degrees(row.heading_real):>6}  "
            f"{_degrees(row.angle):>6}  "
            f"{row.distance_simulated:8.2f}  {row.distance_real:6.2f}  "
            f"{row.end_point_error:9.2f}  {row.rms_error:9.2f}"
        )
    return [
        *lines,
        f"headings and angles in degrees (-: went less than {LITTLE:g}), the rest in cm",
    ]


def _degrees(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1f}"


def short(text: str, width: int = 12) -> str:
    """Return a trial's name as it is shown: so many characters at most, all of them printable.

    What is left out is in the middle: trials are often told apart by how their names end.
    """
    shown = "".join(c if c.isprintable() else "?" for c in text)
    if len(shown) <= width:
        return shown
    tail = width // 2
    return f"{shown[: width - 1 - tail]}\N{HORIZONTAL ELLIPSIS}{shown[-tail:]}"
