"""Tracks of real robots, read from a CSV file.

The first line names the columns, in any order; every other line is where a robot was at a moment:

    design,trial,cycle,x_cm,y_cm
    6453,1,0,0.0,0.0
    6453,1,0.5,-0.1,-0.2

design  number, 1 to 6560, or the eight digits of the design (a spreadsheet may take the zeros away
        that they begin with: 00001222 is then read as design 1222; give numbers there)
trial   name of the run, any text, so that a design can have several
cycle   actuation cycles since the start: 0 on a trial's first line, growing from line to line
x_cm    horizontal position of the robot's centre in cm, along the lattice's +x and +y as the robot
y_cm    was set down; a trial is moved so that it starts at 0, 0
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError

COLUMNS = ("design", "trial", "cycle", "x_cm", "y_cm")

#: cm from where a trial starts; the fastest robot walks 7, and what is farther is another unit.
MOST_CM = 100.0

Point = tuple[float, float, float]


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
    cycle: NDArray[np.float64]
    position: NDArray[np.float64]


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
        Where a file can't be read or is not as this module says, or two have one trial.
    """
    points: dict[tuple[int, str], list[Point]] = {}
    source: dict[tuple[int, str], Path] = {}
    for path in paths:
        for where, (design, name, *numbers) in _records(path):
            trial = _design(where, design.strip()), name.strip()
            cycle, x, y = (_number(where, *pair) for pair in zip(COLUMNS[2:], numbers, strict=True))
            if source.setdefault(trial, path) != path:
                raise CsvError(
                    f"{where}: design {trial[0]} has a trial {trial[1]!r} in {source[trial]} as "
                    "well; give one of them another name, or leave one of the files out"
                )
            _check(where, points.setdefault(trial, []), (cycle, x, y), most_cycles)
            points[trial].append((cycle, x, y))
        if path not in source.values():
            raise CsvError(f"{path} has no track; add lines of {','.join(COLUMNS)}")
    for (number, name), made in points.items():
        if len(made) < 2:
            raise CsvError(
                f"{source[number, name]}: design {number} has one point in trial {name!r}, and a "
                "track needs two or more; add the others, or take it out"
            )
    tracks = {trial: np.array(made) for trial, made in points.items()}
    return tuple(
        RealTrack(*trial, made[:, 0], made[:, 1:] - made[0, 1:]) for trial, made in tracks.items()
    )


def _records(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield where each record of a file begins, and its values in the order of `COLUMNS`."""
    reader = csv.reader(io.StringIO(_text(path), newline=""), strict=True)
    line = 1
    try:
        names = [name.strip() for name in next(reader, [])]
        if any(names.count(name) != 1 for name in COLUMNS):
            raise CsvError(
                f"{path}, line 1: the first line must name each of the columns "
                f"{','.join(COLUMNS)} once, separated by commas, got {','.join(names)[:60]!r}"
            )
        line = reader.line_num + 1
        for cells in reader:
            where = f"{path}, line {line}"
            if any(cell.strip() for cell in cells):
                if len(cells) != len(names):
                    raise CsvError(
                        f"{where}: {len(cells)} values, but the first line names {len(names)} "
                        "columns; give one value for each, separated by commas"
                    )
                yield where, [cells[names.index(name)] for name in COLUMNS]
            line = reader.line_num + 1
    except csv.Error as error:
        raise CsvError(
            f"{path}, line {line}: {error}; correct what is quoted there, or save the file anew"
        ) from None


def _text(path: Path) -> str:
    try:
        content = path.read_bytes()
        text, fault = content.decode("utf-8-sig"), content.find(b"\0")
    except OSError as error:
        raise CsvError(
            f"{path} can't be read ({error.strerror}); name a CSV file that can"
        ) from None
    except UnicodeDecodeError as error:
        fault = error.start
    if fault >= 0:
        line = 1 + content[:fault].count(b"\n")
        raise CsvError(f"{path}, line {line}: not text in UTF-8; save the file as CSV in UTF-8")
    return text


def _design(where: str, text: str) -> int:
    try:
        number = design_of(text, (2, 2, 2)).index
    except BadInputError as error:
        raise CsvError(f"{where}: {str(error).partition(', which a')[0]}") from None
    if number == 0:
        raise CsvError(
            f"{where}: design {text!r} has no voxels, so no real robot is one; give the design "
            "that was built"
        )
    return number


def _number(where: str, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise CsvError(
            f"{where}: {name} must be a finite number such as 1.25, got {text.strip()[:40]!r}; "
            "leave the line out where it was not measured"
        )
    return value


def _check(where: str, before: list[Point], point: Point, most_cycles: float) -> None:
    """Make sure that a point can follow others of its trial."""
    cycle, x, y = point
    shown = repr(cycle).removesuffix(".0")
    if not 0 <= cycle <= most_cycles:
        raise CsvError(
            f"{where}: cycle {shown} is not within 0 to {most_cycles:g}, over which the robots are "
            "simulated; count actuation cycles from the start, and leave out what comes later"
        )
    if not before and cycle != 0:
        raise CsvError(
            f"{where}: a trial starts at cycle 0, got {shown}; count from its first line, and give "
            "each run of a robot a trial of its own"
        )
    if before and cycle <= before[-1][0]:
        raise CsvError(
            f"{where}: cycle {shown} comes after {before[-1][0]:g}; sort the lines of a trial, and "
            "give each run of a robot a trial of its own"
        )
    if before and math.hypot(x - before[0][1], y - before[0][2]) > MOST_CM:
        raise CsvError(
            f"{where}: ({x:g}, {y:g}) is more than {MOST_CM:g} cm from where the trial starts, and "
            "no robot walks as far; give positions in cm"
        )
