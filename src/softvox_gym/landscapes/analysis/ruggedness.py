"""How rugged the landscape is: distance to the best, correlation along walks, neutrality."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import N_SITES
from softvox_gym.landscapes.analysis.graph import (
    N_NEIGHBOURS,
    checked_fitness,
    components,
    distance_to,
    neighbours,
)
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes


@dataclass(frozen=True)
class FitnessDistance:
    """How fitness goes with the distance to the fittest design.

    Parameters
    ----------
    best : tuple of int
        The fittest design, or all of them where several are equal.
    to_best : float or None
        Pearson's r of fitness and Hamming distance to the nearest of these, over all designs: -1
        where fitness falls with distance in a line, 0 where distance says nothing. None where all
        fitness is equal.
    to_class : float or None
        The same for the distance to the nearest turned or mirrored image of these.
    mean_by_distance : tuple of float or None
        Mean fitness of the designs 0, 1, ... 8 mutations away from `best`, voxel widths; None
        where there are none.
    """

    best: tuple[int, ...]
    to_best: float | None
    to_class: float | None
    mean_by_distance: tuple[float | None, ...]


@dataclass(frozen=True)
class Neutrality:
    """How many mutations change next to nothing.

    Parameters
    ----------
    threshold : float
        Voxel widths: a mutation that changes fitness by this much or less is neutral.
    share : float
        Of the 52488 pairs of neighbours, those that a neutral mutation joins.
    degree : float
        Mean number of neutral neighbours of a design, of 16.
    largest_network : int
        Designs in the largest set that neutral mutations join, one after the other.
    networks : int
        How many sets of two or more there are.
    """

    threshold: float
    share: float
    degree: float
    largest_network: int
    networks: int


def fitness_distance(fitness: ArrayLike) -> FitnessDistance:
    """Return the fitness-distance correlation, over all designs.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.

    Notes
    -----
    Source: T. Jones, S. Forrest, Fitness distance correlation as a measure of problem difficulty
    for genetic algorithms, ICGA 1995.
    """
    values = checked_fitness(fitness)
    best = np.flatnonzero(values == values.max())
    distance = distance_to(best)
    classes = symmetry_classes()
    images = np.flatnonzero(np.isin(classes, classes[best]))
    at = [values[distance == d] for d in range(N_SITES + 1)]
    return FitnessDistance(
        best=tuple(best.tolist()),
        to_best=_pearson(values, distance),
        to_class=_pearson(values, distance_to(images)),
        mean_by_distance=tuple(float(some.mean()) if len(some) else None for some in at),
    )


def autocorrelation(fitness: ArrayLike, *, lags: int = 10) -> NDArray[np.float64] | None:
    """Return the autocorrelation of fitness along a random walk, exactly.

    Every design has 16 neighbours, so a walk that takes each with probability 1/16 visits all
    designs equally often, and the correlation of the fitness now and s steps on is
    g' P^s g / g' g, with g the fitness less its mean and P the walk's transition matrix.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.
    lags : int
        Up to how many steps.

    Returns
    -------
    ndarray, shape (lags + 1,), or None
        rho(0) = 1, rho(1), ... rho(lags). None where all fitness is equal.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.

    Notes
    -----
    Source: E. Weinberger, Correlated and uncorrelated fitness landscapes and how to tell the
    difference, Biological Cybernetics 63, 1990.
    """
    values = checked_fitness(fitness)
    if not np.ptp(values):
        return None
    start = values - values.mean()
    steps = [start]
    for _ in range(lags):
        steps.append(steps[-1][neighbours()].mean(axis=1))
    rho: NDArray[np.float64] = np.array([start @ later for later in steps]) / (start @ start)
    return rho


def correlation_length(rho_1: float) -> float:
    """Return the steps of a random walk after which correlation has fallen by a factor e.

    Parameters
    ----------
    rho_1 : float
        Autocorrelation after one step, below 1.

    Returns
    -------
    float
        -1 / ln |rho_1|; 0 where it is 0.

    Notes
    -----
    Source: P. F. Stadler, Landscapes and their correlation functions, Journal of Mathematical
    Chemistry 20, 1996.
    """
    return -1 / math.log(abs(rho_1)) if rho_1 else 0.0


def variance_by_order(fitness: ArrayLike) -> NDArray[np.float64] | None:
    """Return the shares of the variance that come from 1, 2, ... 8 sites acting together.

    Fitness is a sum of one function per set of sites, each depending on the digits of its set and
    averaging to nothing over any one of them (the analysis of variance of a full factorial). The
    functions of sets of k sites are the eigenvectors of the random walk with eigenvalue
    1 - 3k/16, so the autocorrelation is rho(s) = sum of share_k (1 - 3k/16)^s.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.

    Returns
    -------
    ndarray, shape (8,), or None
        Sums to 1; entry k - 1 belongs to order k. None where all fitness is equal.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.

    Notes
    -----
    Source: P. F. Stadler, Landscapes and their correlation functions, Journal of Mathematical
    Chemistry 20, 1996 (amplitude spectra); B. Efron, C. Stein, The jackknife estimate of variance,
    Annals of Statistics 9, 1981 (the decomposition).
    """
    values = checked_fitness(fitness)
    if not np.ptp(values):
        return None
    cube = (values - values.mean()).reshape((3,) * N_SITES)
    # Rows: the mean, and two contrasts at right angles to it and to each other, all of length 1.
    basis = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3], [2], [6]])
    for _ in range(N_SITES):  # each turn takes the first axis and puts it last
        cube = np.tensordot(cube, basis, axes=(0, 1))
    order = (np.indices(cube.shape) > 0).sum(axis=0)
    power = np.bincount(order.ravel(), weights=(cube**2).ravel(), minlength=N_SITES + 1)[1:]
    shares: NDArray[np.float64] = power / power.sum()
    return shares


def neutrality(fitness: ArrayLike, *, threshold: float) -> Neutrality:
    """Return how many mutations change fitness by no more than a threshold.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.
    threshold : float
        Voxel widths; 0 for no change at all.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does; for a threshold that is negative or NaN.

    Notes
    -----
    Source: C. M. Reidys, P. F. Stadler, Neutrality in fitness landscapes, Applied Mathematics and
    Computation 117, 2001.
    """
    if not threshold >= 0:
        raise ValueError(f"threshold must be 0 or more voxel widths, got {threshold!r}")
    values = checked_fitness(fitness)
    neutral = np.abs(values[neighbours()] - values[:, np.newaxis]) <= threshold
    sizes = np.bincount(components(neutral))
    return Neutrality(
        threshold=threshold,
        share=float(neutral.mean()),
        degree=float(neutral.mean()) * N_NEIGHBOURS,
        largest_network=int(sizes.max()),
        networks=int((sizes > 1).sum()),
    )


def _pearson(values: NDArray[np.float64], distance: NDArray[np.int64]) -> float | None:
    """Return the correlation, or None where either does not vary."""
    if not np.ptp(values) or not np.ptp(distance):
        return None
    return float(np.corrcoef(values, distance)[0, 1])
