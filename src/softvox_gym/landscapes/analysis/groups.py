"""Kinds of designs, how many there are of each and how far they travel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import ACTIVE, N_DESIGNS, Design
from softvox_gym.landscapes.analysis.graph import all_digits, checked_fitness

QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9, 0.99)


@dataclass(frozen=True)
class Group:
    """The fitness of a group of designs.

    Parameters
    ----------
    designs : int
        How many.
    fittest : int
        The fittest design, the smallest number where several are equal.
    best, mean : float
        Voxel widths.
    quantiles : dict of float to float
        Voxel widths, linearly interpolated.
    """

    designs: int
    fittest: int
    best: float
    mean: float
    quantiles: dict[float, float]


@lru_cache(maxsize=1)
def n_pieces() -> NDArray[np.int64]:
    """Return into how many pieces the voxels of every design fall that touch by faces.

    Returns
    -------
    ndarray of int64, shape (6561,)
        0 for the empty design. Read-only.
    """
    pieces = np.array([len(Design(number).components) for number in range(N_DESIGNS)])
    pieces.flags.writeable = False
    return pieces


def groups(fitness: ArrayLike) -> dict[str, Group]:
    """Return the fitness of all designs, and of those of each kind.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.

    Returns
    -------
    dict of str to Group
        "all"; "one_piece" (connected by faces), "several_pieces" and "empty", which together are
        all; and "no_actuator", the designs without an active voxel, the empty one included.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.
    """
    values = checked_fitness(fitness)
    pieces = n_pieces()
    kinds = {
        "all": np.full(N_DESIGNS, True),
        "one_piece": pieces == 1,
        "several_pieces": pieces > 1,
        "empty": pieces == 0,
        "no_actuator": (all_digits() != ACTIVE).all(axis=1),
    }
    return {name: _group(values, np.flatnonzero(kind)) for name, kind in kinds.items()}


def _group(values: NDArray[np.float64], designs: NDArray[np.intp]) -> Group:
    own = values[designs]
    return Group(
        designs=len(designs),
        fittest=int(designs[own.argmax()]),
        best=float(own.max()),
        mean=float(own.mean()),
        quantiles=dict(zip(QUANTILES, np.quantile(own, QUANTILES).tolist(), strict=True)),
    )
