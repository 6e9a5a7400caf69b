"""A robot grows voxel by voxel, only into one piece where that is asked for."""

import numpy as np
import pytest

from softvox_gym.design import BodyFacts
from softvox_gym.envs.growth import masks
from softvox_gym.lattice import Lattice


def grown(lattice):
    """Return all that can be built along the masks, digits of shape (n, sites)."""
    rows = np.zeros((1, lattice.sites), np.uint8)
    for site in range(lattice.sites):
        allowed = masks(rows, np.full(len(rows), site), lattice, connected=True)
        before, digits = np.nonzero(allowed)
        rows = rows[before]
        rows[:, site] = digits
    return rows


@pytest.mark.parametrize("shape", [(2, 2, 2), (3, 3, 1), (1, 4, 2), (3, 1, 1), (1, 1, 1)])
def test_along_the_masks_lie_all_connected_designs_and_no_other(shape):
    lattice = Lattice(*shape)
    every = lattice.digits(np.arange(lattice.n_designs))
    connected = np.flatnonzero(BodyFacts.of(every, lattice).is_connected)
    assert sorted(lattice.numbers(grown(lattice)).tolist()) == connected.tolist()
