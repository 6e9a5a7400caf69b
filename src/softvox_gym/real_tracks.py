"""Tracks of real robots, read from CSV files, and how far they went another way than simulated.

docs/figures.md says what a file holds.
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

#: cm from where a trial starts; the fastest robot walks 7, and what is farther is another unit.
MOST_CM = 100.0

#: Edge of a voxel of the paper's real robots.
VOXEL_CM = 1.5

#: Over more cycles no robots are compared: as many are simulated.
MOST_CYCLES = 1000

#: A larger file is not read: one of an hour's film has a tenth.
MOST_BYTES = 2**27

Array = NDArray[np.float64]

#: The line of a point, its time, x and y.
Point = tuple[int, float, float, float]

#: Python takes more for one: 1_0, digits of other scripts, and control characters around it.
NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")

#: What to do where two runs may be mixed up.
OWN_TRIAL = "give each run of a robot a trial of its own"

#: Voxel widths, which are cm for the paper's voxel of 1 cm: what travels less has no heading to
#: speak of. Robots that get nowhere sway by up to 0.18 within a cycle.
LITTLE = 0.25

#: Degrees between two headings that count as the same.
WITHIN = 45

#: Samples of a simulated track per cycle of actuation.
PER_CYCLE = 50

#: The table for people.
HEAD = (
    "design  trial         cycles   heading    real   angle  distance    real  end error  RMS error"
)
ROW = "{:6}  {:12}  {:6.4g}  {:z8.1f}  {:z6.1f}  {:6.1f}  {:8.2f}  {:6.2f}  {:9.2f}  {:9.2f}"
FOOT = f"headings and angles in degrees (nan: went less than {LITTLE:g}), the rest in cm"


class CsvError(ValueError):
    """A file that can't be used; the message names the file, the line and what to change."""


@dataclass(frozen=True, eq=False)
class RealTrack:
    """What one trial of a real robot did.

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
    """Read tracks of real robots from some files.

    Parameters
    ----------
    paths : sequence of Path
    most_cycles : float
        How many cycles there are to compare with; a track may not go on for longer.

    Returns
    -------
    tuple of RealTrack
        In the order in which designs and trials first appear.

    Raises
    ------
    CsvError
        Where a file can't be read or is not as docs/figures.md says, or two have one trial.
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
                    f"{path}, line {first[0]}: design {number} has a trial {trial!r} in {other} as "
                    "well; give one of them another name, or leave one of the files out"
                )
            check_order(path, points, "cycle")
            for point in points:
                if fault := _fault(first, point, most_cycles):
                    raise CsvError(f"{path}, line {point[0]}: {fault}")
            if len(points) < 2:
                raise CsvError(
                    f"{path}, line {first[0]}: design {number} has one point in trial {trial!r}, "
                    "and a track needs two or more; add the others, or take it out"
                )
            _, cycle, *position = np.array(points).T
            made.append(RealTrack(number, trial, cycle, np.transpose(position) - first[2:]))
    return tuple(made)


def _fault(first: Point, point: Point, most_cycles: float) -> str:
    """Return why a trial that begins at a first point can't have another; nothing where it can."""
    _, cycle, *at = point
    shown = repr(cycle).removesuffix(".0")
    if not 0 <= cycle <= most_cycles:
        return (
            f"cycle {shown} is not within 0 to {most_cycles:g}, over which the robots are "
            "simulated; count actuation cycles from the start, and leave out what comes later"
        )
    if first[1] != 0:
        return f"a trial starts at cycle 0, got {shown}; count from its first line, and {OWN_TRIAL}"
    if math.dist(at, first[2:]) > MOST_CM:
        return (
            f"({at[0]:g}, {at[1]:g}) is more than {MOST_CM:g} cm from where the trial starts, and "
            "no robot walks as far; give positions in cm"
        )
    return ""


def check_order(path: Path, points: Sequence[Point], clock: str) -> None:
    """Raise CsvError where time doesn't grow from point to point."""
    for before, point in pairwise(points):
        if point[1] <= before[1]:
            raise CsvError(
                f"{path}, line {point[0]}: {clock} {point[1]:g} comes after {before[1]:g}; sort "
                f"the lines of a trial, and {OWN_TRIAL}"
            )


def content_of(path: Path) -> bytes:
    """Return what is in a file of tracks.

    Raises
    ------
    CsvError
        Where it can't be read, or is larger than any such file is.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise CsvError(
            f"{path} can't be read ({error.strerror}); name a CSV file that can"
        ) from None
    if len(content) > MOST_BYTES:
        raise CsvError(f"{path} has more than {MOST_BYTES} bytes; leave points out of it")
    return content


def points_in(
    path: Path, content: bytes, columns: Sequence[str], lattice: Lattice
) -> dict[tuple[Any, Any], list[Point]]:
    """Return the points of every design and trial of a CSV file, in the order in which these begin.

    The first line must name each of the columns once, the last three of which are those of a point;
    design and trial are None where they are not among them. Others are ignored.
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
    """Yield the line on which each row of a text begins, from 1, and its cells."""
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
            f"{path}, line {line}: {error}; correct what is quoted there, or save the file anew"
        ) from None


@lru_cache  # every line of a file names one
def design_in(text: str, lattice: Lattice) -> Design:
    """Return the design that a file names, which has to have voxels; ValueError for another."""
    design = written(text, lattice)
    if not design.n_voxels:
        raise ValueError(
            f"design {text!r} has no voxels, so no real robot is one; give the design that was "
            "built"
        )
    return design


def number_in(name: str, text: str) -> float:
    """Return the finite number that a file has in a column; ValueError where it has none."""
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(
            f"{name} must be a finite number such as 1.25, got {text[:40]!r}; leave the line out "
            "where it was not measured"
        )
    return value


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
        between(simulated_heading, real_heading),
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


def between(first: float, second: float) -> float:
    """Return the angle between two headings, degrees, 0 to 180; NaN where either is."""
    return abs((second - first + 180) % 360 - 180)


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
