"""Episodes that build a robot voxel by voxel, and try it at the end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, ACTIVE
from softvox_gym.lattice import Lattice

Bools = NDArray[np.bool_]


def masks(
    rows: NDArray[np.uint8], following: NDArray[np.intp], lattice: Lattice, *, connected: bool
) -> Bools:
    """Return which digits the next sites may get.

    Where only connected robots are wanted, these are the digits after which the sites still open
    can join all that stands into one piece. That is so when what stands lies within one piece of
    what stands and is open together: were all open sites of that piece filled, it would be one.
    No robot is no piece, so that the last site can't be absent where nothing stands.

    Parameters
    ----------
    rows : ndarray of uint8, shape (n, sites)
        The digits so far, 0 of sites still open.
    following : ndarray of int, shape (n,)
        The next site of each; all before it are built, and it and all behind it are open.
    lattice : Lattice
    connected : bool
        Whether only what can end in one piece is allowed; else all digits are.

    Returns
    -------
    ndarray of bool, shape (n, 3)
        All true where no digit leads to one piece any more, as after the last site.
    """
    if not connected:
        return np.ones((len(rows), ACTIVE + 1), dtype=np.bool_)
    sites, stands = np.arange(lattice.sites), rows != ABSENT
    here, later = sites == following[:, np.newaxis], sites > following[:, np.newaxis]
    absent = _can_join(stands, later, lattice)
    present = _can_join(stands | here, later, lattice)
    allowed = np.stack([absent, present, present], axis=1)
    return np.asarray(allowed | ~allowed.any(axis=1, keepdims=True))


def _can_join(stands: Bools, is_open: Bools, lattice: Lattice) -> Bools:
    """Return whether open sites can join what stands into one piece, shape (n,)."""
    free = stands | is_open
    first = np.where(stands.any(axis=1), stands.argmax(axis=1), free.argmax(axis=1))
    start = np.arange(lattice.sites) == first[:, np.newaxis]
    reached = lattice.to_rows(_reached(lattice.to_stack(start & free), lattice.to_stack(free)))
    return np.asarray(free.any(axis=1) & (reached | ~stands).all(axis=1))


def _reached(start: Bools, free: Bools) -> Bools:
    """Return what of the free sites hangs together with the first by faces, (n, nx, ny, nz)."""
    reached = start
    while True:
        grown = reached.copy()
        for axis in (1, 2, 3):
            new, old = np.moveaxis(grown, axis, 0), np.moveaxis(reached, axis, 0)
            new[1:] |= old[:-1]
            new[:-1] |= old[1:]
        grown &= free
        if np.array_equal(grown, reached):
            return reached
        reached = grown
