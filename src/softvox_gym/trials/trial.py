"""A trial: one run of a robot that was filmed, and all that is known of it; a small text file."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import Design
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import MOST_CM
from softvox_gym.realities import realities

Array = NDArray[np.float64]

FORMAT, VERSION = "softvox-gym trial", 1

#: Licences that let others use the data, by their SPDX identifiers.
LICENSES = ("CC0-1.0", "CC-BY-4.0", "ODC-By-1.0", "PDDL-1.0", "MIT")

#: Texts are at most as long, and a track has at most as many points.
MOST_CHARACTERS, MOST_POINTS = 2000, 100_000

#: A file is at most so large: a little more than that many points and a million sites take.
MOST_BYTES = 8_000_000

#: Positions are kept to a micrometre, cycles to a hundred-thousandth.
PLACES = {"cycle": 5, "position": 4}

#: Of the kit's robots, cm.
VOXEL_CM = 1.5

#: What `provenance` may say: the file that the track was read from, what kind it was of, and how
#: its numbers became cm along the robot's axes.
PROVENANCE = ("file", "sha256", "kind", "cm_per_pixel", "x_axis_deg", "point")


class TrialError(ValueError):
    """A trial that can't be; the message says what is wrong with it and how to mend it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """One run of a robot, real or simulated. Trials are values: equal where all they say is.

    Parameters
    ----------
    design : Design
        As `Design` takes it.
    cycle : ndarray, shape (n,)
        Actuation cycles since the start, from 0, increasing.
    position : ndarray, shape (n, 2)
        x, y of the centre of mass in cm from the start, along the robot's own axes before it moved,
        seen from above: y is a quarter turn counter-clockwise from x.
    surface : str
        What it stood on.
    who : str
        Who ran it, or what did.
    date : str
        Of the run, YYYY-MM-DD; "" of a simulated one.
    license : str
        One of `LICENSES`.
    source : {"measured", "simulated"}
    reality : str
        Of a simulated one: the name of the pseudo-reality, or "published".
    powder : str
        What lay on the surface; "" for nothing.
    pressure_kpa, frequency_hz : float, optional
        Of actuation.
    cycles : float, optional
        Of actuation in the run; where None, those of the track.
    repetition : int
        Which run of this robot under these conditions it was, from 1.
    voxel_cm : float
        The resting edge of a voxel.
    camera, notes : str
    provenance : dict
        Of the track, keys of `PROVENANCE`: its file's name and SHA-256, and what it was made of.

    Raises
    ------
    TrialError
        For anything else, naming it and the remedy.

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
        _check_choice("license", self.license, LICENSES)
        _check_choice("source", self.source, ("measured", "simulated"))
        if self.source == "simulated":
            _check_choice("reality", self.reality, ("published", *realities()))
        elif self.reality:
            raise TrialError("reality is of a simulated trial; leave it out of a measured one")
        if self.date or self.source == "measured":
            _check_date(self.date)
        changed: dict[str, Any] = {"design": _design(self.design), **self._points()}
        for name, most in _NUMBERS.items():
            value = getattr(self, name)
            if value is not None:
                changed[name] = _number(name, value, most)
        end = float(changed["cycle"][-1])
        cycles = changed.setdefault("cycles", end)
        if cycles < end:
            raise TrialError(
                f"cycles is {cycles:g}, and the track goes on to {end:g}; give all cycles of the "
                "run, or the frequency at which it was actuated"
            )
        repetition = self.repetition
        if type(repetition) is not int or not 1 <= repetition <= 10_000:
            raise TrialError(f"repetition must be a whole number from 1, got {repetition!r}")
        changed["provenance"] = _provenance(self.provenance)
        for name, value in changed.items():
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, Trial) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    @classmethod
    def from_bytes(cls, content: bytes) -> Trial:
        """Read a trial from the content of its file.

        Raises
        ------
        TrialError
            For what `to_bytes` would not write.
        """
        if len(content) > MOST_BYTES:
            raise TrialError(f"is larger than {MOST_BYTES} bytes, so no trial; take it out")
        try:
            data = json.loads(content)
        except (ValueError, RecursionError) as error:
            line = f"line {error.lineno}: " if isinstance(error, json.JSONDecodeError) else ""
            raise TrialError(f"{line}is no JSON; write it anew with softvox trials add") from None
        if not isinstance(data, dict) or data.pop("format", None) != FORMAT:
            raise TrialError(f"is no trial: JSON with the format {FORMAT!r}")
        if type(version := data.pop("version", None)) is not int or version != VERSION:
            raise TrialError(
                f"is a trial of version {str(version)[:40]}, and this package reads {VERSION}; "
                "install one that reads it"
            )
        if others := sorted(map(str, data.keys() ^ {*_KEYS, "shape", "phases", "track"})):
            raise TrialError(f"has or lacks the key {others[0][:40]!r}; write it anew")
        try:
            lattice = Lattice.of(data.pop("shape"), phases=data.pop("phases"))
            track = np.array(data.pop("track"), dtype=np.float64)
            if track.ndim != 2 or track.shape[1] != 3:
                raise ValueError(f"has shape {track.shape}")
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise TrialError(f"shape or track can't be read ({str(error)[:80]})") from None
        design = _design(data.pop("design"), lattice)
        made = cls(design=design, cycle=track[:, 0], position=track[:, 1:], **data)
        if made.to_bytes() != content:
            raise TrialError("is not as softvox trials writes it; write it anew, or restore it")
        return made

    def to_bytes(self) -> bytes:
        """Return the content of its file: JSON, a key per line and a point per line."""
        facts = {name: _plain(getattr(self, name)) for name in _KEYS}
        facts["design"] = self.design.digits
        shape = {"shape": list(self.design.shape), "phases": self.design.lattice.phases}
        lines = [f"{_json(k)}: {_json(v)}" for k, v in {**_HEAD, **shape, **facts}.items()]
        points = np.column_stack([self.cycle, self.position]).tolist()
        track = ",\n".join(_json([_plain(value) for value in point]) for point in points)
        return ("{\n" + ",\n".join(lines) + ',\n"track": [\n' + track + "\n]\n}\n").encode()

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of its content, 64 hexadecimal digits; with .json, the name of its file."""
        return sha256(self.to_bytes()).hexdigest()

    @property
    def run(self) -> tuple[Any, ...]:
        """What no two trials share: two that have the same are the same run told twice."""
        return (
            self.design,
            *(self.source, self.reality, self.surface, self.powder, self.pressure_kpa),
            *(self.frequency_hz, self.date, self.who, self.repetition),
        )

    def _points(self) -> dict[str, Array]:
        cycle, position = _array("cycle", self.cycle, 1), _array("position", self.position, 2)
        if position.shape != (len(cycle), 2):
            raise TrialError(
                f"position must be of shape ({len(cycle)}, 2), as cycle is, got {position.shape}"
            )
        if not 2 <= len(cycle) <= MOST_POINTS:
            raise TrialError(f"a track has 2 to {MOST_POINTS} points, got {len(cycle)}")
        if cycle[0] != 0 or position[0].any():
            raise TrialError("a track begins at cycle 0 and position 0, 0; count from its start")
        if (np.diff(cycle) <= 0).any():
            at = int(np.argmax(np.diff(cycle) <= 0)) + 1
            raise TrialError(f"cycle {cycle[at]:g} comes after {cycle[at - 1]:g}; sort the points")
        if (far := float(np.hypot(*position.T).max())) > MOST_CM:
            raise TrialError(
                f"the track goes {far:.4g} cm from its start, and no robot goes {MOST_CM:g}; give "
                "positions in cm, or the right scale"
            )
        return {"cycle": cycle, "position": position}


_TEXTS = ("surface", "who", "license", "date", "source", "reality", "powder", "camera", "notes")

#: The largest that each number can be; none is 0 or less.
_NUMBERS = {"pressure_kpa": 1000.0, "frequency_hz": 1000.0, "cycles": 1e6, "voxel_cm": 100.0}

_HEAD = {"format": FORMAT, "version": VERSION}

#: Of the file, in its order, but for what says the format, the lattice and the track.
_KEYS = tuple(one.name for one in fields(Trial) if one.name not in ("cycle", "position"))


def _design(design: Any, lattice: Lattice | None = None) -> Design:
    try:
        made = Design(design, shape=lattice)
    except (TypeError, ValueError) as error:
        raise TrialError(str(error)) from None
    if not made.n_voxels:
        raise TrialError("design has no voxels, so no robot is one; give the one that was built")
    return made


def _array(name: str, values: ArrayLike, ndim: int) -> Array:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise TrialError(f"{name} must be numbers, got {str(values)[:40]}") from None
    if array.ndim != ndim or not np.isfinite(array).all():
        raise TrialError(f"{name} must be finite numbers of {ndim} dimensions")
    array = np.round(array, PLACES[name]) + 0.0  # no negative zero
    array.flags.writeable = False
    return array


def _check_text(name: str, value: Any, *, is_needed: bool) -> None:
    if not isinstance(value, str) or len(value) > MOST_CHARACTERS or value != value.strip():
        raise TrialError(
            f"{name} must be a text of at most {MOST_CHARACTERS} characters, without space around "
            f"it, got {str(value)[:40]!r}"
        )
    if not value.isprintable():
        raise TrialError(f"{name} must be printable and one line, got {value[:40]!r}")
    if is_needed and not value:
        raise TrialError(f"{name} is needed, and is empty")


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise TrialError(f"{name} must be one of {', '.join(choices)}, got {value[:40]!r}")


def _check_date(text: str) -> None:
    try:
        is_date = datetime.date.fromisoformat(text).isoformat() == text
    except ValueError:
        is_date = False
    if not is_date:
        raise TrialError(f"date must be written as 2026-11-27, got {text[:40]!r}")


def _number(name: str, value: Any, most: float) -> float:
    is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not is_number or not (math.isfinite(value) and 0 < value <= most):
        raise TrialError(f"{name} must be above 0 and at most {most:g}, got {str(value)[:40]}")
    return float(value)


def _provenance(values: Any) -> dict[str, str | float]:
    if not isinstance(values, Mapping) or not set(values) <= set(PROVENANCE):
        raise TrialError(f"provenance may say {', '.join(PROVENANCE)}, got {str(values)[:80]}")
    made: dict[str, str | float] = {}
    for name in PROVENANCE:
        if name in ("cm_per_pixel", "x_axis_deg") and name in values:
            value = values[name]
            if not isinstance(value, (int, float)) or not math.isfinite(value):
                raise TrialError(f"provenance: {name} must be a number, got {str(value)[:40]}")
            made[name] = float(value)
        elif name in values:
            _check_text(f"provenance: {name}", values[name], is_needed=False)
            made[name] = values[name]
    return made


def _plain(value: Any) -> Any:
    """Return a number as an int where it is whole, so that it is written one way."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
