"""How robots of a batch moved, in voxel widths: what pictures and recordings of them show."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, ACTIVE
from softvox_gym.rendering import Pose, Walk
from softvox_gym.simulation import Frames, Result


class Motion(NamedTuple):
    """One robot, frame by frame, its m voxels in the order of their sites."""

    position: NDArray[Any]  #: (k, m, 3) centres
    quaternion: NDArray[Any]  #: (k, m, 4) w, x, y, z
    edge: NDArray[Any]  #: (k, m)
    built: Pose  #: before the first frame
    begin: int  #: the frame nearest to when the pump begins
    ends: NDArray[Any]  #: (2, 3) the centre of mass then, and at the end; NaN where it diverged

    @classmethod
    def of(cls, result: Result, i: int, edge: float | None = None) -> Motion:
        """Return how a design of a batch moved, up to the last frame that it has.

        A run that diverges at once has one frame, as built. `edge` is that of a whole voxel, m,
        where it is not that of the result's physics.

        Raises
        ------
        ValueError
            Where the result has no frames.
        """
        frames, built = frames_of(result), rest_pose(result.designs[i])
        assert built.site is not None
        x, y, z = built.site.T
        position, quaternion, edges = (
            values[i][:, x, y, z] for values in (frames.position, frames.quaternion, frames.edge)
        )
        finite = np.asarray(np.isfinite(position).all((1, 2)) & np.isfinite(edges).all(1))
        ends = np.stack([result.start[i], result.end[i]])
        if not finite[0]:
            still = built.position[None], built.quaternion[None], built.edge[None]
            return cls(*still, built, 0, ends)
        count, width = int(np.append(finite, False).argmin()), edge or result.physics.edge
        step = float(np.ptp(frames.time[i, :2])) or 1.0
        begin = min(round(result.physics.settle_time / step), count - 1)
        moving = position[:count] / width, quaternion[:count], edges[:count] / width
        return cls(*moving, built, begin, ends)

    @property
    def last(self) -> int:
        """The number of the last frame."""
        return len(self.edge) - 1

    @property
    def centre(self) -> NDArray[Any]:
        """The centre of mass, (k, 3)."""
        if not self.position.size:
            return np.zeros((len(self.edge), 3))
        return np.asarray(self.position.mean(axis=1))

    @property
    def walk(self) -> Walk:
        """Where it stood when the pump began, and its path from then: as long as the fitness."""
        path = self.centre[self.begin :]
        if np.isfinite(self.ends).all():  # frames may lie beside both moments
            path[[0, -1]] = self.ends
        return Walk(self.pose(self.begin), path)

    def pose(self, frame: int) -> Pose:
        """Return the robot at a frame; past its last, that one."""
        k, built = min(frame, self.last), self.built
        moved = self.position[k], self.quaternion[k], self.edge[k]
        return Pose(*moved, built.active, built.site)


def frames_of(result: Result) -> Frames:
    """Return the frames of a result; ValueError where it has none."""
    if result.frames is None:
        raise ValueError("the result has no frames; simulate(..., frames=20) keeps every 20th step")
    return result.frames


def rest_pose(digits: NDArray[np.uint8]) -> Pose:
    """Return a design, an array of digits indexed [x, y, z], as it is built.

    Its voxels come in the order of their sites.
    """
    site = np.argwhere(digits.T != ABSENT)[:, ::-1]
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(site), 1))
    return Pose(site + 0.5, upright, np.ones(len(site)), digits[tuple(site.T)] == ACTIVE, site)
