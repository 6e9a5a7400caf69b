"""Calibrating the simulator, as the paper tried: which physics of a grid moves like real robots.

Source of the method: Kriegman et al., "Scalable sim-to-real transfer of soft robot designs",
RoboSoft 2020, a search over pairs of friction coefficients.
"""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import prod
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import Design
from softvox_gym.engine import Progress
from softvox_gym.physics import FINITE, NOT_NEGATIVE, SPECS, ParameterError, Physics
from softvox_gym.real_tracks import LITTLE, PER_CYCLE, RealTrack, track_at
from softvox_gym.realities import PhysicsLike, Reality, single_physics
from softvox_gym.simulation import simulate
from softvox_gym.trials.measured import MeasuredReality

Array: TypeAlias = NDArray[np.float64]

#: Simulations in one calibration; at some milliseconds each they take minutes.
MOST_SIMULATIONS = 100_000

#: Whoever builds and pumps a robot knows how far and how often; what the floor does, nobody does.
KNOWN = ("strain", "frequency_hz", "actuation")

_FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5)

#: What the axes of a grid are called that are not called as a parameter is, with the parameters as
#: `Physics.of` takes them.
NAMES = {"friction": ("friction_static", "friction_kinetic"), "shear": ("shear_ratio",)}

#: Values of an axis where none are given: round ones, none of them fitted to anything.
AXES: Mapping[str, tuple[float, ...]] = {
    "friction": _FRICTIONS,
    "friction_static": _FRICTIONS,
    "friction_kinetic": _FRICTIONS,
    "shear": (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0),
    "strain": (0.1, 0.2, 0.3, 0.4, 0.5),
    "frequency_hz": (1.0, 2.0, 3.0, 4.0, 6.0),
    "youngs_modulus": (1e6, 3e6, 1e7, 3e7),
    "density": (2.5e5, 5e5, 1e6, 2e6),
}

#: Parameters that an axis may have: numbers, and no more than one for every robot.
_PARAMETERS = tuple(
    spec.name
    for spec in SPECS
    if spec.per_design and isinstance(spec.default, float) and spec.name != "duration"
)


def grid_of(text: str) -> dict[str, tuple[float, ...] | None]:
    """Return the grid that is written as ``friction,shear=0:1:5,strain=0.2,0.3``.

    A name alone has the values of `AXES`; ``a:b:n`` are n values from a to b.

    Raises
    ------
    ValueError
        Where it is not written like that, or names an axis twice.
    """
    grid: dict[str, tuple[float, ...] | None] = {}
    name = ""
    for part in text.split(","):
        head, has_values, values = part.rpartition("=")
        if has_values or not (grid.get(name) and _is_number(part)):
            name = (head if has_values else part).strip().replace("-", "_")
            if not name:
                raise ValueError("there is nothing between two commas; name an axis, as friction")
            if name in grid:
                raise ValueError(f"{name} is in the grid twice; give all its values at once")
            grid[name] = None
        if has_values or grid[name]:
            grid[name] = (*(grid[name] or ()), *_values(name, values))
    return grid


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _values(name: str, text: str) -> tuple[float, ...]:
    """Return the values that 0.5 or 0:1:5 stand for."""
    try:
        first, *rest = text.split(":")
        if not rest:
            return (float(first),)
        last, count = float(rest[0]), int(rest[1])
        if len(rest) == 2 and 2 <= count <= MOST_SIMULATIONS:
            return tuple(np.linspace(float(first), last, count).tolist())
    except (ValueError, IndexError):
        pass
    raise ValueError(
        f"{name}={text[:40]} is not a list of values; write {name}=0.1,0.5, or {name}=0.1:0.5:5 "
        "for five of them (at least two)"
    )


def settings(name: str, values: ArrayLike | None) -> list[dict[str, float]]:
    """Return the values of an axis, each as changes that `Physics.of` takes.

    Of the frictions these are all pairs whose kinetic friction is at most the static one, without
    those in which one alone is 0: 46 of the 10 values of `AXES`.

    Raises
    ------
    ValueError
        For an unknown axis, with the nearest, or values that it can't have.
    """
    known = (*NAMES, *_PARAMETERS)
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        raise ValueError(f"no axis {name!r}{hint}; there are {', '.join(known)}")
    if values is None:
        if name not in AXES:
            raise ValueError(f"{name} has no usual values; give some, as {name}=1,2,3")
        values = AXES[name]
    array = np.asarray(values)
    if array.ndim != 1 or not array.size or array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be a row of numbers, got {values!r}")
    names = NAMES.get(name, (name,))
    numbers: list[float] = np.unique(array.astype(np.float64)).tolist()
    bounds = NOT_NEGATIVE if name == "shear" else FINITE  # all others are known to `Physics`
    if bad := [value for value in numbers if not bounds.hold(value)]:
        raise ValueError(f"{name} must be {bounds.words}, got {bad[0]:g}")
    if len(numbers) ** len(names) > MOST_SIMULATIONS:
        raise ValueError(f"{name} has {len(numbers)} values, which is too many; give fewer")
    rows = product(numbers, repeat=len(names))
    return [
        dict(zip(names, row, strict=True))
        for row in rows
        if len(row) == 1 or (row[0] >= row[1] and (row[1] != 0) == (row[0] != 0))
    ]


def known_of(reality: Reality) -> dict[str, Any]:
    """Return what is known of a reality without calibrating: how its robots are actuated.

    Of voxels made of smaller ones that is the simulator's, as their strain means another thing. Of
    what was measured it is the frequency, where the trials say it.
    """
    if isinstance(reality, MeasuredReality):
        frequency = reality.measured[0].frequency_hz  # the same in all
        return {} if frequency is None else {"frequency_hz": frequency}
    physics = reality.physics if reality.resolution == 1 else reality.nominal
    return {name: getattr(physics, name) for name in KNOWN}


def tracks_of(reality: Reality, designs: Sequence[int]) -> tuple[RealTrack, ...]:
    """Return how designs of the 2x2x2 lattice move in a reality, as if it had been filmed.

    Raises
    ------
    TypeError, ValueError
        For designs that are none, or diverge there.
    """
    numbers = [Design(design).index for design in designs]  # a result's may be of finer voxels
    result = reality.simulate(numbers, track=PER_CYCLE)
    assert result.track is not None
    if result.diverged.any():
        lost = [numbers[i] for i in np.flatnonzero(result.diverged).tolist()]
        raise ValueError(
            f"{len(lost)} of {len(result)} designs diverge in the reality {reality.name}: "
            f"{', '.join(map(str, lost[:9]))}; leave them out"
        )
    scale = reality.physics.edge * 100
    cycle = np.arange(result.track.shape[1]) / PER_CYCLE
    cycle[-1] = float(reality.physics.cycles)
    tracks = result.track[..., :2] * scale
    tracks[:, -1] = result.displacement[:, :2] * scale
    return tuple(
        RealTrack(number, reality.name, cycle, track)
        for number, track in zip(numbers, tracks, strict=True)
    )


@dataclass(frozen=True, eq=False, repr=False)
class Calibration:
    """What real robots did, and how every point of a grid says they move.

    A heading is the direction of an end, seen from the start; what travels less than 0.25 voxel
    widths has none.

    Parameters
    ----------
    designs : ndarray of int64, shape (n,)
    trials : ndarray of int64, shape (n,)
        Of each design.
    cycles : ndarray, shape (n,)
        Of actuation, over which a design is looked at: its shortest trial.
    real : ndarray, shape (n, 2)
        Where it then was, voxel widths from its start along x and y; the mean over its trials.
    spread : ndarray, shape (n,)
        RMS distance of its trials from that mean, voxel widths; 0 of a single one.
    parameters : dict of str to ndarray, shape (p,)
        What differs from point to point, as `Physics.of` takes it.
    physics : Physics
        What they share.
    end : ndarray, shape (p, n, 2)
        Where the designs are at every point, voxel widths; 0 where they diverged.
    diverged : ndarray of bool, shape (p, n)
    """

    designs: NDArray[np.int64]
    trials: NDArray[np.int64]
    cycles: Array
    real: Array
    spread: Array
    parameters: Mapping[str, Array]
    physics: Physics
    end: Array
    diverged: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.end)

    def __repr__(self) -> str:
        return (
            f"Calibration({len(self)} points, {len(self.designs)} designs, "
            f"best {self.headings[self.best]} of {self.has_heading.sum()} headings)"
        )

    @cached_property
    def has_heading(self) -> NDArray[np.bool_]:
        """Which designs have one in reality, shape (n,); the others are in no count of headings."""
        return _length(self.real) >= LITTLE

    @cached_property
    def heading_error(self) -> Array:
        """Degrees between the headings, 0 to 180, shape (p, n); NaN where either has none."""
        along, across = self._turn
        angle = np.degrees(np.arctan2(np.abs(across), along))
        return np.where(self._is_heading, angle, np.nan)

    @cached_property
    def matched(self) -> NDArray[np.bool_]:
        """Whether the headings differ by at most 45 degrees, shape (p, n); not where one has none.

        A design that diverged has none.
        """
        along, across = self._turn
        return self._is_heading & (along >= np.abs(across))

    @cached_property
    def headings(self) -> NDArray[np.int64]:
        """How many match at every point, shape (p,)."""
        return np.asarray(self.matched.sum(axis=1))

    @property
    def share(self) -> Array:
        """That as a share of the designs that have a heading in reality, shape (p,)."""
        return np.asarray(self.headings / self.has_heading.sum())

    @cached_property
    def distance_error(self) -> Array:
        """How much too far they go, voxel widths, shape (p, n)."""
        return _length(self.end) - _length(self.real)

    @cached_property
    def end_error(self) -> Array:
        """How far the ends are apart, voxel widths, shape (p, n)."""
        return _length(self.end - self.real)

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """The points, best first, shape (p,).

        By headings, then by the designs that diverge, then by the RMS of the ends' errors.
        """
        return np.lexsort([_rms(self.end_error), self.diverged.sum(axis=1), -self.headings])

    @property
    def best(self) -> int:
        """The best point."""
        return int(self.order[0])

    def point(self, i: int) -> dict[str, Any]:
        """Return a point: its scores, over all designs, and its parameters.

        Errors of headings are over those designs that have one in both worlds; None where none has.
        """
        angles = self.heading_error[i][~np.isnan(self.heading_error[i])]
        return {
            "headings": int(self.headings[i]),
            "share": float(self.share[i]),
            **{name: float(values[i]) for name, values in self.parameters.items()},
            "heading_error_mean": float(angles.mean()) if angles.size else None,
            "heading_error_rms": float(_rms(angles)) if angles.size else None,
            "distance_error_mean": float(self.distance_error[i].mean()),
            "distance_error_rms": float(_rms(self.distance_error[i])),
            "end_error_rms": float(_rms(self.end_error[i])),
            "diverged": int(self.diverged[i].sum()),
        }

    def physics_of(self, i: int, cycles: ArrayLike | None = None) -> Physics:
        """Return the physics of a point for each design, over `cycles`, or others, shape (n,)."""
        own = self.cycles if cycles is None else np.asarray(cycles, dtype=np.float64)
        return _physics(self.physics, self.parameters, np.full(len(self.designs), i), own)

    @property
    def _is_heading(self) -> NDArray[np.bool_]:
        return self.has_heading & (_length(self.end) >= LITTLE) & ~self.diverged

    @property
    def _turn(self) -> tuple[Array, Array]:
        """The dot and the cross product of the ends, shape (p, n)."""
        (x, y), (a, b) = np.moveaxis(self.end, -1, 0), self.real.T
        return x * a + y * b, x * b - y * a


def calibrate(
    tracks: Sequence[RealTrack] | MeasuredReality,
    grid: str | Mapping[str, ArrayLike | None] = "friction,shear",
    physics: PhysicsLike = "published",
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Hold every design that has real tracks against every point of a grid, in one simulation.

    Parameters
    ----------
    tracks : sequence of RealTrack, or MeasuredReality
        As `softvox_gym.real_tracks.read_tracks` reads them, or `tracks_of` makes them; cm of robots
        whose voxels are as wide as those of the physics. Every design is looked at after the cycles
        of its shortest trial; those of `Reality.from_trials` after its cycles.
    grid : str or dict
        Axes by name, as `grid_of` reads them or with their values, None for the usual ones:
        friction (pairs of static and kinetic), shear (T*, the shear strength over a voxel's
        weight), or any parameter of `Physics` that a design may have of its own.
    physics : str, dict or Physics
        All that is not in the grid, but for the duration, which is that of the tracks.
    threads, progress
        As `simulate` takes them.

    Returns
    -------
    Calibration

    Raises
    ------
    TypeError, ValueError
        For a grid that is none or too large, what are no tracks, or those that no heading can be
        told of.

    Notes
    -----
    Source: Kriegman et al. 2020, who looked for the pair of friction coefficients that turns their
    simulated robots into the real ones, and found none. A design that diverged stands still.

    Examples
    --------
    >>> from softvox_gym import reality
    >>> from softvox_gym.calibration import known_of, tracks_of
    >>> truth = reality("reversal")
    >>> tracks = tracks_of(truth, [6453, 6481])
    >>> calibrate(tracks, "shear=0,0.5", {**known_of(truth), "friction_static": 0.0,
    ...           "friction_kinetic": 0.0, "preset": "published"})
    Calibration(2 points, 2 designs, best 2 of 2 headings)
    """
    base = single_physics(physics)
    axes = _axes(grid_of(grid) if isinstance(grid, str) else grid)
    if isinstance(tracks, MeasuredReality):
        tracks = tracks.against(base).tracks
    if not isinstance(tracks, Sequence) or any(not isinstance(one, RealTrack) for one in tracks):
        raise TypeError(
            "tracks must be several RealTracks, as read_tracks or tracks_of returns them, or a "
            f"reality that Reality.from_trials makes, got a {type(tracks).__name__}"
        )
    if not tracks:
        raise ValueError("there are no tracks; give one at least")
    by_design: dict[int, list[RealTrack]] = {}
    for track in tracks:
        by_design.setdefault(track.design, []).append(track)
    cycles = np.array([min(one.cycle[-1] for one in own) for own in by_design.values()])
    ends = [
        np.concatenate([track_at(at, one.cycle, one.position) for one in own]) / (base.edge * 100)
        for at, own in zip(cycles[:, np.newaxis], by_design.values(), strict=True)
    ]
    real = np.stack([own.mean(axis=0) for own in ends])
    if not (_length(real) >= LITTLE).any():
        raise ValueError(
            f"no design travels {LITTLE:g} voxel widths, so that none has a heading to match; give "
            "tracks that go farther"
        )
    n, p = len(real), prod(map(len, axes))
    if n * p > MOST_SIMULATIONS:
        raise ValueError(
            f"the grid has {p} points, which makes {n * p} simulations of all designs, and at most "
            f"{MOST_SIMULATIONS} are done; give fewer axes, values or designs"
        )
    points = [{k: v for part in row for k, v in part.items()} for row in product(*axes)]
    parameters = {name: np.array([point[name] for point in points]) for name in points[0]}
    every = _physics(base, parameters, np.repeat(np.arange(p), n), np.tile(cycles, p))
    designs = np.array(list(by_design), dtype=np.int64)
    result = simulate(np.tile(designs, p), every, threads=threads, progress=progress)
    diverged = result.diverged.reshape(p, n)
    end = result.displacement[:, :2].reshape(p, n, 2)
    return Calibration(
        designs=designs,
        trials=np.array([len(own) for own in ends]),
        cycles=cycles,
        real=real,
        spread=np.array([_rms(_length(own - own.mean(axis=0))) for own in ends]),
        parameters=parameters,
        physics=base,
        end=np.where(diverged[..., np.newaxis], 0.0, end),
        diverged=diverged,
    )


def _axes(grid: Mapping[str, ArrayLike | None]) -> list[list[dict[str, float]]]:
    """Return the settings of every axis; ValueError where two say the same, or there are none."""
    if not grid:
        raise ValueError("the grid has no axes; name one, as friction")
    axes = {name: settings(name, values) for name, values in grid.items()}
    taken: dict[str, str] = {}
    for name in axes:
        # T* and the shear strength are two ways to say one thing.
        for parameter in NAMES.get(name, (name,)):
            key = parameter.replace("shear_ratio", "shear_strength")
            if key in taken:
                raise ValueError(f"{taken[key]} and {name} both say {key}; give one of them")
            taken[key] = name
    return list(axes.values())


def _physics(
    base: Physics, parameters: Mapping[str, Array], which: NDArray[np.int64], cycles: Array
) -> Physics:
    """Return the physics of a robot at each of some points, over so many cycles."""
    changes: dict[str, Any] = {name: values[which] for name, values in parameters.items()}
    ratio = changes.pop("shear_ratio", None)
    if "gravity" in changes:  # three numbers would be one vector
        changes["gravity"] = np.multiply.outer(changes["gravity"], [0.0, 0.0, 1.0])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that kinetic friction is above static
            made = replace(base, **changes).lasting(cycles)
            return made if ratio is None else made.sheared(ratio)
    except ParameterError as error:
        raise ValueError(str(error)) from None


def _length(vectors: Array) -> Array:
    return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt((values * values).mean(axis=-1)))
