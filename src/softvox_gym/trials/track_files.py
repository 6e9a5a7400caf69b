"""Files of tracks, read as trials: this package's CSV, and what Tracker and DeepLabCut export.

docs/trials.md says what each holds. Errors name the file, the line and the remedy.

Sources: of Tracker (physlets.org/tracker, File > Export > Data File), the files shown on
physics.brocku.ca/Courses/2P20/Tracker, page 21: a line of names, each above the first column of its
track; a line of columns that begins with t; a line per time, with nothing where the track has no
mark; "#multi:" before all that where there are several tracks. Of DeepLabCut, Nath et al. 2019
(doi.org/10.1038/s41596-019-0176-0): rows scorer, individuals (of several animals only), bodyparts
and coords, then one per frame.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import (
    MOST_CM,
    CsvError,
    content_of,
    design_in,
    number_in,
    records,
    rows,
)
from softvox_gym.trials.trial import (
    MOST_REPETITIONS,
    SIMULATED_VOXEL_CM,
    VOXEL_CM,
    Trial,
    TrialError,
)

#: What a scale may be in place of a reference length, cm.
UNITS = {"cm": 1.0, "mm": 0.1, "m": 100.0}

#: Cycles after the start at which a track may begin at the latest: that one is counted as 0.
LATEST = 0.1

#: Lines before the points of an export, at most.
HEAD = 5

Array = NDArray[np.float64]

Paths = str | Path | Iterable[str | Path] | Mapping[Path, bytes]

#: The line of a point, its time, x and y.
Point = tuple[int, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Film:
    """What the file of a track doesn't say: how its numbers become cm along the robot's axes.

    Parameters
    ----------
    kind : str, optional
        One of `KINDS`; by default what the content looks like.
    scale : str, optional
        Length over what the file calls it: "10/437" where 10 cm are 437 pixels, or "cm", "mm", "m".
    picture : (int, int), optional
        Width and height in pixels, which no point may leave.
    y : {"up", "down"}, optional
        Where y grows in the picture: by default down where positions are in pixels.
    x_axis_deg : float
        Where the robot's +x axis points at the start, counter-clockwise from the picture's right.
    start_s : float, optional
        When the pump starts; what is before is left out. By default at the first row.
    fps : float, optional
        Frames per second, of a file that counts frames.
    point : str, optional
        The track of Tracker's or the body part of DeepLabCut's (INDIVIDUAL/BODYPART of several
        animals), where there are several.
    likelihood : float
        DeepLabCut's points below are left out.
    allow_jumps : bool
        Whether a point may be farther from the one before than a robot could move.

    Raises
    ------
    ValueError
        For anything else, naming it.
    """

    kind: str | None = None
    scale: str | None = None
    picture: tuple[int, int] | None = None
    y: str | None = None
    x_axis_deg: float = 0.0
    start_s: float | None = None
    fps: float | None = None
    point: str | None = None
    likelihood: float = 0.9
    allow_jumps: bool = False

    def __post_init__(self) -> None:
        for name, choices in (("kind", tuple(KINDS)), ("y", ("up", "down"))):
            if (value := getattr(self, name)) is not None and value not in choices:
                raise ValueError(f"{name} must be one of {', '.join(choices)}, got {value!r}")
        if self.fps is not None and not 0 < self.fps <= 1e6:
            raise ValueError(f"fps must be above 0 and at most 1e6, got {self.fps}")
        if not 0 <= self.likelihood <= 1:
            raise ValueError(f"likelihood must be from 0 to 1, got {self.likelihood}")
        if not -360 < self.x_axis_deg <= 360:
            raise ValueError(f"x_axis_deg must be from -360 to 360, got {self.x_axis_deg}")
        if self.start_s is not None and not math.isfinite(self.start_s):
            raise ValueError(f"start_s must be a time, got {self.start_s}")
        if self.scale is not None:
            _cm(self.scale)


class Found(NamedTuple):
    """A trial that a file holds."""

    trial: Trial
    path: Path
    #: Where its track begins.
    line: int
    #: Lines on which the robot was nowhere, or not likely enough.
    left_out: int


class Track(NamedTuple):
    """A track as its file has it."""

    points: list[Point]
    #: "cycle" or "s"; and "cm", "px" or, as Tracker was calibrated, "".
    clock: str
    unit: str
    #: The time in the first row of the file, whether or not that has a point.
    begin: float = 0.0
    design: Design | None = None
    repetition: int | None = None
    #: Whose it is, of several in the file.
    name: str = ""
    #: Lines on which it is nowhere, or not likely enough.
    left_out: int = 0


def trials_of(paths: Paths, **options: Any) -> tuple[Trial, ...]:
    r"""Return the trials that files of tracks hold; `read_track_files` has the options.

    Examples
    --------
    >>> from pathlib import Path
    >>> file = {Path("run.csv"): b"t_s,x_px,y_px\n0,100,300\n1,100,256.3\n2,100,212.6\n"}
    >>> film = Film(scale="10/437", x_axis_deg=90)
    >>> (trial,) = trials_of(file, film=film, design=6453, frequency_hz=0.5, surface="acrylic",
    ...                      who="A. Person", date="2026-11-27", license="CC0-1.0")
    >>> trial.cycle.tolist(), trial.position.tolist()
    ([0.0, 0.5, 1.0], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    """
    return tuple(found.trial for found in read_track_files(paths, **options))


def read_track_files(
    paths: Paths,
    *,
    film: Film | None = None,
    design: int | str | Design | None = None,
    lattice: Lattice | None = None,
    repetition: int | None = None,
    known: Iterable[Trial] = (),
    **facts: Any,
) -> tuple[Found, ...]:
    """Read files of tracks, all of which were made under the same conditions.

    Parameters
    ----------
    paths : path, iterable of paths, or mapping of Path to bytes
        With the contents where these have been read.
    film : Film, optional
    design : int, str or Design, optional
        Of all tracks, where the files don't say it.
    lattice : Lattice, optional
        Of the designs that files name; by default that of `design`, or 2x2x2.
    repetition : int, optional
        Of the first track of a design, where the files don't say it; further ones are numbered on.
    known : iterable of Trial
        None of the tracks may be that of one of these under another name.
    **facts
        What `Trial` takes besides: surface, who, date, license and others.

    Returns
    -------
    tuple of Found
        In the order of the files, and within them in that of their first lines.

    Raises
    ------
    TypeError, ValueError
        For a design that the lattice has not.
    TrialError
        For a fact that no trial can have.
    softvox_gym.real_tracks.CsvError
        For a file that can't be used, naming it, the line and the remedy.
    """
    film = film or Film()
    is_simulated = facts.get("source") == "simulated"
    facts = {"voxel_cm": SIMULATED_VOXEL_CM if is_simulated else VOXEL_CM, **facts}
    first = 1 if repetition is None else repetition
    own = None if design is None else Design(design, shape=lattice)
    time, still = np.array([0, 1e-5]), np.zeros((2, 2))  # of a trial that only the facts can fault
    Trial(design=own or Design(1), cycle=time, position=still, repetition=first, **facts)
    lattice = lattice or (own.lattice if own else Lattice())
    found: list[Found] = []
    count: Counter[Design] = Counter()
    for path in map(Path, [paths] if isinstance(paths, str | Path) else paths):
        content = paths[path] if isinstance(paths, Mapping) else content_of(path)
        kind = film.kind or _kind(path, content)
        given = {"file": path.name, "sha256": sha256(content).hexdigest(), "kind": kind}
        for track in tracks_in(path, content, kind, film, lattice):
            said = _said(path, track, own, repetition, count)
            found.append(_found(path, track, film, {**facts, **said, "provenance": given}))
    _check_twice(found, known)
    return tuple(found)


def tracks_in(
    path: Path, content: bytes, kind: str, film: Film, lattice: Lattice
) -> tuple[Track, ...]:
    """Return the tracks in the content of a file of a kind, as it has them.

    Raises
    ------
    CsvError
        For a content that is not as docs/trials.md says.
    """
    if content.startswith(b"\x89HDF"):
        raise CsvError(
            f"{path} is HDF5, and CSV is read; let DeepLabCut write that, by analyze_videos(..., "
            "save_as_csv=True) or analyze_videos_converth5_to_csv"
        )
    made = tuple(KINDS[kind](path, content, film, lattice))
    if not any(track.points for track in made):
        raise CsvError(f"{path} has no point; add lines, or leave the file out")
    return made


def _kind(path: Path, content: bytes) -> str:
    """Return what a content looks like."""
    first = content.removeprefix(b"\xef\xbb\xbf")[:7].lower()
    if first.startswith(b"scorer"):
        return "deeplabcut"
    return "tracker" if first == b"#multi:" or _columns(path, content) else "csv"


def _csv(path: Path, content: bytes, film: Film, lattice: Lattice) -> Iterator[Track]:
    """Yield the tracks of this package's own format."""
    clock = unit = ""
    tracks: dict[tuple[Design | None, int | None], list[Point]] = {}
    for line, record in records(path, content, _lack):
        clock, unit = "cycle" if "cycle" in record else "t_s", "cm" if "x_cm" in record else "px"
        try:
            design = design_in(record["design"], lattice) if "design" in record else None
            repetition = _repetition(record["trial"]) if "trial" in record else None
        except ValueError as error:
            raise CsvError(f"{path}, line {line}: {error}") from None
        names = (clock, f"x_{unit}", f"y_{unit}")
        t, x, y = _numbers(path, line, ((name, record[name]) for name in names))
        tracks.setdefault((design, repetition), []).append((line, t, x, y))
    for (design, repetition), points in tracks.items():
        clock = clock.removeprefix("t_")
        yield Track(points, clock, unit, points[0][1], design, repetition)


def _lack(names: list[str]) -> str:
    """Return what a first line must name, where it doesn't."""
    named = {name for name in names if name in _COLUMNS}
    is_once = len(named) == sum(name in _COLUMNS for name in names)
    if is_once and named - {"design", "trial"} in _GOOD:
        return ""
    return (
        "cycle or t_s, and x_cm,y_cm or x_px,y_px, each once (and design and trial, where no "
        "option says them)"
    )


_GOOD = [{clock, f"x_{unit}", f"y_{unit}"} for clock in ("cycle", "t_s") for unit in ("cm", "px")]
_COLUMNS = set.union(*_GOOD, {"design", "trial"})


def _repetition(text: str) -> int:
    if text.isdecimal() and len(text) <= 5 and 1 <= int(text) <= MOST_REPETITIONS:
        return int(text)
    raise ValueError(
        f"trial must be which repetition it is, a whole number from 1 to {MOST_REPETITIONS}, got "
        f"{text[:40]!r}"
    )


def _columns(path: Path, content: bytes) -> tuple[int, list[str], list[str], str] | None:
    """Return the line of Tracker's columns, these, the cells above them, and what separates."""
    head = b"\n".join(content[:20_000].split(b"\n")[:HEAD])
    for delimiter in "\t;,":
        above: list[str] = []
        try:
            for line, cells in rows(path, head, delimiter):
                if cells[:1] == ["t"] and {"x", "y"} <= set(cells):
                    return line, cells, above, delimiter
                above = cells
        except CsvError:  # told where the whole is read
            continue
    return None


def _tracker(path: Path, content: bytes, film: Film, lattice: Lattice) -> Iterator[Track]:
    """Yield the track that Tracker has exported, or one of several."""
    if (head := _columns(path, content)) is None:
        raise CsvError(
            f"{path}, line 1: none of the first {HEAD} lines begins with the column t and has x "
            "and y, as Tracker exports them; export the file anew, or give another --format"
        )
    at, names, above, delimiter = head
    owner, owners = "", []
    for i in range(len(names)):
        owner = (above[i] if i < len(above) else "") or owner
        owners.append(owner)
    name, columns = _chosen(f"{path}, line {at}", owners, names, ("x", "y"), film.point)
    lines = islice(rows(path, content, delimiter), at, None)
    comma = "." if delimiter == "," else ","
    track = Track([], "s", "", name=name)
    yield _filled(path, track, lines, {"t": 0, **columns}, len(names), comma=comma)


def _deeplabcut(path: Path, content: bytes, film: Film, lattice: Lattice) -> Iterator[Track]:
    """Yield the track of a body part."""
    lines = rows(path, content)
    head: dict[str, list[str]] = {}
    at = 0
    for at, cells in islice(lines, HEAD):  # noqa: B007, it is told below
        head[cells[0] if cells else ""] = cells[1:]
        if "coords" in head:
            break
    if not {"bodyparts", "coords"} <= set(head):
        raise CsvError(
            f"{path}, line 1: DeepLabCut's files begin with lines scorer, bodyparts and coords; "
            "export the file anew, or give another --format"
        )
    if film.fps is None:
        raise CsvError(f"{path} counts frames; give the frames per second of the film, --fps")
    parts, coordinates, who = head["bodyparts"], head["coords"], head.get("individuals", [])
    if len(set(who)) > 1:
        parts = [f"{one}/{part}" for one, part in zip(who, parts, strict=False)]
    wanted = ("x", "y", "likelihood") if "likelihood" in coordinates else ("x", "y")
    parts, coordinates = ["", *parts], ["", *coordinates]  # below the first cell are the frames
    name, columns = _chosen(f"{path}, line {at}", parts, coordinates, wanted, film.point)
    track = Track([], "s", "px", name=name)
    columns = {"frame": 0, **columns}
    yield _filled(
        path, track, lines, columns, len(parts), per_s=film.fps, likelihood=film.likelihood
    )


def _filled(
    path: Path,
    track: Track,
    lines: Iterable[tuple[int, list[str]]],
    columns: dict[str, int],
    width: int,
    *,
    per_s: float = 1.0,
    comma: str = ".",
    likelihood: float = 0.0,
) -> Track:
    """Return a track with the points of an export: its columns of time, x, y and likelihood."""
    begin = None
    left_out = 0
    for line, cells in lines:
        if not any(cells):
            continue
        if any(cells[width:]):
            raise CsvError(
                f"{path}, line {line}: {len(cells)} values for {width} columns; export the file "
                "anew, with tabs between them"
            )
        texts = [cells[i].replace(comma, ".") if i < len(cells) else "" for i in columns.values()]
        is_seen = any(text.lower() not in ("", "nan") for text in texts[1:3])
        told = list(zip(columns, texts, strict=True))
        time, *values = _numbers(path, line, told if is_seen else told[:1])
        begin = time / per_s if begin is None else begin
        if is_seen and not (values[2:] and values[2] < likelihood):
            track.points.append((line, time / per_s, values[0], values[1]))
        else:
            left_out += 1
    if left_out and not track.points:
        raise CsvError(
            f"{path}: {track.name} is nowhere, or below the likelihood {likelihood:g}, on all "
            f"{left_out} lines; give another --point or a lower --likelihood"
        )
    return track._replace(begin=begin or 0.0, left_out=left_out)


#: What reads each kind of file.
KINDS = {"csv": _csv, "tracker": _tracker, "deeplabcut": _deeplabcut}


def _chosen(
    where: str, owners: list[str], names: list[str], wanted: tuple[str, ...], point: str | None
) -> tuple[str, dict[str, int]]:
    """Return whose columns are taken, and where those wanted are."""
    found: dict[str, dict[str, int]] = {}
    for i, (owner, name) in enumerate(zip(owners, names, strict=False)):
        found.setdefault(owner, {}).setdefault(name, i)
    whole = {owner: own for owner, own in found.items() if set(wanted) <= set(own)}
    named = next(iter(whole)) if point is None and len(whole) == 1 else point
    if named is None or named not in whole:
        shown = ", ".join(name[:40] for name in list(whole)[:10])
        asked = "" if point is None else f", and not of {point!r}"
        raise CsvError(
            f"{where}: has {', '.join(wanted)} of {shown}{asked}; name one of them by --point"
            if whole
            else f"{where}: no track has {', '.join(wanted)}; export the file with all of them"
        )
    return named, {one: whole[named][one] for one in wanted}


def _numbers(path: Path, line: int, told: Iterable[tuple[str, str]]) -> list[float]:
    try:
        return [number_in(name, text) for name, text in told]
    except ValueError as error:
        raise CsvError(f"{path}, line {line}: {error}") from None


def _said(
    path: Path, track: Track, design: Design | None, repetition: int | None, count: Counter[Design]
) -> dict[str, Any]:
    """Return the design and the repetition, by the file or else by the options."""
    for column, own, option, given in (
        ("design", track.design, "--design", design),
        ("trial", track.repetition, "--repetition", repetition),
    ):
        if own is not None and given is not None:
            raise CsvError(f"{path} has a column {column}, and so no {option}; leave one out")
    own = design if track.design is None else track.design
    if own is None:
        raise CsvError(f"{path} says no design; give --design, or a column design")
    count[own] += 1
    number = track.repetition or (repetition or 1) + count[own] - 1
    return {"design": own, "repetition": number}


def _found(path: Path, track: Track, film: Film, facts: dict[str, Any]) -> Found:
    """Return a track as a trial: in cycles, and in cm along the robot's axes."""
    rate = 1.0 if track.clock == "cycle" else facts.get("frequency_hz")
    if rate is None:
        raise CsvError(f"{path} counts seconds; give --frequency-hz, that of the actuation")
    points = _from_start(path, track, film, rate)
    scale = _scale(path, track.unit, film.scale)
    turn = _turn(film, "down" if track.unit == "px" else "up")
    size = max(facts["design"].shape) * facts["voxel_cm"]
    _, begin, left, low = points[0]
    made = [(0.0, 0.0, 0.0)]
    for line, time, x, y in points:
        here = ((time - begin) * rate, *turn((x - left) * scale, (y - low) * scale))
        fault = _outside((x, y), track.unit, film.picture) or _fault(
            made[-1], here, math.inf if film.allow_jumps else size
        )
        if fault:
            raise CsvError(f"{path}, line {line}: {fault}")
        made.append(here)
    provenance = dict(facts["provenance"])
    if track.unit == "px" or (track.unit == "" and film.scale not in UNITS):
        provenance["cm_per_pixel"] = scale
    provenance["x_axis_deg"] = film.x_axis_deg
    if track.name:
        provenance["point"] = track.name
    try:
        at = np.array(made[1:])
        facts = {**facts, "provenance": provenance}
        trial = Trial(cycle=at[:, 0], position=at[:, 1:], **facts)
    except TrialError as error:
        raise CsvError(f"{path}, line {points[0][0]}: {error}") from None
    return Found(trial, path, points[0][0], track.left_out)


def _from_start(path: Path, track: Track, film: Film, rate: float) -> list[Point]:
    """Return the points from the start of the pump on."""
    is_seconds = track.clock == "s"
    for before, point in pairwise(track.points):
        if point[1] <= before[1]:
            raise CsvError(
                f"{path}, line {point[0]}: {track.clock} {point[1]:g} comes after {before[1]:g}; "
                "sort the lines, and number each run of a robot"
            )
    if film.start_s is not None and not is_seconds:
        raise CsvError(f"{path} counts cycles from the start of the pump; leave --start out")
    start = (track.begin if is_seconds else 0.0) if film.start_s is None else film.start_s
    kept = [point for point in track.points if point[1] >= start or not is_seconds]
    if len(kept) < 2:
        raise CsvError(
            f"{path}, line {track.points[0][0]}: the track has {len(kept)} points since the start "
            f"at {start:g}, and needs two; add points, give another --start, or take it out"
        )
    late = (kept[0][1] - start) * rate
    if not 0 <= late <= (LATEST if is_seconds else 0):
        raise CsvError(
            f"{path}, line {kept[0][0]}: the first point is at cycle {late:g}, and a track begins "
            f"at 0, with the pump; count from there{', or give --start' if is_seconds else ''}"
        )
    return kept


def _cm(scale: str) -> float:
    """Return how many cm something is that a scale tells of."""
    if scale in UNITS:
        return UNITS[scale]
    try:
        length, of = map(float, scale.replace("_", "?").split("/"))
    except ValueError:
        length = of = math.nan
    if not (0 < length < 1e6 and 0 < of < 1e6 and length <= 1000 * of):
        raise ValueError(
            "scale must be cm, mm, m, or a reference length such as 10/437 where 10 cm are 437 "
            f"pixels, got {scale[:40]!r}"
        )
    return length / of


def _scale(path: Path, unit: str, scale: str | None) -> float:
    """Return the length in cm of a file's unit."""
    if unit == "cm" and scale not in (None, "cm"):
        raise CsvError(f"{path} has x_cm, y_cm; leave --scale out, or call them x_px, y_px")
    if unit == "px" and (scale is None or scale in UNITS):
        raise CsvError(
            f"{path} has pixels; give a reference length, such as --scale 10/437 where 10 cm are "
            "437 pixels"
        )
    if unit == "" and scale is None:
        raise CsvError(
            f"{path} doesn't say its unit; give --scale cm, mm or m, that of Tracker's calibration "
            "stick, or a reference length"
        )
    return _cm(scale or "cm")


def _turn(film: Film, usual: str) -> Callable[[float, float], tuple[float, float]]:
    """Return what turns a way in the picture into one along the robot's axes."""
    up = 1 if (film.y or usual) == "up" else -1
    cos, sin = math.cos(math.radians(film.x_axis_deg)), math.sin(math.radians(film.x_axis_deg))
    return lambda x, y: (cos * x + sin * up * y, cos * up * y - sin * x)


def _outside(at: tuple[float, float], unit: str, picture: tuple[int, int] | None) -> str:
    """Return what is wrong with a point of a picture; nothing where it is in it."""
    if picture is None:
        return ""
    if unit != "px":
        return "positions are not in pixels; leave --picture out"
    if all(0 <= value <= most for value, most in zip(at, picture, strict=True)):
        return ""
    return (
        f"({at[0]:g}, {at[1]:g}) leaves the picture of {picture[0]} x {picture[1]} pixels; correct "
        "the point or --picture, or leave the line out"
    )


def _fault(before: tuple[float, ...], here: tuple[float, ...], size: float) -> str:
    """Return why a robot of a size in cm can't be there next; nothing where it can.

    It may be a whole length of it farther, as one that falls, and another one per cycle: the
    fastest that is simulated needs four cycles for its length.
    """
    if not math.hypot(*here[1:]) <= MOST_CM:
        return (
            f"the point is {math.hypot(*here[1:]):.4g} cm from the first, and no robot goes "
            f"{MOST_CM:g}; give another --scale, or leave the line out"
        )
    if (jump := math.dist(here[1:], before[1:])) > (most := size * (1 + here[0] - before[0])):
        return (
            f"the point is {jump:.3g} cm from the one before, and a robot of {size:g} cm can't go "
            f"{most:.3g} meanwhile; give another --scale, leave the line out, or --allow-jumps"
        )
    return ""


def _check_twice(found: Iterable[Found], known: Iterable[Trial]) -> None:
    """Raise CsvError where two trials tell one run otherwise, or one track of two runs."""
    runs: dict[Any, tuple[Trial, str]] = {}
    tracks: dict[Any, tuple[Trial, str]] = {}
    for trial in known:
        runs[trial.run] = tracks[_key(trial)] = trial, f"trial {trial.digest[:8]}"
    for trial, path, line, _ in found:
        where = f"{path}, line {line}"
        like, other = runs.setdefault(trial.run, (trial, where))
        if like != trial:
            raise CsvError(
                f"{where}: repetition {trial.repetition} of {trial.design.digits} under these "
                f"conditions is {other} already; number them by a column trial or --repetition"
            )
        like, other = tracks.setdefault(_key(trial), (trial, where))
        if like != trial and _key(trial):
            raise CsvError(
                f"{where}: has the track of {other}, and no two runs are alike; leave one out"
            )


def _key(trial: Trial) -> tuple[bytes, ...]:
    """Return what two tracks share where one is a copy; nothing where they may be alike by chance.

    That may those that don't move, those of two points, read off a ruler, and simulated ones.
    """
    if trial.source == "simulated" or len(trial.cycle) < 3 or not trial.position.any():
        return ()
    return trial.cycle.tobytes(), trial.position.tobytes()
