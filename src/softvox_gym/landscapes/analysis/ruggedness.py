"""How rugged the landscape is: distance to the best, correlation along walks, neutrality."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softvox_gym.landscapes.analysis.graph import (
    N_NEIGHBOURS,
    N_SITES,
    components,
    distance_to,
    neighbours,
)
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.landscapes.section import Column, Section

#: Voxel widths; mutations that change fitness by at most this much are neutral.
THRESHOLDS = (0.0, 0.01, 0.1)


def autocorrelation(
    fitness: NDArray[np.float64], *, lags: int = N_SITES
) -> NDArray[np.float64] | None:
    """Return the autocorrelation of fitness along a random walk, exactly.

    Every design has 16 neighbours, so a walk that takes each with probability 1/16 visits all
    designs equally often, and the correlation of the fitness now and s steps on is
    g' P^s g / g' g, with g the fitness less its mean and P the walk's transition matrix.

    Returns
    -------
    ndarray, shape (lags + 1,), or None
        rho(0) = 1, rho(1), ... rho(lags). None if all fitness is equal.

    Source: E. Weinberger, Correlated and uncorrelated fitness landscapes and how to tell the
    difference, Biological Cybernetics 63, 1990.
    """
    if not np.ptp(fitness):
        return None
    steps = [fitness - fitness.mean()]
    for _ in range(lags):
        steps.append(steps[-1][neighbours()].mean(axis=1))
    products = np.array([steps[0] @ later for later in steps])
    return np.asarray(products / products[0])


def correlation_length(rho_1: float) -> float:
    """Return the steps of a random walk after which correlation has fallen by a factor e.

    -1 / ln |rho_1|, where rho_1 is the autocorrelation after one step, below 1; 0 if that is 0.

    Source: P. F. Stadler, Landscapes and their correlation functions, Journal of Mathematical
    Chemistry 20, 1996.
    """
    return -1 / math.log(abs(rho_1)) if rho_1 else 0.0


def variance_by_order(fitness: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the shares of the variance that come from 1, 2, ... 8 sites acting together.

    Fitness is a sum of one function per set of sites, each depending on the digits of its set and
    averaging to nothing over any one of them (the analysis of variance of a full factorial). The
    functions of sets of k sites are the eigenvectors of the random walk with eigenvalue
    1 - 3k/16, so the autocorrelation is rho(s) = sum of share_k (1 - 3k/16)^s.

    Returns
    -------
    ndarray, shape (8,), or None
        Sums to 1; entry k - 1 belongs to order k. None if all fitness is equal.

    Source: P. F. Stadler, Landscapes and their correlation functions, Journal of Mathematical
    Chemistry 20, 1996 (amplitude spectra); B. Efron, C. Stein, The jackknife estimate of variance,
    Annals of Statistics 9, 1981 (the decomposition).
    """
    if not np.ptp(fitness):
        return None
    cube = (fitness - fitness.mean()).reshape((3,) * N_SITES)
    # Rows: the mean, and two contrasts at right angles to it and to each other, all of length 1.
    basis = np.array([[1, 1, 1], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3], [2], [6]])
    for _ in range(N_SITES):  # each turn takes the first axis and puts it last
        cube = np.tensordot(cube, basis, axes=(0, 1))
    order = (np.indices(cube.shape) > 0).sum(axis=0)
    power = np.bincount(order.ravel(), weights=(cube**2).ravel(), minlength=N_SITES + 1)[1:]
    shares: NDArray[np.float64] = power / power.sum()
    return shares


def ruggedness(fitness: NDArray[np.float64]) -> Section:
    """Return correlation, interaction of sites, and fitness by distance from the best.

    Source: T. Jones, S. Forrest, Fitness distance correlation as a measure of problem difficulty
    for genetic algorithms, ICGA 1995.
    """
    best = np.flatnonzero(fitness == fitness.max())
    images = np.flatnonzero(np.isin(symmetry_classes(), symmetry_classes()[best]))
    distance = distance_to(best)
    rho, shares = autocorrelation(fitness), variance_by_order(fitness)
    orders = range(1, N_SITES + 1)
    at = [fitness[distance == k] for k in orders]
    nothing = [None] * N_SITES
    return Section(
        title="Ruggedness",
        note="Column k: the correlation of fitness now and after k steps of a random walk of "
        "mutations; the share of the variance of fitness that k sites acting together explain, "
        "beyond what fewer do; and the mean fitness of the designs k mutations away from the "
        "fittest. The correlation length is the number of steps in which correlation falls by a "
        "factor e. The fitness-distance correlation is Pearson's r of fitness and the mutations "
        "to the fittest design (in brackets, to its nearest turned or mirrored image), -1 where "
        "fitness depends on distance alone.",
        columns=(
            Column("k", "k steps, sites or mutations"),
            Column("correlation", "correlation", ".3f"),
            Column("variance_percent", "variance in %", ".1f"),
            Column("mean_fitness", "mean fitness", ".3f"),
        ),
        rows=list(
            zip(
                orders,
                nothing if rho is None else rho[1:].tolist(),
                nothing if shares is None else (100 * shares).tolist(),
                [float(some.mean()) if len(some) else None for some in at],
                strict=True,
            )
        ),
        facts={
            "correlation_length": None if rho is None else correlation_length(float(rho[1])),
            "fittest": best.tolist(),
            "to_best": _pearson(fitness, distance),
            "to_class": _pearson(fitness, distance_to(images)),
        },
        sentence="correlation length {correlation_length:.2f} steps; fitness-distance correlation "
        "{to_best:.3f} ({to_class:.3f})",
        is_transposed=True,
    )


def neutrality(fitness: NDArray[np.float64], thresholds: tuple[float, ...] = THRESHOLDS) -> Section:
    """Return how many mutations change fitness by at most each threshold, voxel widths.

    Source: C. M. Reidys, P. F. Stadler, Neutrality in fitness landscapes, Applied Mathematics and
    Computation 117, 2001.
    """
    change = np.abs(fitness[neighbours()] - fitness[:, np.newaxis])
    rows = []
    for threshold in thresholds:
        sizes = np.bincount(components(change <= threshold))
        share = float((change <= threshold).mean())
        name = f"at most {threshold:g}" if threshold else "nothing"
        degree, largest, networks = share * N_NEIGHBOURS, int(sizes.max()), int((sizes > 1).sum())
        rows.append((name, threshold, share, degree, largest, networks))
    return Section(
        title="Neutrality",
        note="Mutations that change fitness by nothing or little: their share of all, how many of "
        "its 16 a design has on average, the designs in the largest network that they join, and "
        "how many networks of two designs or more there are.",
        columns=(
            Column("change", "a mutation changes"),
            Column("threshold"),
            Column("share", "share", ".1%"),
            Column("degree", "of 16", ".2f"),
            Column("largest_network", "largest network"),
            Column("networks", "networks"),
        ),
        rows=rows,
    )


def _pearson(fitness: NDArray[np.float64], distance: NDArray[np.int64]) -> float | None:
    """Return the correlation, or None if either does not vary."""
    if not np.ptp(fitness) or not np.ptp(distance):
        return None
    return float(np.corrcoef(fitness, distance)[0, 1])
