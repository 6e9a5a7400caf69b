"""Trials: one run of a robot, real or simulated, with its known facts, as a small text file.

docs/trials-database.md describes the file.
"""

from __future__ import annotations

import datetime
import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields
from functools import cached_property
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import Design, called
from softvox_gym.design_files import shown
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import MOST_CM, VOXEL_CM
from softvox_gym.realities import reality

Array = NDArray[np.float64]

FORMAT, VERSION = "softvox-gym trial", 1

#: Licences that let others use the data, by their SPDX identifiers.
LICENSES = ("CC0-1.0", "CC-BY-4.0", "ODC-By-1.0", "PDDL-1.0", "MIT")

#: Limits of a text, of a track, and of the runs of one robot under the same conditions.
MOST_CHARACTERS, MOST_POINTS, MOST_REPETITIONS = 2000, 100_000, 10_000

#: Largest file: a little more than that many points and a million sites take.
MOST_BYTES = 8_000_000

#: Positions are rounded to a micrometre, cycles to a hundred-thousandth.
PLACES = {"cycle": 5, "position": 4}

#: Largest cycle and cm; it also makes rounding safe.
_LARGEST = 1e6

#: Edge of a voxel of simulated robots.
SIMULATED_VOXEL_CM = 1.0

#: Keys of `provenance`: the file that the track was read from, its kind, and how its numbers became
#: cm along the robot's axes.
PROVENANCE = ("file", "sha256", "kind", "cm_per_pixel", "x_axis_deg", "point")

#: Those that are numbers, each with its exclusive lower bound and its largest value.
PROVENANCE_NUMBERS = {"cm_per_pixel": (0.0, 1000.0), "x_axis_deg": (-360.0, 360.0)}


class TrialError(ValueError):
    """An invalid trial; the message names the fault and the remedy."""


class Condition(NamedTuple):
    """The facts that comparable trials share."""

    source: str
    reality: str
    surface: str
    powder: str
    pressure_kpa: float | None
    frequency_hz: float | None

    def __str__(self) -> str:
        return ", ".join(filter(None, [*self[:4], *self.pumped]))

    @property
    def pumped(self) -> list[str]:
        """The known facts about the pump, in words."""
        units = zip(self[4:], ("kPa", "Hz"), strict=True)
        return [f"{value:g} {unit}" for value, unit in units if value]


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """One run of a robot, real or simulated. Trials are values: equal if all their facts are.

    Parameters
    ----------
    design : Design
    cycle : ndarray, shape (n,)
        Actuation cycles since the start, from 0, increasing.
    position : ndarray, shape (n, 2)
        x, y of the centre of mass in cm from the start, along the robot's own axes before it moved,
        seen from above: y is a quarter turn counter-clockwise from x.
    surface, who, license, date : str
        The surface; the person or program that ran it; one of `LICENSES`; YYYY-MM-DD, "" for a
        simulated run.
    source : {"measured", "simulated"}
    reality : str
        For a simulated run: a name for `softvox_gym.reality`, or "published".
    robot, powder, camera, notes : str
        Which robot of a design; the powder on the surface.
    pressure_kpa, frequency_hz, cycles : float, optional
        Pressure and frequency of actuation; cycles of the whole run, by default of the track.
    repetition : int
        Number of the run of this robot under these conditions, from 1.
    voxel_cm : float
        The resting edge of a voxel; 1 for a simulated robot.
    provenance : dict
        Source of the track, keys of `PROVENANCE`: its file's name and SHA-256, and its conversion.

    Raises
    ------
    TrialError
        If a value is anything else; the message names it and the remedy.

    Examples
    --------
    >>> trial = Trial(design=6453, cycle=[0, 1], position=[[0, 0], [0.3, 0.1]], surface="acrylic",
    ...               who="A. Person", date="2026-11-27", license="CC0-1.0")
    >>> Trial.from_bytes(trial.to_bytes()) == trial
    True
    """

    design: Design
    cycle: Array
    position: Array
    surface: str
    who: str
    license: str
    date: str = ""
    source: str = "measured"
    reality: str = ""
    robot: str = ""
    powder: str = ""
    pressure_kpa: float | None = None
    frequency_hz: float | None = None
    cycles: float | None = None
    repetition: int = 1
    voxel_cm: float = VOXEL_CM
    camera: str = ""
    notes: str = ""
    provenance: Mapping[str, str | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in _TEXTS:
            _check_text(name, getattr(self, name), is_needed=name in ("surface", "who"))
        for name, choices in (("license", LICENSES), ("source", ("measured", "simulated"))):
            if (value := getattr(self, name)) not in choices:
                raise TrialError(f"{name} must be one of {', '.join(choices)}, got {shown(value)}")
        is_simulated = self.source == "simulated"
        if self.reality and not is_simulated:
            raise TrialError("reality is for simulated trials only; leave it out")
        if is_simulated and self.reality != "published":
            try:
                reality(self.reality[:40])
            except ValueError as error:
                raise TrialError(f"reality of a simulated trial: {error}, and published") from None
        if self.date or not is_simulated:
            _check_date(self.date)
        changed: dict[str, Any] = {"design": _design(self.design), **self._points()}
        for name, most in _NUMBERS.items():
            value = getattr(self, name)
            if value is not None or name == "voxel_cm":
                changed[name] = _number(name, value, 0.0, most)
        if is_simulated and changed["voxel_cm"] != SIMULATED_VOXEL_CM:
            raise TrialError("simulated robots have voxels of 1 cm; give voxel_cm=1")
        end = float(changed["cycle"][-1])
        cycles = changed["cycles"] = float(_rounded("cycle", changed.get("cycles", end)))
        if cycles < end:
            raise TrialError(
                f"cycles is {cycles:g}, but the track lasts until cycle {end:g}; give the number "
                "of cycles of the whole run, or correct the frequency of actuation"
            )
        changed["repetition"] = _repetition(self.repetition)
        changed["provenance"] = _provenance(self.provenance)
        for name, value in changed.items():
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, Trial) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        name = str(called(self.design))[:40]
        return f"<Trial {self.digest[:10]}: {name}, {self.source} by {self.who[:40]}>"

    @classmethod
    def from_bytes(cls, content: bytes) -> Trial:
        """Read a trial from the content of its file.

        Raises
        ------
        TrialError
            If `to_bytes` would not have written it.
        """
        if len(content) > MOST_BYTES:
            raise TrialError(f"is larger than {MOST_BYTES:,} bytes, which no trial is; remove it")
        try:
            data = json.loads(content)
        except (ValueError, RecursionError) as error:
            line = f"line {error.lineno}: " if isinstance(error, json.JSONDecodeError) else ""
            raise TrialError(f"{line}is not valid JSON; restore the file, or remove it") from None
        if not isinstance(data, dict) or data.pop("format", None) != FORMAT:
            raise TrialError(f"is not a trial: its format is not {FORMAT!r}; remove it")
        if type(version := data.pop("version", None)) is not int or version != VERSION:
            raise TrialError(
                f"is a trial of version {shown(version)}, but this package reads version "
                f"{VERSION}; install a version of softvox-gym that reads it"
            )
        if lacking := sorted(_NEEDED - data.keys()):
            raise TrialError(
                f"lacks the key {lacking[0]!r}; restore the file, or add its track again"
            )
        if unknown := sorted(data.keys() - {*KEYS}):
            raise TrialError(
                f"has the unknown key {shown(unknown[0])}; restore the file, or install a version "
                "of softvox-gym that knows the key"
            )
        try:
            lattice = Lattice.of(data.pop("shape"), phases=data.pop("phases"))
            track = np.array(data.pop("track"), dtype=np.float64)
            if track.ndim != 2 or track.shape[1] != 3:
                raise ValueError(f"track has the shape {track.shape}, not (n, 3)")
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise TrialError(f"shape or track can't be read ({str(error)[:80]})") from None
        if not isinstance(digits := data.pop("design"), str):
            raise TrialError(f"design must be a string of digits, got {shown(digits)}")
        design = _design(digits, lattice)
        made = cls(design=design, cycle=track[:, 0], position=track[:, 1:], **data)
        if made.digest != sha256(content).hexdigest():
            if b"\r\n" in content:
                raise TrialError(
                    "has Windows line endings; put '*.json -text' into .gitattributes, and restore "
                    "the file"
                )
            raise TrialError(
                "differs from what softvox trials writes; restore the file, or add its track again"
            )
        return made

    def to_bytes(self) -> bytes:
        """Return the content of its file: JSON, a key per line and a point per line.

        Unknown facts are left out, so that new keys do not change existing files.
        """
        known = {key: value for key, value in self.facts.items() if value not in ("", None, {})}
        lines = [f"{_json(key)}: {_json(value)}" for key, value in known.items()]
        points = _json(self.track)[1:-1].replace("], [", "],\n[")
        return ("{\n" + ",\n".join([*lines, f'"track": [\n{points}\n]']) + "\n}\n").encode()

    @property
    def facts(self) -> dict[str, Any]:
        """All keys of its file except the track; missing ones are "", None or {} here."""
        sides = [int(side) for side in self.design.shape]
        own = {name: getattr(self, name) for name in _KEYS}
        lattice = {"shape": sides, "phases": int(self.design.lattice.phases)}
        facts = {**_HEAD, **lattice, **own, "design": self.design.digits}
        return {name: _plain(value) for name, value in facts.items()}

    @property
    def track(self) -> list[list[float]]:
        """The track of its file: cycle, x and y of each point."""
        points = np.column_stack([self.cycle, self.position]).tolist()
        return [[int(at) if at.is_integer() else at for at in point] for point in points]

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of its content, 64 hexadecimal digits; with .json, the name of its file."""
        return sha256(self.to_bytes()).hexdigest()

    @property
    def displacement(self) -> Array:
        """The end of the track, x, y in voxel widths from the start, shape (2,)."""
        return np.asarray(self.position[-1] / self.voxel_cm)

    @property
    def condition(self) -> Condition:
        """The condition of the run."""
        return Condition(*(getattr(self, name) for name in Condition._fields))

    @property
    def run(self) -> tuple[Any, ...]:
        """The identity of the run: two trials with the same describe one run twice."""
        own = self.design, self.robot, self.date, self.who, self.repetition
        return (*own, *self.condition)

    def _points(self) -> dict[str, Array]:
        cycle, position = _array("cycle", self.cycle, 1), _array("position", self.position, 2)
        if position.shape != (len(cycle), 2):
            raise TrialError(
                f"position must have shape ({len(cycle)}, 2), a row for each cycle, got "
                f"{position.shape}"
            )
        if not 2 <= len(cycle) <= MOST_POINTS:
            raise TrialError(f"a track must have 2 to {MOST_POINTS} points, got {len(cycle)}")
        if cycle[0] != 0 or position[0].any():
            raise TrialError(
                "a track must begin at cycle 0 and position 0, 0; subtract its first point"
            )
        if (np.diff(cycle) <= 0).any():
            at = int(np.argmax(np.diff(cycle) <= 0)) + 1
            raise TrialError(
                f"cycle must increase, but {cycle[at]:g} follows {cycle[at - 1]:g}; sort the points"
            )
        if (far := float(np.hypot(*position.T).max())) > MOST_CM:
            raise TrialError(
                f"the track goes {far:.4g} cm from its start, and no robot goes {MOST_CM:g} cm; "
                "give positions in cm, or correct the scale"
            )
        return {"cycle": cycle, "position": position}


_TEXTS = (
    *("surface", "who", "license", "date", "source"),
    *("reality", "robot", "powder", "camera", "notes"),
)

#: Largest value of each number; all are above 0.
_NUMBERS = {"pressure_kpa": 1e3, "frequency_hz": 1e3, "cycles": _LARGEST, "voxel_cm": 100.0}

_json = json.JSONEncoder(ensure_ascii=False).encode

_HEAD = {"format": FORMAT, "version": VERSION}

#: Keys of the file, in its order, except those of the format, the lattice and the track.
_KEYS = tuple(one.name for one in fields(Trial) if one.name not in ("cycle", "position"))

#: All keys of the file, in its order.
KEYS = (*_HEAD, "shape", "phases", *_KEYS, "track")

_NEEDED = {"shape", "phases", "design", "surface", "who", "license", "track"}


def several(trials: Any) -> tuple[Trial, ...]:
    """Return trials in the order given; TypeError for anything else, and for a single trial."""
    given = tuple(trials) if isinstance(trials, Iterable) else (None,)
    if not all(isinstance(trial, Trial) for trial in given):
        raise TypeError(
            "trials must be a list of softvox_gym.trials.Trial, as read(folder) returns"
        )
    return given


def _design(design: Any, lattice: Lattice | None = None) -> Design:
    try:
        made = Design(design, shape=lattice)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise TrialError(str(error)[:300]) from None
    if not made.n_voxels:
        raise TrialError("design has no voxels; give the design that was built")
    return made


def _array(name: str, values: ArrayLike, ndim: int) -> Array:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise TrialError(f"{name} must be numbers, got {shown(values)}") from None
    if array.ndim != ndim:
        raise TrialError(f"{name} must be an array of {ndim} dimensions, got {array.ndim}")
    if not (np.abs(array) <= _LARGEST).all():
        raise TrialError(f"{name} must be finite numbers up to a million; leave out other points")
    array = _rounded(name, array)
    array.flags.writeable = False
    return array


def _rounded(name: str, values: ArrayLike) -> Array:
    """Return numbers rounded as in files; ties round as in NumPy, unlike in Python."""
    return np.asarray(np.asarray(values).round(PLACES[name]) + 0.0)  # no negative zero


def _check_text(name: str, value: Any, *, is_needed: bool) -> None:
    if not isinstance(value, str) or len(value) > MOST_CHARACTERS or value != value.strip():
        raise TrialError(
            f"{name} must be a string of at most {MOST_CHARACTERS} characters without leading or "
            f"trailing spaces, got {shown(value)}"
        )
    if not value.isprintable():
        raise TrialError(f"{name} must be one line of printable characters, got {shown(value)}")
    if is_needed and not value:
        raise TrialError(f"{name} is required, but empty; give it")


def _check_date(text: str) -> None:
    with suppress(ValueError):
        if datetime.date.fromisoformat(text).isoformat() == text:
            return
    why = f"must be written as 2026-11-27, got {shown(text)}"
    raise TrialError(f"date {why if text else 'is required if measured; give it as 2026-11-27'}")


def _number(name: str, value: Any, above: float, most: float) -> float:
    value = value.item() if isinstance(value, np.generic) else value
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not above < value <= most:
        bounds = f"above {above:g} and at most {most:g}"
        raise TrialError(f"{name} must be a number {bounds}, got {shown(value)}")
    return float(value)


def _repetition(value: Any) -> int:
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or not 1 <= value <= MOST_REPETITIONS:
        raise TrialError(
            f"repetition must be a whole number from 1 to {MOST_REPETITIONS}, got {shown(value)}"
        )
    return int(value)


def _provenance(values: Any) -> dict[str, str | float]:
    if not isinstance(values, Mapping) or not set(values) <= set(PROVENANCE):
        raise TrialError(f"provenance may have keys {', '.join(PROVENANCE)}, got {shown(values)}")
    made: dict[str, str | float] = {}
    for name in (name for name in PROVENANCE if name in values):
        value = values[name]
        if name in PROVENANCE_NUMBERS:
            made[name] = _number(f"provenance: {name}", value, *PROVENANCE_NUMBERS[name])
        else:
            _check_text(f"provenance: {name}", value, is_needed=True)
            made[name] = value
    if not re.fullmatch("[0-9a-f]{64}", str(made.get("sha256", "0" * 64))):
        raise TrialError("provenance: sha256 must be 64 hexadecimal digits, as sha256sum prints")
    return made


def _plain(value: Any) -> Any:
    """Return a number as an int if it is whole: each number has one written form."""
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return {key: _plain(one) for key, one in value.items()} if isinstance(value, dict) else value
