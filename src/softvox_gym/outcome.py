"""What an environment tells of a batch of designs, in columns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import ACTIVE, N_DESIGNS, Design, digits_of, indices_of
from softvox_gym.simulation import Result

_STATUS = np.array(["diverged", "ok"], dtype=object)


@dataclass(frozen=True)
class Outcome:
    """What became of n designs, each tried k times.

    Parameters
    ----------
    design : ndarray of int64, shape (n,)
        Their numbers.
    track : ndarray, shape (n, k, samples, 3)
        The centre of mass from its start, voxel widths; NaN where diverged.
    displacement : ndarray, shape (n, k, 3)
        Voxel widths; NaN where diverged.
    steps : ndarray of int64, shape (n, k)
        Time steps simulated.
    is_repeated : bool
        Whether somebody asked for several trials, so that they want to see each.
    """

    design: NDArray[np.int64]
    track: NDArray[np.float64]
    displacement: NDArray[np.float64]
    steps: NDArray[np.int64]
    is_repeated: bool = False

    @classmethod
    def of(cls, result: Result, rows: NDArray[Any], samples: int, repeats: int | None) -> Outcome:
        """Return the outcome of a simulation of the rows of digits, each tried `repeats` times.

        Tracks have the given number of samples: one that is longer is cut, one that is shorter
        stays where it ended.
        """
        n = len(rows)
        assert result.track is not None
        track = result.track[:, :samples]
        missing = samples - track.shape[1]
        track = np.pad(track, ((0, 0), (0, missing), (0, 0)), constant_values=np.nan)
        track = np.where(np.isnan(track), result.displacement[:, np.newaxis], track)
        return cls(
            design=indices_of(rows),
            track=track.reshape(n, -1, samples, 3),
            displacement=result.displacement.reshape(n, -1, 3),
            steps=result.steps.astype(np.int64).reshape(n, -1),
            is_repeated=repeats is not None,
        )

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """The fitness of every trial, shape (n, k), 0 where it diverged."""
        d = self.displacement
        return _zero_for_nan(np.sqrt(d[..., 0] ** 2 + d[..., 1] ** 2))

    @cached_property
    def rewards(self) -> NDArray[np.float64]:
        """The mean of the values, shape (n,)."""
        return _mean(self.values)

    @property
    def observations(self) -> NDArray[np.float64]:
        """The mean track, shape (n, samples, 3); zeros for a trial that diverged."""
        return _mean(_zero_for_nan(self.track))

    def infos(self) -> dict[str, NDArray[Any]]:
        """Return the infos, key by key, each of shape (n, ...)."""
        is_ok = ~np.isnan(self.displacement[..., 0])
        any_ok = is_ok.any(axis=1)
        bodies = body_facts()
        displacement = _mean_of(self.displacement, is_ok)
        told: dict[str, NDArray[Any]] = {
            "design": self.design,
            "fitness": np.where(any_ok, self.rewards, np.nan),
            "displacement": displacement,
            "status": _STATUS[any_ok.astype(np.intp)],
            "n_voxels": bodies.n_voxels[self.design],
            "is_connected": bodies.is_connected[self.design],
            "steps": self.steps.sum(axis=1),
        }
        if self.is_repeated:
            told |= {"values": self.values, "displacements": self.displacement}
        return told


def _zero_for_nan(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.isnan(values), 0.0, values)


def _mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over trials (axis 1); of one, that one's own bits."""
    return values[:, 0].copy() if values.shape[1] == 1 else values.mean(axis=1)


def _mean_of(values: NDArray[np.float64], which: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the mean over the trials (axis 1) that are marked; NaN where none is."""
    if values.shape[1] == 1:
        return values[:, 0].copy()
    total = np.where(which[..., np.newaxis], values, 0.0).sum(axis=1)
    count = which.sum(axis=1)[:, np.newaxis]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


class Bodies(NamedTuple):
    """Facts about every design, each of shape (6561,)."""

    n_voxels: NDArray[np.int64]
    n_active: NDArray[np.int64]
    is_connected: NDArray[np.bool_]


@lru_cache(maxsize=1)
def body_facts() -> Bodies:
    """Return what the bodies of all designs are like; read-only."""
    digits = digits_of(np.arange(N_DESIGNS))
    made = Bodies(
        n_voxels=np.count_nonzero(digits, axis=1).astype(np.int64),
        n_active=np.count_nonzero(digits == ACTIVE, axis=1).astype(np.int64),
        is_connected=np.array([Design(i).is_connected for i in range(N_DESIGNS)]),
    )
    for values in made:
        values.flags.writeable = False
    return made
