"""What a replay is made of, as far as it needs to know: `softvox_gym.Result` stands above it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from softvox_gym.physics import Physics


class RecordedFrames(Protocol):
    """The frames of a batch: `softvox_gym.Frames`."""

    @property
    def step(self) -> NDArray[np.int64]:
        """Steps, shape (k,)."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Times, shape (n, k); s."""

    @property
    def position(self) -> NDArray[np.float64]:
        """Centres of the voxels, shape (n, k, nx, ny, nz, 3); m."""

    @property
    def quaternion(self) -> NDArray[np.float64]:
        """Orientations w, x, y, z, shape (n, k, nx, ny, nz, 4)."""

    @property
    def edge(self) -> NDArray[np.float64]:
        """Edges of the voxels, shape (n, k, nx, ny, nz); m."""


class Recorded(Protocol):
    """What became of a batch of designs: `softvox_gym.Result`."""

    @property
    def designs(self) -> NDArray[np.uint8]:
        """Digits, shape (n, nx, ny, nz)."""

    @property
    def physics(self) -> Physics:
        """The physics of the run."""

    @property
    def status(self) -> NDArray[np.str_]:
        """Either "ok" or "diverged", shape (n,)."""

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Travel in voxel widths, shape (n, 3); NaN where diverged."""

    @property
    def fitness(self) -> NDArray[np.float64]:
        """Horizontal travel in voxel widths, shape (n,); NaN where diverged."""

    @property
    def frames(self) -> RecordedFrames | None:
        """The frames; None where none were kept."""


def frames_of(result: Recorded) -> RecordedFrames:
    """Return the frames of a result.

    Raises
    ------
    ValueError
        Where it has none.
    """
    if result.frames is None:
        raise ValueError("the result has no frames; simulate(..., frames=20) keeps every 20th step")
    return result.frames


def checked_places(result: Recorded, designs: tuple[int, ...]) -> list[int]:
    """Return places in the batch, all where none is given.

    Raises
    ------
    ValueError
        Where one is outside the batch.
    """
    n = len(result.status)
    for i in designs:
        if not 0 <= i < n:
            raise ValueError(f"design {i} of the batch was asked for, which has 0 to {n - 1}")
    return list(designs) or list(range(n))
