"""Tracks of real robots, read from a CSV file.

The first line names the columns, in any order; every other line is where a robot was at a moment:

    design,trial,cycle,x_cm,y_cm
    6453,1,0,0.0,0.0
    6453,1,0.5,-0.1,-0.2

design  number, 0 to 6560, or the eight digits of the design
trial   name of the run, any text, so that a design can have several
cycle   actuation cycles since the start: 0 on a trial's first line, growing from line to line
x_cm    horizontal position of the robot's centre in cm, along the lattice's +x and +y as the robot
y_cm    was set down; a trial is moved so that it starts at 0, 0
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import N_DESIGNS, N_SITES, Design

COLUMNS = ("design", "trial", "cycle", "x_cm", "y_cm")

#: cm; what is farther away is a wrong unit or a slip.
MOST_CM = 10_000.0

Point = tuple[float, float, float]


class TracksError(ValueError):
    """A file of tracks that can't be used; the message names the file, the line and the mend."""


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
    TracksError
        Where the file is not as this module says.
    OSError
        Where it can't be read.
    """
    points: dict[tuple[int, str], list[Point]] = {}
    lines: dict[tuple[int, str], int] = {}
    for line, row in _rows(path):
        where = f"{path}, line {line}"
        key, point = _design(where, row["design"]), _point(where, row, most_cycles)
        trial = (key, row["trial"].strip())
        _check_order(where, points.get(trial, []), point[0])
        points.setdefault(trial, []).append(point)
        lines[trial] = line
    for trial, made in points.items():
        if len(made) < 2:
            raise TracksError(
                f"{path}, line {lines[trial]}: design {trial[0]} has one point in trial "
                f"{trial[1]!r}, and a track needs two or more; add the others, or take it out"
            )
    return tuple(_track(design, trial, made) for (design, trial), made in points.items())


def _track(design: int, trial: str, points: list[Point]) -> RealTrack:
    values = np.array(points)
    return RealTrack(design, trial, values[:, 0], values[:, 1:] - values[0, 1:])


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield each line's number and its cells by column; blank lines are left out."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, strict=True)
            names = [name.strip() for name in next(reader, [])]
            _check_header(path, names)
            found = False
            for cells in reader:
                if not any(cell.strip() for cell in cells):
                    continue
                if len(cells) != len(names):
                    raise TracksError(
                        f"{path}, line {reader.line_num}: {len(cells)} values, but the first line "
                        f"names {len(names)} columns; give one value for each, separated by commas"
                    )
                found = True
                yield reader.line_num, dict(zip(names, cells, strict=True))
    except UnicodeDecodeError:
        raise TracksError(f"{path} is not text in UTF-8; save it as CSV in UTF-8") from None
    except csv.Error as error:
        raise TracksError(
            f"{path}, line {reader.line_num}: {error}; mend that line, or save the file as CSV anew"
        ) from None
    if not found:
        raise TracksError(f"{path} has no track; add lines of {','.join(COLUMNS)}")


def _check_header(path: Path, names: list[str]) -> None:
    missing = [name for name in COLUMNS if name not in names]
    twice = [name for name in COLUMNS if names.count(name) > 1]
    if missing or twice:
        wrong = f"lacks {', '.join(missing)}" if missing else f"names {twice[0]} twice"
        shown = ",".join(names)[:60]
        raise TracksError(
            f"{path}, line 1: the first line {wrong}; it must name the columns "
            f"{','.join(COLUMNS)}, separated by commas, got {shown!r}"
        )


def _design(where: str, text: str) -> int:
    text = text.strip()
    if re.fullmatch(f"[012]{{{N_SITES}}}", text):
        return Design(text).index
    if re.fullmatch(r"[0-9]{1,7}", text) and int(text) < N_DESIGNS:
        return int(text)
    raise TracksError(
        f"{where}: design {text[:40]!r} does not exist; give a number from 0 to {N_DESIGNS - 1} "
        f"or {N_SITES} digits 0, 1, 2"
    )


def _point(where: str, row: dict[str, str], most_cycles: float) -> Point:
    cycle, x, y = (_number(where, name, row[name]) for name in COLUMNS[2:])
    if not 0 <= cycle <= most_cycles:
        raise TracksError(
            f"{where}: cycle {cycle:g} is not within 0 to {most_cycles:g}, over which the robots "
            "are simulated; count actuation cycles from the start, and leave out what comes later"
        )
    if max(abs(x), abs(y)) > MOST_CM:
        raise TracksError(
            f"{where}: ({x:g}, {y:g}) is more than {MOST_CM:g} cm from the origin, which no robot "
            "walks; give positions in cm"
        )
    return cycle, x, y


def _number(where: str, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise TracksError(
            f"{where}: {name} must be a finite number such as 1.25, got {text.strip()[:40]!r}; "
            "leave the line out where it was not measured"
        )
    return value


def _check_order(where: str, before: list[Point], cycle: float) -> None:
    if not before and cycle != 0:
        raise TracksError(
            f"{where}: a trial starts at cycle 0, got {cycle:g}; count from its first line, and "
            "give each run of a robot a trial of its own"
        )
    if before and cycle <= before[-1][0]:
        raise TracksError(
            f"{where}: cycle {cycle:g} comes after {before[-1][0]:g}; sort the lines of a trial, "
            "and give each run of a robot a trial of its own"
        )
