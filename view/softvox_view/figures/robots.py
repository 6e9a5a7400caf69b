"""Pictures of robots as built, for figures."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.rendering import render
from softvox_view.replay.data import rest_pose

#: Voxel widths from the camera to the middle of the lattice: the lattice fills the picture.
DISTANCE = 6.6
MIDDLE = (1.0, 1.0, 0.86)


@lru_cache(maxsize=512)
def picture(design: Design, size: int) -> NDArray[np.uint8]:
    """Return a square picture of a design of the 2x2x2 lattice as built.

    Parameters
    ----------
    design : Design
    size : int
        Pixels along a side.

    Returns
    -------
    ndarray of uint8, shape (size, size, 3)
        Read-only. All from the same place, so that sites can be compared.
    """
    made: NDArray[Any] = render(
        rest_pose(design.array), width=size, height=size, look_at=MIDDLE, distance=DISTANCE
    )
    made.flags.writeable = False
    return made
