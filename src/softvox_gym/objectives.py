"""Objectives: measures of a design, of which more is always better."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, ACTIVE
from softvox_gym.real_tracks import LITTLE
from softvox_gym.tasks import Task

Array = NDArray[np.float64]


class Tried(NamedTuple):
    """The inputs of objectives: n designs, each tried k times; diverged trials are 0."""

    designs: NDArray[np.uint8]  #: (n, nx, ny, nz) digits
    task: Task
    fitness: Array  #: (n, k) as measured, voxel widths
    displacement: Array  #: (n, k, 3) voxel widths
    track: Array  #: (n, k, samples, 3) voxel widths
    energy: Array  #: (n, k) J

    @property
    def strides(self) -> Array:
        """Horizontal travel of the centre of mass from sample to sample, shape (n, k, c, 2)."""
        return np.diff(self.track[..., :2], axis=2)


@dataclass(frozen=True)
class Objective:
    """An objective: its name, its unit, whether it is a cost, its bounds, its definition.

    A cost is negated, so that more is better for every objective. The function returns the value of
    each trial, shape (n, k), with that sign.
    """

    name: str
    unit: str
    is_cost: bool
    low: float
    high: float
    about: str
    values: Callable[[Tried], Array]


OBJECTIVES: dict[str, Objective] = {}


def _objective(
    name: str, unit: str, about: str, *, is_cost: bool = False, low: float = -np.inf, high: float
) -> Callable[[Callable[[Tried], Array]], None]:
    """Register the decorated function as an `Objective`."""

    def enter(values: Callable[[Tried], Array]) -> None:
        OBJECTIVES[name] = Objective(name, unit, is_cost, low, high, about, values)

    return enter


@_objective(
    "displacement",
    "voxel widths",
    "the fitness, as measured: √(dx² + dy²), or in the directed task d·h",
    high=np.inf,
)
def _displacement(tried: Tried) -> Array:
    return tried.fitness


@_objective("voxels", "", "minus the number of voxels", is_cost=True, high=0.0)
def _voxels(tried: Tried) -> Array:
    return _cost_of(tried.designs != ABSENT, tried)


@_objective("actuators", "", "minus the number of active voxels", is_cost=True, high=0.0)
def _actuators(tried: Tried) -> Array:
    return _cost_of(tried.designs >= ACTIVE, tried)


@_objective("energy", "J", "minus the pump's work on the links", is_cost=True, high=np.inf)
def _energy(tried: Tried) -> Array:
    return 0.0 - tried.energy


@_objective(
    "straightness",
    "",
    f"|Σ s| / Σ |s|, s the strides; 0 if Σ |s| < {LITTLE:g}",
    low=0.0,
    high=1.0,
)
def _straightness(tried: Tried) -> Array:
    lengths = _lengths(tried.strides).sum(axis=2)
    return _share(_lengths(tried.strides.sum(axis=2)), lengths, lengths >= LITTLE)


@_objective(
    "stability",
    "",
    f"1 / √(1 + CV²) = mean |s| / √(mean s²); 0 if Σ |s| < {LITTLE:g}",
    low=0.0,
    high=1.0,
)
def _stability(tried: Tried) -> Array:
    lengths = _lengths(tried.strides)
    total, squares = lengths.sum(axis=2), (lengths * lengths).sum(axis=2)
    return _share(total, np.sqrt(lengths.shape[2] * squares), total >= LITTLE)


@_objective(
    "heading",
    "voxel widths",
    "d·h, h the unit vector of the task's heading, or of x if it has none",
    high=np.inf,
)
def _heading(tried: Tried) -> Array:
    return Task("directed", tried.task.heading).reward(tried.displacement)


def _cost_of(counted: NDArray[np.bool_], tried: Tried) -> Array:
    """Return minus the number of counted sites of each design, for every trial."""
    counts = np.count_nonzero(counted, axis=(1, 2, 3)).astype(np.float64)
    return np.repeat(0.0 - counts[:, np.newaxis], tried.fitness.shape[1], axis=1)


def _lengths(vectors: Array) -> Array:
    x, y = vectors[..., 0], vectors[..., 1]
    return np.asarray(np.sqrt(x * x + y * y))


def _share(part: Array, whole: Array, is_defined: NDArray[np.bool_]) -> Array:
    """Return part / whole, at most 1, or 0 where it is undefined."""
    return np.where(is_defined, np.minimum(part / np.where(is_defined, whole, 1.0), 1.0), 0.0)


def objectives_of(names: Sequence[str]) -> tuple[Objective, ...]:
    """Return objectives by their names, in that order.

    Raises
    ------
    TypeError, ValueError
        If it is no sequence of names, is empty, or has an unknown or repeated name.
    """
    known = ", ".join(OBJECTIVES)
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise TypeError(
            'objectives must be a sequence of names, such as ("displacement", "voxels"), got '
            f"{names!r}; there are {known}"
        )
    for i, name in enumerate(names):
        if not isinstance(name, str) or name not in OBJECTIVES:
            close = difflib.get_close_matches(str(name), OBJECTIVES, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            raise ValueError(f"no objective {name!r}{hint}; there are {known}")
        if name in names[:i]:
            raise ValueError(f"objectives has {name} twice; name each only once")
    if not len(names):
        raise ValueError(f"objectives must name at least one; there are {known}")
    return tuple(OBJECTIVES[name] for name in names)
