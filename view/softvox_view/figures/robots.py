"""Pictures of robots as built; and the robots that tracks and volumes are shown of."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym.design import Design
from softvox_gym.landscapes.analysis.graph import all_digits
from softvox_gym.landscapes.analysis.symmetry import symmetries
from softvox_gym.rendering import render
from softvox_view.replay.data import rest_pose

BODIES = 9

#: Voxel widths from the camera to the middle of the lattice: the lattice fills the picture.
DISTANCE = 6.6
MIDDLE = (1.0, 1.0, 0.86)


@lru_cache(maxsize=1)
def best_of_bodies() -> tuple[Design, ...]:
    """Return the fittest design of each of nine bodies, fittest first.

    A body is which sites are filled, with whatever; bodies turned about the vertical or mirrored
    are the same. The nine are those with the fittest designs.
    """
    filled = (all_digits() > 0).astype(np.int64)
    bodies = np.min([filled[:, order] @ (1 << np.arange(8)) for order in symmetries()], axis=0)
    best: dict[int, Design] = {}
    for number in np.argsort(-softvox_gym.landscape()["fitness"], kind="stable"):
        best.setdefault(int(bodies[number]), Design(int(number)))
        if len(best) == BODIES:
            break
    return tuple(best.values())


@lru_cache(maxsize=512)
def picture(design: Design, size: int) -> NDArray[np.uint8]:
    """Return a picture of a design of the 2x2x2 lattice as built, so many pixels along a side.

    Read-only. All are seen from the same place, so that sites can be compared.
    """
    made: NDArray[Any] = render(
        rest_pose(design.array), width=size, height=size, look_at=MIDDLE, distance=DISTANCE
    )
    made.flags.writeable = False
    return made
