"""Tracks of real robots, read from CSV files, and their comparison with simulated tracks.

docs/figures.md describes the files.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design, written
from softvox_gym.lattice import Lattice

COLUMNS = ("design", "trial", "cycle", "x_cm", "y_cm")

#: Largest distance from the start of a trial, cm. The fastest robot walks 7; more is another unit.
MOST_CM = 100.0

#: Edge of a voxel of the paper's real robots.
VOXEL_CM = 1.5

#: Most cycles after which robots are compared, because simulations have no more.
MOST_CYCLES = 1000

#: Largest file that is read; a track of an hour's film takes a tenth.
MOST_BYTES = 2**27

Array = NDArray[np.float64]

#: A point: its line in the file, its time, x and y.
Point = tuple[int, float, float, float]

#: Python's float also accepts 1_0, digits of other scripts and surrounding control characters.
NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")

#: The remedy if two runs may have been mixed up.
OWN_TRIAL = "give each run of a robot its own trial"

#: Robots that travel less than this, in voxel widths (cm for the paper's voxel of 1 cm), have no
#: heading. Robots that get nowhere sway by up to 0.18 within a cycle.
LITTLE = 0.25

#: Degrees between two headings that count as the same.
WITHIN = 45

#: Samples of a simulated track per cycle of actuation.
PER_CYCLE = 50

#: The displayed table.
HEAD = (
    "design  trial         cycles   heading    real   angle  distance    real  end error  RMS error"
)
ROW = "{:6}  {:12}  {:6.4g}  {:z8.1f}  {:z6.1f}  {:6.1f}  {:8.2f}  {:6.2f}  {:9.2f}  {:9.2f}"
FOOT = f"headings and angles in degrees (nan: went less than {LITTLE:g}), the rest in cm"


class CsvError(ValueError):
    """A file that can't be used; the message names the file, the line and the remedy."""


@dataclass(frozen=True, eq=False)
class RealTrack:
    """The track of one trial of a real robot.

    Parameters
    ----------
    design : int
    trial : str
    cycle : ndarray, shape (n,)
        Actuation cycles since the start, from 0, increasing.
    position : ndarray, shape (n, 2)
        x, y in cm from the start.
    """

    design: int
    trial: str
    cycle: Array
    position: Array


def read_tracks(paths: Sequence[Path], *, most_cycles: float) -> tuple[RealTrack, ...]:
    """Read tracks of real robots from files.

    Parameters
    ----------
    paths : sequence of Path
    most_cycles : float
        Cycles of the simulation; a track may not last longer.

    Returns
    -------
    tuple of RealTrack
        In the order in which designs and trials first appear.

    Raises
    ------
    CsvError
        If a file can't be read or does not follow docs/figures.md, or two files have one trial.
    """
    source: dict[tuple[int, str], Path] = {}
    made = []
    for path in paths:
        found = points_in(path, content_of(path), COLUMNS, Lattice())
        if not found:
            raise CsvError(f"{path} has no track; add lines of {','.join(COLUMNS)}")
        for (design, trial), points in found.items():
            first, number = points[0], design.index
            other = source.setdefault((number, trial), path)
            if other != path:
                raise CsvError(
                    f"{path}, line {first[0]}: design {number} also has a trial {trial!r} in "
                    f"{other}; rename one of the two trials, or leave out one of the files"
                )
            check_order(path, points, "cycle")
            for point in points:
                if fault := _fault(first, point, most_cycles):
                    raise CsvError(f"{path}, line {point[0]}: {fault}")
            if len(points) < 2:
                raise CsvError(
                    f"{path}, line {first[0]}: design {number} has one point in trial {trial!r}, "
                    "but a track needs at least two; add the others, or remove the trial"
                )
            _, cycle, *position = np.array(points).T
            made.append(RealTrack(number, trial, cycle, np.transpose(position) - first[2:]))
    return tuple(made)


def _fault(first: Point, point: Point, most_cycles: float) -> str:
    """Return why a trial with this first point can't have another point; "" if it can."""
    _, cycle, *at = point
    shown = repr(cycle).removesuffix(".0")
    if not 0 <= cycle <= most_cycles:
        return (
            f"cycle {shown} is not within 0 to {most_cycles:g}, the cycles of the simulation; "
            "count actuation cycles from the start, and leave out later lines"
        )
    if first[1] != 0:
        return (
            f"a trial must start at cycle 0, got {shown}; count from its first line, and "
            f"{OWN_TRIAL}"
        )
    if math.dist(at, first[2:]) > MOST_CM:
        return (
            f"({at[0]:g}, {at[1]:g}) is more than {MOST_CM:g} cm from the start of the trial, and "
            "no robot walks that far; give positions in cm"
        )
    return ""


def check_order(path: Path, points: Sequence[Point], clock: str) -> None:
    """Raise CsvError if time does not increase from point to point."""
    for before, point in pairwise(points):
        if point[1] <= before[1]:
            raise CsvError(
                f"{path}, line {point[0]}: {clock} must increase, but {point[1]:g} follows "
                f"{before[1]:g}; sort the lines of a trial, and {OWN_TRIAL}"
            )


def content_of(path: Path) -> bytes:
    """Return the content of a file of tracks.

    Raises
    ------
    CsvError
        If it can't be read or is too large.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise CsvError(
            f"{path} can't be read ({error.strerror}); name a readable CSV file"
        ) from None
    if len(content) > MOST_BYTES:
        raise CsvError(f"{path} has more than {MOST_BYTES} bytes; leave out some of its points")
    return content


def points_in(
    path: Path, content: bytes, columns: Sequence[str], lattice: Lattice
) -> dict[tuple[Any, Any], list[Point]]:
    """Return the points of every design and trial of a CSV file, in order of first appearance.

    The first line must name each of the columns once; the last three are those of a point. Design
    and trial are None if the columns lack them. Other columns are ignored.
    """
    lines = rows(path, content)
    _, names = next(lines, (1, []))
    if any(names.count(name) != 1 for name in columns):
        raise CsvError(
            f"{path}, line 1: the first line must name each of the columns {','.join(columns)} "
            f"once, separated by commas, got {','.join(names)[:60]!r}"
        )
    made: dict[tuple[Any, Any], list[Point]] = {}
    for line, cells in lines:
        if not any(cells):
            continue
        if len(cells) != len(names):
            raise CsvError(
                f"{path}, line {line}: {len(cells)} values, but the first line names {len(names)} "
                "columns; give one value for each, separated by commas"
            )
        record = dict(zip(names, cells, strict=True))
        try:
            design = design_in(record["design"], lattice) if "design" in columns else None
            time, x, y = (number_in(name, record[name]) for name in columns[-3:])
        except ValueError as error:
            raise CsvError(f"{path}, line {line}: {error}") from None
        trial = record["trial"] if "trial" in columns else None
        made.setdefault((design, trial), []).append((line, time, x, y))
    return made


def rows(path: Path, content: bytes, delimiter: str = ",") -> Iterator[tuple[int, list[str]]]:
    """Yield each row of a text: the line on which it begins, from 1, and its cells."""
    text = (part.decode("utf-8-sig") for part in io.BytesIO(content))
    reader = csv.reader(text, delimiter=delimiter, strict=True)
    line = 1
    try:
        for cells in reader:
            yield line, [cell.strip(" \t\r\n") for cell in cells]
            line = reader.line_num + 1
    except UnicodeDecodeError:
        raise CsvError(
            f"{path}, line {line}: not text in UTF-8; save the file as CSV in UTF-8"
        ) from None
    except csv.Error as error:
        raise CsvError(
            f"{path}, line {line}: {error}; correct the quotes there, or save the file again"
        ) from None


@lru_cache  # every line of a file names one
def design_in(text: str, lattice: Lattice) -> Design:
    """Return the design that a file names; ValueError if it is invalid or has no voxels."""
    design = written(text, lattice)
    if not design.n_voxels:
        raise ValueError(f"design {text!r} has no voxels; give the design that was built")
    return design


def number_in(name: str, text: str) -> float:
    """Return the number in a column of a file; ValueError if it is not a finite number."""
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(
            f"{name} must be a finite number such as 1.25, got {text[:40]!r}; leave out the line "
            "if it was not measured"
        )
    return value


class Compared(NamedTuple):
    """The comparison of a real track with the simulated one, over the cycles of the real one."""

    design: int
    trial: str
    #: Cycle at which the real track ends; displacements are measured there.
    cycles: float
    #: Degrees from +x towards +y, above -180 and up to 180; NaN for less than `LITTLE`.
    heading_simulated: float
    heading_real: float
    #: Between the two displacements, degrees, 0 to 180; NaN if either is less than `LITTLE`.
    angle: float
    #: Length of the displacements, cm.
    distance_simulated: float
    distance_real: float
    #: Distance between the two ends, cm.
    end_point_error: float
    #: Root mean square distance over time, cm; tracks are straight between their points.
    rms_error: float


def compare(real: RealTrack, simulated: Array, per_cycle: int) -> Compared:
    """Compare a real track with the simulated one of the same design.

    The simulated track is x, y in cm from the start, shape (m, 2), with `per_cycle` samples per
    cycle, and lasts at least as long.
    """
    own = np.arange(len(simulated)) / per_cycle
    end = float(real.cycle[-1])
    times = np.union1d(own[own <= end], real.cycle)
    ours, theirs = track_at(times, own, simulated), track_at(times, real.cycle, real.position)
    apart = theirs - ours
    a, b = apart[:-1], apart[1:]
    squares = ((a * a + a * b + b * b) / 3).sum(axis=1)  # exact, as both are straight
    simulated_heading, real_heading = heading(ours[-1]), heading(theirs[-1])
    return Compared(
        real.design,
        real.trial,
        end,
        simulated_heading,
        real_heading,
        between(simulated_heading, real_heading),
        float(np.hypot(*ours[-1])),
        float(np.hypot(*theirs[-1])),
        float(np.hypot(*apart[-1])),
        float(np.sqrt(np.sum(squares * np.diff(times)) / end)),
    )


def track_at(times: Array, own: Array, position: Array) -> Array:
    """Return the positions of a track at some times, shape (m, 2), by linear interpolation."""
    return np.stack([np.interp(times, own, along) for along in position.T], axis=1)


def heading(displacement: Array) -> float:
    """Return the heading of a displacement, degrees from +x towards +y; NaN below `LITTLE`."""
    x, y = displacement
    return math.degrees(math.atan2(y, x)) if math.hypot(x, y) >= LITTLE else math.nan


def between(first: float, second: float) -> float:
    """Return the angle between two headings, degrees, 0 to 180; NaN if either is NaN."""
    return abs((second - first + 180) % 360 - 180)


def as_csv(rows: Iterable[Compared]) -> bytes:
    """Return the comparisons as CSV, numbers to six significant digits, NaN as an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Compared._fields)
    for number, trial, *values in rows:
        shown = ("" if math.isnan(value) else f"{value:.6g}" for value in values)
        writer.writerow([number, trial, *shown])
    return text.getvalue().encode()


def as_lines(rows: Iterable[Compared]) -> list[str]:
    """Return the comparisons as lines of the displayed table."""
    shown = (row._replace(trial=short(row.trial)) for row in rows)
    return [HEAD, *(ROW.format(*row) for row in shown), FOOT]


def short(text: str, width: int = 12) -> str:
    """Return a trial's name as displayed: at most `width` characters, all of them printable.

    A longer name is shortened in the middle, because trials often differ in how their names end.
    """
    shown = "".join(c if c.isprintable() else "?" for c in text)
    if len(shown) <= width:
        return shown
    tail = width // 2
    return f"{shown[: width - 1 - tail]}\N{HORIZONTAL ELLIPSIS}{shown[-tail:]}"
