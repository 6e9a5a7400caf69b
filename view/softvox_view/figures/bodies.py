"""The robots that tracks and volumes are shown of: the fittest of nine bodies."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import softvox_gym
from softvox_gym.design import Design
from softvox_gym.landscapes.analysis.graph import all_digits
from softvox_gym.landscapes.analysis.symmetry import symmetries

BODIES = 9


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
