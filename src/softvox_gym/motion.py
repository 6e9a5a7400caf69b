"""The motion of robots in a batch, in voxel widths, for pictures and recordings."""

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
    built: Pose  #: the robot before the first frame
    begin: int  #: the frame nearest to the start of the pump
    ends: NDArray[Any]  #: (2, 3) the centre of mass at that start and the end; NaN if it diverged

    @classmethod
    def of(cls, result: Result, i: int, edge: float | None = None) -> Motion:
        """Return the motion of a design of a batch, up to its last frame.

        A run that diverges at once has one frame, as built. `edge` is the edge of a whole voxel, m,
        if it differs from that of the result's physics.

        Raises
        ------
        ValueError
            If the result has no frames.
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
        """The robot when the pump began, and its path from then on, as long as the fitness."""
        path = self.centre[self.begin :]
        if np.isfinite(self.ends).all():  # no frame may be exactly at the start or the end
            path[[0, -1]] = self.ends
        return Walk(self.pose(self.begin), path)

    def pose(self, frame: int) -> Pose:
        """Return the robot at a frame, or at its last frame if that is earlier."""
        k, built = min(frame, self.last), self.built
        moved = self.position[k], self.quaternion[k], self.edge[k]
        return Pose(*moved, built.active, built.site)


def frames_of(result: Result) -> Frames:
    """Return the frames of a result; ValueError if it has none."""
    if result.frames is None:
        raise ValueError("the result has no frames; simulate(..., frames=20) keeps every 20th step")
    return result.frames


def rest_pose(digits: NDArray[np.uint8]) -> Pose:
    """Return a design, digits indexed [x, y, z], as built; its voxels are in order of sites."""
    site = np.argwhere(digits.T != ABSENT)[:, ::-1]
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(site), 1))
    return Pose(site + 0.5, upright, np.ones(len(site)), digits[tuple(site.T)] == ACTIVE, site)
