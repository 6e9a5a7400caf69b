"""The graph that a mutation walks: designs of the 2x2x2 lattice that differ at one site."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import ACTIVE, N_DESIGNS, N_SITES, POWERS, digits_of

#: Each of the 8 sites has two other values.
N_NEIGHBOURS = N_SITES * ACTIVE


@lru_cache(maxsize=1)
def all_digits() -> NDArray[np.int64]:
    """Return the digits d_0 ... d_7 of every design.

    Returns
    -------
    ndarray of int64, shape (6561, 8)
        Row i is design i. Read-only.
    """
    return _read_only(digits_of(np.arange(N_DESIGNS)))


@lru_cache(maxsize=1)
def neighbours() -> NDArray[np.int64]:
    """Return the 16 designs that differ from each design at exactly one site.

    Returns
    -------
    ndarray of int64, shape (6561, 16)
        Row i holds the numbers of the neighbours of design i: two for site 0, the smaller digit
        first, then two for site 1, and so on. Read-only.

    Examples
    --------
    >>> from softvox_gym.landscapes.analysis import neighbours
    >>> neighbours()[0][:4]
    array([1, 2, 3, 6])
    """
    digits = all_digits()
    smaller, larger = np.where(digits == 0, 1, 0), np.where(digits == 2, 1, 2)
    pairs = np.stack([_with_digits(smaller), _with_digits(larger)], axis=2)
    return _read_only(pairs.reshape(N_DESIGNS, N_NEIGHBOURS))


def with_digit(digit: int) -> NDArray[np.int64]:
    """Return what each design becomes where one of its sites is given a digit.

    Parameters
    ----------
    digit : int
        0 absent, 1 passive, 2 active.

    Returns
    -------
    ndarray of int64, shape (6561, 8)
        Entry (i, s) is the number of design i with that digit at site s; i itself where it has it.
    """
    return _with_digits(np.full((N_DESIGNS, N_SITES), digit))


def distance_to(designs: ArrayLike) -> NDArray[np.int64]:
    """Return how many mutations every design is away from the nearest of some designs.

    Parameters
    ----------
    designs : int or sequence of int
        Design numbers, one or more.

    Returns
    -------
    ndarray of int64, shape (6561,)
        Hamming distances, 0 to 8.
    """
    distance = np.full(N_DESIGNS, N_SITES)
    distance[np.asarray(designs, dtype=np.int64)] = 0
    around = neighbours()
    for _ in range(N_SITES):
        distance = np.minimum(distance, distance[around].min(axis=1) + 1)
    return distance


def components(joined: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the pieces into which the graph falls when only some of its edges are kept.

    Parameters
    ----------
    joined : ndarray of bool, shape (6561, 16)
        Whether the edge to each of the `neighbours` is kept; the same seen from either end.

    Returns
    -------
    ndarray of int64, shape (6561,)
        For each design the smallest number in its piece.
    """
    label = np.arange(N_DESIGNS)
    around = neighbours()
    while True:
        near = np.where(joined, label[around], N_DESIGNS).min(axis=1)
        smaller = np.minimum(label, near)
        smaller = smaller[smaller]  # a label is a design of the same piece: take its label at once
        if np.array_equal(smaller, label):
            return label
        label = smaller


def checked_fitness(fitness: ArrayLike) -> NDArray[np.float64]:
    """Return the fitness of every design as finite numbers.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        Entry i belongs to design i. NaN, a design that diverged, becomes 0, the reward that the
        environment gives for it.

    Returns
    -------
    ndarray of float64, shape (6561,)
        A fresh array.

    Raises
    ------
    ValueError
        For another shape, or an infinite value.
    TypeError
        Where the values are not real numbers.
    """
    values = np.asarray(fitness)
    if values.dtype.kind not in "iuf":
        raise TypeError(f"fitness must be real numbers, got {values.dtype}")
    if values.shape != (N_DESIGNS,):
        raise ValueError(
            f"fitness must have shape ({N_DESIGNS},), entry i for design i; got {values.shape}"
        )
    values = np.where(np.isnan(values), 0.0, values.astype(np.float64))
    if np.isinf(values).any():
        raise ValueError(
            f"fitness must be finite, but design {int(np.isinf(values).argmax())} has "
            f"{values[np.isinf(values)][0]}; mark a design that diverged with NaN"
        )
    return values


def _with_digits(digits: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of each design after site s alone is given digits[:, s]."""
    changed: NDArray[np.int64] = (
        np.arange(N_DESIGNS)[:, np.newaxis] + (digits - all_digits()) * POWERS
    )
    return changed


def _read_only(values: NDArray[np.int64]) -> NDArray[np.int64]:
    values.flags.writeable = False
    return values
