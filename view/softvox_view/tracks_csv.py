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

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import N_DESIGNS, N_SITES, Design
from softvox_view.csv_file import CsvError, records

COLUMNS = ("design", "trial", "cycle", "x_cm", "y_cm")

#: cm from where a trial starts; the fastest robot walks 7, and what is farther is another unit.
MOST_CM = 100.0

Point = tuple[float, float, float]


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


def read_files(paths: Sequence[Path], *, most_cycles: float) -> tuple[RealTrack, ...]:
    """Read tracks of real robots from several files; see `read_tracks`.

    Raises
    ------
    CsvError
        Also where two files have a trial of one name of the same design.
    """
    found: dict[tuple[int, str], tuple[Path, RealTrack]] = {}
    for path in paths:
        for track in read_tracks(path, most_cycles=most_cycles):
            design, trial = track.design, track.trial
            if (design, trial) in found:
                raise CsvError(
                    f"{path}: design {design} has a trial {trial!r} in {found[design, trial][0]} "
                    "as well; give one of them another name, or leave one of the files out"
                )
            found[design, trial] = path, track
    return tuple(track for _, track in found.values())


def read_tracks(path: Path, *, most_cycles: float) -> tuple[RealTrack, ...]:
    """Read tracks of real robots.

    Parameters
    ----------
    path : Path
    most_cycles : float
        How many cycles there are to compare with; a track may not go on for longer.

    Returns
    -------
    tuple of RealTrack
        In the order in which designs and trials first appear.

    Raises
    ------
    CsvError
        Where the file can't be read, or is not as this module says.
    """
    points: dict[tuple[int, str], list[Point]] = {}
    lines: dict[tuple[int, str], int] = {}
    for line, record in records(path, COLUMNS):
        where = f"{path}, line {line}"
        design, point = _design(where, record["design"]), _point(where, record, most_cycles)
        trial = (design, record["trial"].strip())
        _check_order(where, points.get(trial, []), point)
        points.setdefault(trial, []).append(point)
        lines[trial] = line
    if not points:
        raise CsvError(f"{path} has no track; add lines of {','.join(COLUMNS)}")
    for trial, made in points.items():
        if len(made) < 2:
            raise CsvError(
                f"{path}, line {lines[trial]}: design {trial[0]} has one point in trial "
                f"{trial[1]!r}, and a track needs two or more; add the others, or take it out"
            )
    return tuple(_track(design, trial, made) for (design, trial), made in points.items())


def _track(design: int, trial: str, points: list[Point]) -> RealTrack:
    values = np.array(points)
    return RealTrack(design, trial, values[:, 0], values[:, 1:] - values[0, 1:])


def _design(where: str, text: str) -> int:
    text = text.strip()
    if re.fullmatch(f"[012]{{{N_SITES}}}", text):
        number = Design(text).index
    elif re.fullmatch(r"[0-9]{1,7}", text) and int(text) < N_DESIGNS:
        number = int(text)
    else:
        raise CsvError(
            f"{where}: design {text[:40]!r} does not exist; give a number from 1 to "
            f"{N_DESIGNS - 1} or {N_SITES} digits 0, 1, 2"
        )
    if number == 0:
        raise CsvError(
            f"{where}: design {text!r} has no voxels, so no real robot is one; give the design "
            "that was built"
        )
    return number


def _point(where: str, record: dict[str, str], most_cycles: float) -> Point:
    cycle, x, y = (_number(where, name, record[name]) for name in COLUMNS[2:])
    if not 0 <= cycle <= most_cycles:
        raise CsvError(
            f"{where}: cycle {_shown(cycle)} is not within 0 to {_shown(most_cycles)}, over which "
            "the robots are simulated; count actuation cycles from the start, and leave out what "
            "comes later"
        )
    return cycle, x, y


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


def _check_order(where: str, before: list[Point], point: Point) -> None:
    """Make sure that a point can follow others of its trial."""
    cycle, x, y = point
    if not before and cycle != 0:
        raise CsvError(
            f"{where}: a trial starts at cycle 0, got {_shown(cycle)}; count from its first line, "
            "and give each run of a robot a trial of its own"
        )
    if before and cycle <= before[-1][0]:
        raise CsvError(
            f"{where}: cycle {_shown(cycle)} comes after {_shown(before[-1][0])}; sort the lines "
            "of a trial, and give each run of a robot a trial of its own"
        )
    if before and math.hypot(x - before[0][1], y - before[0][2]) > MOST_CM:
        raise CsvError(
            f"{where}: ({_shown(x)}, {_shown(y)}) is more than {MOST_CM:g} cm from where the trial "
            "starts, and no robot walks as far; give positions in cm"
        )


def _shown(value: float) -> str:
    """Return a number with as many digits as it takes to tell it from others."""
    return repr(value).removesuffix(".0")
