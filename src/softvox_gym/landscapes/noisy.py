"""The landscape under noise: the fitness of every design in a world that varies.

A table that ships with the package, and the function that draws it; `tools/noise.py` made it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from softvox_gym.landscapes.table import COMPUTED, N_DESIGNS, Table, landscape
from softvox_gym.physics import Physics

#: File in the package's folder `data/computed`.
STATISTICS = "noise.npz"

#: Levels of `softvox_gym.noise.Jakobi` that the table has.
LEVELS = (0.0, 0.5, 1.0, 2.0, 4.0)

_NUMBERS = ("mean", "std", "q10", "min", "p_diverged", "dx", "dy")
ROW = np.dtype([("design", "i8"), *((name, "f8") for name in _NUMBERS), ("draws", "i8")])


def noisy_landscape(level: float = 1.0) -> Table:
    """Return the statistics of every design under `softvox_gym.noise.Jakobi` at a level.

    Estimated from 64 draws per design. The 200 fittest without noise were then drawn anew, 256
    times, and have the statistics of these fresh draws alone. The same was done with the designs
    that had the 100 best means, until no further design entered that group, and likewise with the
    best 20, 4096 times. The best mean is still the best of 20, and a little lucky: by less than its
    standard error or two. Level 0 is the exact landscape.

    Parameters
    ----------
    level : {0, 0.5, 1, 2, 4}

    Returns
    -------
    Table, a structured ndarray of shape (6561,)
        Row i is design i: its number; mean, standard deviation (n - 1), 10 % quantile and minimum
        of its fitness in voxel widths, where a draw that diverged counts as 0; p_diverged, the
        share of such draws; dx, dy, the mean displacement of the others in voxel widths; draws,
        their number. More draws give a lower minimum: compare minima only between equal numbers of
        draws. A fresh copy.

    Raises
    ------
    ValueError
        If the table lacks the level.
    """
    if level not in LEVELS:
        known = ", ".join(f"{one:g}" for one in LEVELS)
        raise ValueError(f"no landscape at noise level {level!r}; there are levels {known}")
    rows = _measured()[name_of(level)].copy() if level else _exact()
    return Table.of(rows, Physics.published())


@lru_cache(maxsize=1)
def _measured() -> dict[str, NDArray[np.void]]:
    with (COMPUTED / STATISTICS).open("rb") as file, np.load(file) as archive:
        return dict(archive)


def _exact() -> NDArray[np.void]:
    exact = landscape()
    rows = np.zeros(N_DESIGNS, dtype=ROW)
    rows["mean"] = rows["q10"] = rows["min"] = exact["fitness"]
    for name in ("design", "dx", "dy"):
        rows[name] = exact[name]
    rows["draws"] = 1
    return rows


def name_of(level: float) -> str:
    """Return the name of a level in the archive."""
    return f"level_{level:g}"
