"""Where displacements point."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

#: Voxel widths, which are cm for the paper's voxel of 1 cm: what travels less has no heading to
#: speak of. Robots that get nowhere sway by up to 0.18 within a cycle.
LITTLE = 0.25


def heading(displacement: NDArray[np.float64]) -> float:
    """Return where a displacement points, degrees from +x towards +y; NaN below `LITTLE`."""
    x, y = displacement
    return math.degrees(math.atan2(y, x)) if math.hypot(x, y) >= LITTLE else math.nan


def angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the angle between two displacements, degrees, 0 to 180.

    NaN where one is less than `LITTLE`.
    """
    if min(np.hypot(*a), np.hypot(*b)) < LITTLE:
        return math.nan
    across, along = a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]
    return math.degrees(abs(math.atan2(across, along)))
