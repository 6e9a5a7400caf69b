"""Files of tracks, read as trials: this package's CSV, and exports of Tracker and DeepLabCut.

docs/trials.md describes each. Errors name the file, the line and the remedy.

Sources: for Tracker (physlets.org/tracker, File > Export > Data File), the files shown on
physics.brocku.ca/Courses/2P20/Tracker, page 21: a line of names, each above the first column of its
track; a line of columns that begins with t; a line per time, empty where the track has no mark;
"#multi:" before all that if there are several tracks. For DeepLabCut, Nath et al. 2019
(doi.org/10.1038/s41596-019-0176-0): rows scorer, individuals (only with several animals), bodyparts
and coords, then one per frame.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softvox_gym.design import Design
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import (
    MOST_CM,
    VOXEL_CM,
    CsvError,
    Point,
    check_order,
    content_of,
    number_in,
    points_in,
    rows,
)
from softvox_gym.trials.trial import SIMULATED_VOXEL_CM, Trial, TrialError

#: Units in cm; a scale may be one of them instead of a reference length.
UNITS = {"cm": 1.0, "mm": 0.1, "m": 100.0}

#: Errors for a missing or needless scale, for files in cm, in pixels or in an unnamed unit.
SCALES = {
    "cm": "has x_cm and y_cm; leave out --scale, or, if they are in pixels, call them x_px and "
    "y_px",
    "px": "is in pixels; give a reference length, such as --scale 10/437 if 10 cm are 437 pixels",
    "": "doesn't name its unit; give --scale cm, mm or m, the unit of Tracker's calibration stick, "
    "or a reference length",
}

#: Latest cycle at which a track may begin; it then counts as 0.
LATEST = 0.1

#: Most lines before the points of an export.
HEAD = 5

#: Columns of a point in this package's CSV: its time, x and y.
COLUMNS = [(clock, f"x_{unit}", f"y_{unit}") for clock in ("cycle", "t_s") for unit in ("cm", "px")]

Paths = str | Path | Iterable[str | Path] | Mapping[Path, bytes]


@dataclass(frozen=True, kw_only=True)
class Film:
    """Facts missing in the file of a track: how its numbers become cm along the robot's axes.

    ValueError if a value is invalid; the message names it.
    """

    #: Length over its value in the file: "10/437" if 10 cm are 437 pixels, or "cm", "mm", "m".
    scale: str | None = None
    #: Width and height of the picture in pixels; no point may be outside.
    picture: tuple[int, int] | None = None
    #: "up" or "down", the direction of y in the picture: by default down for positions in pixels.
    #: The other one mirrors a film from below, whose `x_axis_deg` then counts clockwise.
    y: str | None = None
    #: Direction of the robot's +x axis at the start, counter-clockwise from the picture's right.
    x_axis_deg: float = 0.0
    #: Time when the pump starts; earlier rows are left out. By default that of the first row.
    start_s: float | None = None
    #: Frames per second, for a file that counts frames.
    fps: float | None = None
    #: Tracker's track, or DeepLabCut's body part (INDIVIDUAL/BODYPART), if there are several.
    point: str | None = None
    #: DeepLabCut's points below this likelihood are left out.
    likelihood: float = 0.9

    def __post_init__(self) -> None:
        for name, is_good, what in (
            ("y", self.y in (None, "up", "down"), "up or down"),
            ("fps", self.fps is None or 0 < self.fps <= 1e6, "above 0 and at most 1e6"),
            ("likelihood", 0 <= self.likelihood <= 1, "from 0 to 1"),
            ("x_axis_deg", -360 < self.x_axis_deg <= 360, "above -360 and at most 360"),
            ("start_s", self.start_s is None or math.isfinite(self.start_s), "a time in seconds"),
        ):
            if not is_good:
                raise ValueError(f"{name} must be {what}, got {getattr(self, name)}")
        _ = self.cm  # raises if the scale is invalid

    @property
    def cm(self) -> float:
        """The file's unit in cm, by the scale."""
        if self.scale is None or self.scale in UNITS:
            return UNITS[self.scale or "cm"]
        try:
            length, of = map(float, self.scale.replace("_", "?").split("/"))
        except ValueError:
            length = of = math.nan
        if not (0 < length < 1e6 and 0 < of < 1e6 and length <= 1000 * of):
            raise ValueError(
                "scale must be cm, mm, m, or a reference length such as 10/437 if 10 cm are 437 "
                f"pixels, got {self.scale[:40]!r}"
            )
        return length / of


class Found(NamedTuple):
    """A trial found in a file."""

    trial: Trial
    #: File and line where its track begins.
    place: str
    #: Number of lines without a position of the robot, or with too low a likelihood.
    left_out: int


class Track(NamedTuple):
    """A track as in its file."""

    points: list[Point]
    #: "cycle" or "t_s"; and "cm", "px" or, as Tracker was calibrated, "".
    clock: str
    unit: str
    #: The time in the first row of the file, whether or not that has a point.
    begin: float = 0.0
    #: design and repetition, if the file has them.
    said: Mapping[str, Any] = {}
    #: Its owner, if there are several in the file.
    name: str = ""
    left_out: int = 0


def read_track_files(
    paths: Paths,
    *,
    film: Film | None = None,
    design: int | str | Design | None = None,
    lattice: Lattice | None = None,
    repetition: int | None = None,
    **facts: Any,
) -> tuple[Found, ...]:
    r"""Read files of tracks that were all recorded under the same conditions.

    Parameters
    ----------
    paths : path, iterable of paths, or mapping of Path to bytes
        A mapping has the contents that were already read.
    film : Film, optional
    design : int, str or Design, optional
        Design of all tracks, if the files don't name it.
    lattice : Lattice, optional
        Lattice of the designs that files name; by default that of `design`, or 2x2x2.
    repetition : int, optional
        Number of a design's first track, if the files don't have it; later tracks count from there.
    **facts
        Other facts for `Trial`: surface, who, date, license and others.

    Raises
    ------
    ValueError
        If the lattice lacks a design; `TrialError` if a fact is invalid for a trial;
        `softvox_gym.real_tracks.CsvError` if a file can't be used, naming the line.

    Examples
    --------
    >>> from pathlib import Path
    >>> file = {Path("run.csv"): b"t_s,x_px,y_px\n0,100,300\n1,100,256.3\n2,100,212.6\n"}
    >>> film = Film(scale="10/437", x_axis_deg=90)
    >>> (found,) = read_track_files(file, film=film, design=6453, frequency_hz=0.5,
    ...     surface="acrylic", who="A. Person", date="2026-11-27", license="CC0-1.0")
    >>> found.trial.cycle.tolist(), found.trial.position.tolist()
    ([0.0, 0.5, 1.0], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    """
    film = film or Film()
    is_simulated = facts.get("source") == "simulated"
    facts = {"voxel_cm": SIMULATED_VOXEL_CM if is_simulated else VOXEL_CM, **facts}
    own = None if design is None else Design(design, shape=lattice)
    lattice = lattice or (own.lattice if own else Lattice())
    first = 1 if repetition is None else repetition
    time, still = np.array([0, 1e-5]), np.zeros((2, 2))  # only facts can invalidate this
    Trial(design=own or Design(1), cycle=time, position=still, repetition=first, **facts)
    found: list[Found] = []
    count: Counter[Design] = Counter()
    files = Counter(map(Path, [paths] if isinstance(paths, str | Path) else paths))
    for path, times in files.items():
        if times > 1:
            raise CsvError(f"{path} is given {times} times; give it once")
        content = paths[path] if isinstance(paths, Mapping) else content_of(path)
        kind, tracks = _tracks(path, content, film, lattice)
        for column, option in {"design": own, "repetition": repetition}.items():
            if option is not None and column in tracks[0].said:
                name = "trial" if column == "repetition" else column
                raise CsvError(f"{path} has a column {name}; leave out --{column}, or the column")
        provenance = {"file": path.name, "sha256": sha256(content).hexdigest(), "kind": kind}
        for track in tracks:
            said = {"repetition": first, "provenance": provenance, **track.said}
            if own is not None:
                said = {"design": own, **said}
            if (robot := said.get("design")) is None:
                raise CsvError(f"{path} names no design; give --design, or add a column design")
            if "repetition" not in track.said:
                said["repetition"] += count[robot]
                count[robot] += 1
            found.append(_found(path, track, film, {**facts, **said}))
    return tuple(found)


def _tracks(
    path: Path, content: bytes, film: Film, lattice: Lattice
) -> tuple[str, tuple[Track, ...]]:
    """Return the kind of a file, recognised by its content, and its tracks."""
    if content.startswith(b"\x89HDF"):
        raise CsvError(
            f"{path} is HDF5, not CSV; let DeepLabCut write CSV, with analyze_videos(..., "
            "save_as_csv=True) or analyze_videos_converth5_to_csv"
        )
    first = content.removeprefix(b"\xef\xbb\xbf")[:7].lower()
    if first.startswith(b"scorer"):
        return "deeplabcut", (_deeplabcut(path, content, film),)
    if head := _columns(path, content):
        tracks: tuple[Track, ...] = (_tracker(path, content, film.point, *head),)
    else:
        tracks = _csv(path, content, lattice)
        if film.point is not None:
            raise CsvError(f"{path} doesn't name its points; leave out --point")
    if film.fps is not None:
        raise CsvError(f"{path} has times, not frame numbers; leave out --fps")
    return "tracker" if head else "csv", tracks


def _csv(path: Path, content: bytes, lattice: Lattice) -> tuple[Track, ...]:
    """Return the tracks of this package's own format."""
    _, names = next(rows(path, content), (1, []))
    columns = tuple(name for name in sorted({*sum(COLUMNS, ())}) if name in names)
    if columns not in COLUMNS:
        raise CsvError(
            f"{path}, line 1: the first line must name cycle or t_s, and x_cm,y_cm or x_px,y_px, "
            "separated by commas, or be that of an export from Tracker or DeepLabCut, got "
            f"{','.join(names)[:60]!r}"
        )
    more = [name for name in ("design", "trial") if name in names]
    made = []
    for (design, trial), points in points_in(path, content, [*more, *columns], lattice).items():
        said = {} if design is None else {"design": design}
        if trial is not None:
            is_short = trial.isdecimal() and len(trial) < 10
            said["repetition"] = int(trial) if is_short else trial  # invalid in a trial
        made.append(Track(points, columns[0], columns[1][2:], points[0][1], said))
    if not made:
        raise CsvError(f"{path} has no points; add lines, or leave the file out")
    return tuple(made)


def _columns(path: Path, content: bytes) -> tuple[int, list[str], list[str], str] | None:
    """Return the line of Tracker's columns, their names, the cells above, and the separator."""
    head = b"\n".join(content[:20_000].split(b"\n")[:HEAD])
    for delimiter in "\t;,":
        above: list[str] = []
        try:
            for line, cells in rows(path, head, delimiter):
                if cells[:1] == ["t"] and {"x", "y"} <= set(cells):
                    return line, cells, above, delimiter
                above = cells
        except CsvError:  # reported when the whole file is read
            continue
    return None


def _tracker(
    path: Path,
    content: bytes,
    point: str | None,
    line: int,
    names: list[str],
    above: list[str],
    delimiter: str,
) -> Track:
    """Return the track exported by Tracker, or one of several."""
    owner, owners = "", []
    for i in range(len(names)):
        owner = (above[i] if i < len(above) else "") or owner
        owners.append(owner)
    name, columns = _chosen(f"{path}, line {line}", owners, names, ("x", "y"), point)
    lines = (row for row in rows(path, content, delimiter) if row[0] > line)
    comma = "" if delimiter == "," else ","
    return _filled(path, "", name, lines, {"t": 0, **columns}, len(names), comma=comma)


def _deeplabcut(path: Path, content: bytes, film: Film) -> Track:
    """Return the track of a body part."""
    lines = rows(path, content)
    head: dict[str, list[str]] = {}
    for _, cells in islice(lines, HEAD):
        head[cells[0] if cells else ""] = cells[1:]
        if "coords" in head:
            break
    if not {"bodyparts", "coords"} <= set(head):
        raise CsvError(
            f"{path}, line 1: DeepLabCut's files begin with lines scorer, bodyparts and coords; "
            "export the file again"
        )
    if film.fps is None:
        raise CsvError(f"{path} has frame numbers; give the film's frames per second with --fps")
    parts, names, who = head["bodyparts"], head["coords"], head.get("individuals", [])
    if len(set(who)) > 1:
        parts = [f"{one}/{part}" for one, part in zip(who, parts, strict=False)]
    wanted = ("x", "y", "likelihood") if "likelihood" in names else ("x", "y")
    where = f"{path}, line {len(head)}"
    name, columns = _chosen(where, ["", *parts], ["", *names], wanted, film.point)
    columns, width = {"frame": 0, **columns}, len(parts) + 1
    track = _filled(path, "px", name, lines, columns, width, likelihood=film.likelihood)
    points = [(line, frame / film.fps, x, y) for line, frame, x, y in track.points]
    return track._replace(points=points, begin=track.begin / film.fps)


def _chosen(
    where: str, owners: list[str], names: list[str], wanted: tuple[str, ...], point: str | None
) -> tuple[str, dict[str, int]]:
    """Return the owner whose columns are used, and the indices of the wanted ones."""
    found: dict[str, dict[str, int]] = {}
    for i, (owner, name) in enumerate(zip(owners, names, strict=False)):
        own = found.setdefault(owner, {})
        if name in wanted and own.setdefault(name, i) != i:
            raise CsvError(f"{where}: {owner[:40]!r} has {name} twice; export the file again")
    whole = {owner: own for owner, own in found.items() if set(wanted) <= set(own)}
    named = next(iter(whole)) if point is None and len(whole) == 1 else point
    if named is None or named not in whole:
        shown = ", ".join(name[:40] for name in list(whole)[:10])
        asked = "" if point is None else f", not {point!r}"
        raise CsvError(
            f"{where}: has {', '.join(wanted)} of {shown}{asked}; choose one of them with --point"
            if whole
            else f"{where}: no track has {' and '.join(wanted)}; export the file with both"
        )
    return named, {one: whole[named][one] for one in wanted}


def _filled(
    path: Path,
    unit: str,
    name: str,
    lines: Iterable[tuple[int, list[str]]],
    columns: Mapping[str, int],
    width: int,
    *,
    comma: str = "",
    likelihood: float = 0.0,
) -> Track:
    """Return the track in the rows of an export: its columns of time, x, y and likelihood.

    `comma` may be the decimal sign instead of a point.
    """
    points: list[Point] = []
    times: list[float] = []
    signs: set[str] = set()
    for line, cells in lines:
        if not any(cells):
            continue
        texts = {key: cells[i] if i < len(cells) else "" for key, i in columns.items()}
        is_seen = any(texts[key].lower() not in ("", "nan") for key in ("x", "y"))
        told = list(texts.items()) if is_seen else list(texts.items())[:1]
        signs.update(sign for _, text in told for sign in f".{comma}" if sign in text)
        if any(cells[width:]) or len(signs) > 1:
            raise CsvError(
                f"{path}, line {line}: {len(cells)} values for {width} columns, or numbers with "
                "both a point and a comma; export the file again, with tabs between columns"
            )
        try:
            time, *at = (number_in(key, text.replace(comma or ".", ".")) for key, text in told)
        except ValueError as error:
            raise CsvError(f"{path}, line {line}: {error}") from None
        times.append(time)
        if at[2:] and not 0 <= at[2] <= 1:
            raise CsvError(f"{path}, line {line}: likelihood must be from 0 to 1, got {at[2]:g}")
        if at and min(at[2:], default=1.0) >= likelihood:
            points.append((line, time, at[0], at[1]))
    if not points:
        raise CsvError(
            f"{path}: {name} has no position, or a likelihood below {likelihood:g}, on all "
            f"{len(times)} lines; give another --point or a lower --likelihood"
        )
    return Track(points, "t_s", unit, times[0], name=name, left_out=len(times) - len(points))


def _found(path: Path, track: Track, film: Film, facts: dict[str, Any]) -> Found:
    """Return a track as a trial: in cycles, and in cm along the robot's axes."""
    rate = 1.0 if track.clock == "cycle" else facts.get("frequency_hz")
    if rate is None:
        raise CsvError(f"{path} has times in seconds; give the actuation's --frequency-hz")
    points = _from_start(path, track, film, rate)
    is_said = {"cm": film.scale in (None, "cm"), "px": film.scale not in (None, *UNITS)}
    if not is_said.get(track.unit, film.scale is not None):
        raise CsvError(f"{path} {SCALES[track.unit]}")
    if track.unit != "px" and film.picture:
        raise CsvError(f"{path} is not in pixels; leave out --picture")
    size = max(facts["design"].shape) * facts["voxel_cm"]
    cos, sin = math.cos(math.radians(film.x_axis_deg)), math.sin(math.radians(film.x_axis_deg))
    cm = film.cm
    up = cm if (film.y or ("down" if track.unit == "px" else "up")) == "up" else -cm
    first, begin, left, low = points[0]
    made = [(0.0, 0.0, 0.0)]
    for line, time, x, y in points:
        dx, dy = (x - left) * cm, (y - low) * up
        here = ((time - begin) * rate, cos * dx + sin * dy, cos * dy - sin * dx)
        outside = track.unit == "px" and _outside(x, y, film.picture)
        if fault := outside or _fault(made[-1], here, size):
            raise CsvError(f"{path}, line {line}: {fault}")
        made.append(here)
    at = np.array(made[1:])
    provenance = {**facts["provenance"], "x_axis_deg": film.x_axis_deg}
    if track.unit == "px" or (track.unit == "" and film.scale not in UNITS):
        provenance["cm_per_pixel"] = cm
    if track.name:
        provenance["point"] = track.name
    place = f"{path}, line {first}"
    try:
        facts = {**facts, "provenance": provenance}
        trial = Trial(cycle=at[:, 0], position=at[:, 1:], **facts)
    except TrialError as error:
        raise CsvError(f"{place}: {error}") from None
    return Found(trial, place, track.left_out)


def _from_start(path: Path, track: Track, film: Film, rate: float) -> list[Point]:
    """Return the points since the pump started."""
    check_order(path, track.points, track.clock)
    is_seconds = track.clock == "t_s"
    if film.start_s is not None and not is_seconds:
        raise CsvError(f"{path} counts cycles from the start of the pump; leave out --start-s")
    start = track.begin if film.start_s is None else film.start_s
    start = start if is_seconds else 0.0
    kept = [point for point in track.points if point[1] >= start or not is_seconds]
    if len(kept) < 2:
        points = f"{len(kept)} point{'s' * (not kept)}"
        raise CsvError(
            f"{path}, line {track.points[0][0]}: the track has {points} since the start "
            f"at {start:g} s, but needs two; add points, give another --start-s, or take it out"
        )
    late = (kept[0][1] - start) * rate
    if not 0 <= late <= (LATEST if is_seconds else 0):
        raise CsvError(
            f"{path}, line {kept[0][0]}: the first point is at cycle {late:g}, but a track must "
            "begin at cycle 0, when the pump starts; count from there"
            f"{', or give --start-s' if is_seconds else ''}"
        )
    return kept


def _outside(x: float, y: float, picture: tuple[int, int] | None) -> str:
    """Return what is wrong with a point in pixels; "" if it is inside the picture."""
    width, height = picture or (math.inf, math.inf)
    if 0 <= x <= width and 0 <= y <= height:
        return ""
    size = f" of {width} x {height} pixels" if picture else ", which begins at 0, 0"
    return f"({x:g}, {y:g}) is outside the picture{size}; correct it, or leave out the line"


def _fault(before: tuple[float, ...], here: tuple[float, ...], size: float) -> str:
    """Return why a robot of this size in cm can't be there next; "" if it can.

    It may fall by its length, and walk its length per cycle: the fastest simulated one needs four.
    """
    if not (far := math.hypot(*here[1:])) <= MOST_CM:
        return (
            f"the point is {far:.4g} cm from the first, and no robot goes {MOST_CM:g} cm; correct "
            "--scale, or leave out the line"
        )
    if (jump := math.dist(here[1:], before[1:])) > (most := size * (1 + here[0] - before[0])):
        return (
            f"the point is {jump:.3g} cm from the previous one, but a robot of {size:g} cm goes at "
            f"most {most:.3g} cm in that time; correct --scale, or leave out the line"
        )
    return ""
