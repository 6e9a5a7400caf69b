"""The tessellation: every design of the 2x2x2 lattice a cell of an 81 x 81 map.

The eight digits are read two at a time, d_0 d_1 | d_2 d_3 | d_4 d_5 | d_6 d_7. The first pair
selects one of 3 x 3 squares, the second one of the 3 x 3 squares within that, and so on, four
levels deep: the first digit of a pair counts to the right, the second upward. Row 0 is at the
bottom and column 0 at the left, so the empty design is cell (0, 0), all passive (40, 40) and all
active (80, 80).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.landscapes.table import LATTICE

#: Pairs of sites, outermost first: the digit that counts to the right, and the one upward.
PAIRS = ((0, 1), (2, 3), (4, 5), (6, 7))

#: Cells along a side.
SIDE = 3 ** len(PAIRS)

_RIGHT, _UP = np.transpose(PAIRS)
#: Cells that each unit of a pair's digit moves by.
_WEIGHT = 3 ** np.arange(len(PAIRS))[::-1]


def cell_of(design: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the cells of designs on the map.

    Parameters
    ----------
    design : array_like of int, shape (...)
        Numbers of designs, 0 to 6560.

    Returns
    -------
    row, column : ndarray of int, shape (...)
        0 to 80; row 0 is at the bottom.

    Raises
    ------
    ValueError
        If no design has a number.
    """
    digits = LATTICE.digits(design)
    return digits[..., _UP] @ _WEIGHT, digits[..., _RIGHT] @ _WEIGHT


def design_at(row: ArrayLike, column: ArrayLike) -> NDArray[np.int64]:
    """Return the number of the design in a cell of the map; the inverse of `cell_of`.

    Parameters
    ----------
    row, column : array_like of int
        0 to 80, of shapes that broadcast; row 0 is at the bottom.

    Raises
    ------
    ValueError
        If a cell is outside the map.
    """
    for name, place in (("row", row), ("column", column)):
        if not np.all((np.asarray(place) >= 0) & (np.asarray(place) < SIDE)):
            raise ValueError(f"{name} must be 0 to {SIDE - 1}, got {place!r}")
    across, up = (np.asarray(place)[..., np.newaxis] // _WEIGHT % 3 for place in (column, row))
    number: NDArray[np.int64] = across @ 3**_RIGHT + up @ 3**_UP
    return number


def mapped(values: ArrayLike) -> NDArray[Any]:
    """Return one value per design, arranged as the map.

    Parameters
    ----------
    values : array_like, shape (6561, ...)
        In order of the designs' numbers.

    Returns
    -------
    ndarray, shape (81, 81, ...)
        Row 0 is the bottom of the map: plot it with the origin below.
    """
    return np.asarray(values)[design_at(*np.indices((SIDE, SIDE)))]
