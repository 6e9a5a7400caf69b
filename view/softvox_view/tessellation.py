"""The tessellation: every design of the 2x2x2 lattice a cell of an 81 x 81 map.

The eight digits are read two at a time, d_0 d_1 | d_2 d_3 | d_4 d_5 | d_6 d_7. The first pair
chooses one of 3 x 3 squares, the second one of the 3 x 3 squares within that, and so on, four deep:
the first digit of a pair counts to the right, the second upward. Row 0 is at the bottom and column
0 at the left, so the empty design is cell (0, 0), all passive (40, 40) and all active (80, 80).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import N_DESIGNS, digits_of

#: Pairs of sites, outermost first: the digit that counts to the right, and the one upward. A pair
#: is two neighbours along x; the first two pairs are the bottom layer.
PAIRS = ((0, 1), (2, 3), (4, 5), (6, 7))

#: Cells along a side.
SIDE = 3 ** len(PAIRS)


def cell_of(design: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where designs lie on the map.

    Parameters
    ----------
    design : int or array_like of int
        Numbers of designs, 0 to 6560, of any shape.

    Returns
    -------
    row, column : ndarray of int
        Of the shape of `design`, 0 to 80; row 0 is at the bottom.

    Raises
    ------
    TypeError
        Where a number is not whole.
    ValueError
        For a number that no design has.
    """
    number = _whole("design", design, N_DESIGNS)
    digits = digits_of(number)
    rightward, upward = np.transpose(PAIRS)
    weight = 3 ** np.arange(len(PAIRS))[::-1]
    return digits[..., upward] @ weight, digits[..., rightward] @ weight


def design_at(row: Any, column: Any) -> NDArray[np.int64]:
    """Return the number of the design in a cell of the map; undoes `cell_of`.

    Parameters
    ----------
    row, column : int or array_like of int
        0 to 80, of shapes that broadcast; row 0 is at the bottom.

    Returns
    -------
    ndarray of int

    Raises
    ------
    TypeError
        Where a row or column is not whole.
    ValueError
        For a cell off the map.
    """
    level = 3 ** np.arange(len(PAIRS))[::-1]
    rightward, upward = np.transpose(PAIRS)
    across = _whole("column", column, SIDE)[..., np.newaxis] // level % 3
    up = _whole("row", row, SIDE)[..., np.newaxis] // level % 3
    number: NDArray[np.int64] = across @ 3**rightward + up @ 3**upward
    return number


def mapped(values: Any) -> NDArray[Any]:
    """Lay one value per design out as the map.

    Parameters
    ----------
    values : array_like, shape (6561, ...)
        In order of the designs' numbers.

    Returns
    -------
    ndarray, shape (81, 81, ...)
        Row 0 is the bottom of the map: show it with the origin below.

    Raises
    ------
    ValueError
        Where there is not one value per design.
    """
    array = np.asarray(values)
    if array.shape[:1] != (N_DESIGNS,):
        raise ValueError(f"values must be {N_DESIGNS}, one per design, got shape {array.shape}")
    rows, columns = np.indices((SIDE, SIDE))
    return array[design_at(rows, columns)]


def _whole(name: str, values: Any, end: int) -> NDArray[np.int64]:
    array = np.asarray(values)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name} must be whole numbers, got {array.dtype} values")
    if np.any((array < 0) | (array >= end)):
        wrong = array[(array < 0) | (array >= end)].flat[0]
        raise ValueError(f"{name} must be 0 to {end - 1}, got {wrong}")
    return array.astype(np.int64)
