"""The mutation graph: designs of the 2x2x2 lattice, joined if they differ at one site."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import ACTIVE
from softvox_gym.landscapes.table import LATTICE, N_DESIGNS

N_SITES = LATTICE.sites

#: Each of the 8 sites has two other values.
N_NEIGHBOURS = N_SITES * ACTIVE


@lru_cache(maxsize=1)
def all_digits() -> NDArray[np.int64]:
    """Return the digits d_0 ... d_7 of every design, shape (6561, 8); read-only."""
    return read_only(LATTICE.digits(np.arange(N_DESIGNS)).astype(np.int64))


@lru_cache(maxsize=1)
def neighbours() -> NDArray[np.int64]:
    """Return the 16 designs that differ from each design at exactly one site, shape (6561, 16).

    Row i holds the numbers of the neighbours of design i: two for site 0, the smaller digit first,
    then two for site 1, and so on. Read-only.

    Examples
    --------
    >>> from softvox_gym.landscapes.analysis import neighbours
    >>> neighbours()[0][:4]
    array([1, 2, 3, 6])
    """
    digits = all_digits()
    smaller, larger = np.where(digits == 0, 1, 0), np.where(digits == 2, 1, 2)
    pairs = np.stack([with_digit(smaller), with_digit(larger)], axis=2)
    return read_only(pairs.reshape(N_DESIGNS, N_NEIGHBOURS))


def with_digit(digit: int | NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of every design after one site gets a digit, shape (6561, 8).

    The digit is one for all, or one per design and site, shape (6561, 8).
    """
    powers: NDArray[np.int64] = 3 ** np.arange(N_SITES)
    return np.arange(N_DESIGNS)[:, np.newaxis] + (digit - all_digits()) * powers


def distance_to(designs: ArrayLike) -> NDArray[np.int64]:
    """Return the distance in mutations (0 to 8) of every design from the nearest of some."""
    distance = np.full(N_DESIGNS, N_SITES)
    distance[np.asarray(designs, dtype=np.int64)] = 0
    for _ in range(N_SITES):
        distance = np.minimum(distance, distance[neighbours()].min(axis=1) + 1)
    return distance


def components(joined: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the components of the graph when only some of its edges are kept.

    Takes for each of the `neighbours` whether the edge to it is kept, shape (6561, 16), the same
    from both ends. Returns for each design the smallest number in its component, shape (6561,).
    """
    label = np.arange(N_DESIGNS)
    while True:
        near = np.where(joined, label[neighbours()], N_DESIGNS).min(axis=1)
        smaller = np.minimum(label, near)
        smaller = smaller[smaller]  # a label is a design of the same piece: take its label at once
        if np.array_equal(smaller, label):
            return label
        label = smaller


def read_only(values: NDArray[Any]) -> NDArray[Any]:
    """Return the same array, made read-only."""
    values.flags.writeable = False
    return values
