"""Calibration of the simulator: which physics of a grid moves most like real robots.

Source of the method: Kriegman et al., "Scalable sim-to-real transfer of soft robot designs",
RoboSoft 2020, who searched over pairs of friction coefficients.
"""

from __future__ import annotations

import difflib
import re
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

#: Most simulations in one calibration; at some milliseconds each they take minutes.
MOST_SIMULATIONS = 100_000

#: What the builder of a robot knows: how far and how often it is pumped. The floor is unknown.
KNOWN = ("strain", "frequency_hz", "actuation")

_FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5)

#: Names of grid axes that are not parameters, with the parameters as `Physics.of` takes them.
NAMES = {"friction": ("friction_static", "friction_kinetic"), "shear": ("shear_ratio",)}

#: Default values of the axes: round numbers, not fitted to anything.
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

#: Parameters that an axis may vary: numbers that each robot may have its own value of.
_PARAMETERS = tuple(
    spec.name
    for spec in SPECS
    if spec.per_design and isinstance(spec.default, float) and spec.name != "duration"
)


def grid_of(text: str) -> dict[str, tuple[float, ...] | None]:
    """Return the grid for a text such as ``friction,shear=0:1:5,strain=0.2,0.3``.

    A name alone gets the values of `AXES`; ``a:b:n`` means n values from a to b.

    Raises
    ------
    ValueError
        If the text has another form, or names an axis twice.
    """
    grid: dict[str, tuple[float, ...] | None] = {}
    for part in re.split(r",(?!\s*[-+.0-9])", text):  # the others are between values of an axis
        name, has_values, values = part.partition("=")
        name = name.strip().replace("-", "_")
        if not name:
            raise ValueError("there is nothing between two commas; name an axis, such as friction")
        if name in grid:
            raise ValueError(f"{name} is in the grid twice; give all its values at once")
        own = (value for one in values.split(",") for value in _values(name, one))
        grid[name] = tuple(own) if has_values else None
    return grid


def _values(name: str, text: str) -> tuple[float, ...]:
    """Return the values for a text such as 0.5 or 0:1:5."""
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
    """Return the values of an axis, each as changes for `Physics.of`.

    For friction these are all pairs with kinetic friction at most the static one, except pairs in
    which only one is 0: 46 pairs for the 10 values of `AXES`.

    Raises
    ------
    ValueError
        If the axis is unknown (the message names the nearest) or can't have a value.
    """
    known = (*NAMES, *_PARAMETERS)
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        raise ValueError(f"no axis {name!r}{hint}; there are {', '.join(known)}")
    if values is None:
        if name not in AXES:
            raise ValueError(f"{name} has no default values; give some, as {name}=1,2,3")
        values = AXES[name]
    array = np.asarray(values)
    if array.ndim != 1 or not array.size or array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be a row of numbers, got {values!r}")
    names = NAMES.get(name, (name,))
    numbers: list[float] = np.unique(array.astype(np.float64)).tolist()
    bounds = NOT_NEGATIVE if name == "shear" else FINITE  # `Physics` knows all others
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
    """Return what is known of a reality without calibration: how its robots are actuated.

    If voxels consist of smaller ones, that is the simulator's actuation, as their strain has
    another meaning. For a measured reality it is the frequency, if the trials record it.
    """
    if isinstance(reality, MeasuredReality):
        frequency = reality.measured[0].frequency_hz  # the same in all
        return {} if frequency is None else {"frequency_hz": frequency}
    physics = reality.physics if reality.resolution == 1 else reality.nominal
    return {name: getattr(physics, name) for name in KNOWN}


def tracks_of(reality: Reality, designs: Sequence[int]) -> tuple[RealTrack, ...]:
    """Return the tracks of 2x2x2 designs in a reality, as if they had been filmed.

    Raises
    ------
    TypeError, ValueError
        If a design is invalid, or diverges there.
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
    """The motion of real robots, and the predictions of every point of a grid.

    A heading is the direction of an end point, seen from the start; robots that travel less than
    0.25 voxel widths have none.

    Parameters
    ----------
    designs : ndarray of int64, shape (n,)
    trials : ndarray of int64, shape (n,)
        Number of trials of each design.
    cycles : ndarray, shape (n,)
        Cycles of actuation after which a design is compared: those of its shortest trial.
    real : ndarray, shape (n, 2)
        Its position then, voxel widths from its start along x and y; the mean over its trials.
    spread : ndarray, shape (n,)
        RMS distance of its trials from that mean, voxel widths; 0 for a single one.
    parameters : dict of str to ndarray, shape (p,)
        The parameters that differ between points, as in `Physics.of`.
    physics : Physics
        The parameters that the points share.
    end : ndarray, shape (p, n, 2)
        The predicted ends of the designs at every point, voxel widths; 0 if they diverged.
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
        """Which designs have a heading in reality, shape (n,); no count of headings has others."""
        return _length(self.real) >= LITTLE

    @cached_property
    def heading_error(self) -> Array:
        """Degrees between the headings, 0 to 180, shape (p, n); NaN if either is missing."""
        along, across = self._turn
        angle = np.degrees(np.arctan2(np.abs(across), along))
        return np.where(self._is_heading, angle, np.nan)

    @cached_property
    def matched(self) -> NDArray[np.bool_]:
        """Whether the headings differ by at most 45 degrees, shape (p, n); False if one is missing.

        A design that diverged has no heading.
        """
        along, across = self._turn
        return self._is_heading & (along >= np.abs(across))

    @cached_property
    def headings(self) -> NDArray[np.int64]:
        """Number of matching headings at every point, shape (p,)."""
        return np.asarray(self.matched.sum(axis=1))

    @property
    def share(self) -> Array:
        """`headings` as a share of the designs that have a heading in reality, shape (p,)."""
        return np.asarray(self.headings / self.has_heading.sum())

    @cached_property
    def distance_error(self) -> Array:
        """Predicted minus real distance, voxel widths, shape (p, n)."""
        return _length(self.end) - _length(self.real)

    @cached_property
    def end_error(self) -> Array:
        """Distance between predicted and real ends, voxel widths, shape (p, n)."""
        return _length(self.end - self.real)

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """The points, best first, shape (p,).

        By headings, then by the number of designs that diverge, then by the RMS of the end errors.
        """
        return np.lexsort([_rms(self.end_error), self.diverged.sum(axis=1), -self.headings])

    @property
    def best(self) -> int:
        """The best point."""
        return int(self.order[0])

    def point(self, i: int) -> dict[str, Any]:
        """Return a point: its scores, over all designs, and its parameters.

        Heading errors are over the designs that have a heading in both worlds; None if no design
        has.
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
        """Return the physics of a point for each design, over `cycles`, shape (n,), or others."""
        own = self.cycles if cycles is None else np.asarray(cycles, dtype=np.float64)
        return _physics(self.physics, self.parameters, np.full(len(self.designs), i), own)

    @property
    def _is_heading(self) -> NDArray[np.bool_]:
        return self.has_heading & (_length(self.end) >= LITTLE) & ~self.diverged

    @property
    def _turn(self) -> tuple[Array, Array]:
        """The dot and cross products of the ends, shape (p, n)."""
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
    """Compare every design that has real tracks with every point of a grid, in one simulation.

    Parameters
    ----------
    tracks : sequence of RealTrack, or MeasuredReality
        As `softvox_gym.real_tracks.read_tracks` reads them, or `tracks_of` makes them; in cm, for
        robots whose voxels are as wide as those of the physics. Every design is compared after the
        cycles of its shortest trial; those of `Reality.from_trials` after its cycles.
    grid : str or dict
        Axes by name, as text for `grid_of` or with their values; None stands for the default
        values. Axes are friction (pairs of static and kinetic), shear (T*, the shear strength over
        a voxel's weight), and any parameter of `Physics` that can differ between designs.
    physics : str, dict or Physics
        Everything that is not in the grid, except the duration, which comes from the tracks.
    threads, progress
        As in `simulate`.

    Returns
    -------
    Calibration

    Raises
    ------
    TypeError, ValueError
        If the grid is invalid or too large, the tracks are not `RealTrack` objects, or none has a
        heading.

    Notes
    -----
    Source: Kriegman et al. 2020, who searched for the pair of friction coefficients that makes
    their simulated robots move like the real ones, and found none. A design that diverged counts as
    standing still.

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
        raise ValueError("there are no tracks; give at least one")
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
    """Return the settings of every axis; ValueError if two set the same, or there are none."""
    if not grid:
        raise ValueError("the grid has no axes; name one, such as friction")
    axes = {name: settings(name, values) for name, values in grid.items()}
    taken: dict[str, str] = {}
    for name in axes:
        # T* and the shear strength are two forms of one parameter.
        for parameter in NAMES.get(name, (name,)):
            key = parameter.replace("shear_ratio", "shear_strength")
            if key in taken:
                raise ValueError(f"{taken[key]} and {name} both set {key}; give only one of them")
            taken[key] = name
    return list(axes.values())


def _physics(
    base: Physics, parameters: Mapping[str, Array], which: NDArray[np.int64], cycles: Array
) -> Physics:
    """Return the physics of a robot at each of some points, over its cycles."""
    changes: dict[str, Any] = {name: values[which] for name, values in parameters.items()}
    ratio = changes.pop("shear_ratio", None)
    if "gravity" in changes:  # three numbers would be a vector
        changes["gravity"] = np.multiply.outer(changes["gravity"], [0.0, 0.0, 1.0])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of kinetic friction above static
            made = replace(base, **changes).lasting(cycles)
            return made if ratio is None else made.sheared(ratio)
    except ParameterError as error:
        raise ValueError(str(error)) from None


def _length(vectors: Array) -> Array:
    return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt((values * values).mean(axis=-1)))
