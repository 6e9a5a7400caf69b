"""Where curves are sampled, and the targets that the distribution of runtimes counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_search.report.truth import TERMS, exact_fitness, optimum

#: Unique evaluations at which searchers are compared.
FIXED_BUDGETS = (50, 100, 200, 500, 1000, 6561)

#: Shares of the best fitness that count as targets.
FIXED_TARGETS = (0.95, 0.99, 1.0)

POSITIONS = 60
TARGETS = 51
FINEST_TARGET = 0.01  # voxel widths; the second best design, 0.0115 below the best, misses it


def positions(length: int) -> NDArray[np.int64]:
    """Return about 60 numbers of evaluations, 1 ... length, evenly spread on a log axis."""
    return np.unique(np.rint(np.geomspace(1, max(length, 1), POSITIONS))).astype(np.int64)


def budgets(length: int) -> list[int]:
    """Return the fixed budgets within a length, and the length itself."""
    return sorted({budget for budget in FIXED_BUDGETS if budget <= length} | {length})


def targets() -> NDArray[np.float64]:
    """Return 51 regrets, log-spaced from the whole optimum down to 0.01 voxel widths.

    The easiest is met by a robot that stands still, the hardest by the optimum alone.
    """
    return np.geomspace(optimum(), FINEST_TARGET, TARGETS)


def hard_targets(most: int) -> int:
    """Return how many of the targets are met by no more than so many designs, in either terms."""
    counts = [
        np.sum(optimum() - exact_fitness(terms)[:, np.newaxis] <= targets(), axis=0)
        for terms in TERMS
    ]
    return int(np.sum(np.max(counts, axis=0) <= most))


def ecdf(regret: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of all pairs of a run and a target that are reached so far.

    Parameters
    ----------
    regret : ndarray, shape (n, m)
        Of n runs after m numbers of evaluations.

    Returns
    -------
    ndarray, shape (m,)
        The empirical cumulative distribution of the runtimes over runs and targets, in which a
        target never reached has an infinite runtime.

    Notes
    -----
    Source: N. Hansen et al., COCO: a platform for comparing continuous optimizers in a black-box
    setting, Optimization Methods and Software 36(1), 2021. There runtimes of restarts are drawn
    from the runs where a target was missed; here nothing is added to a run that has ended.
    """
    goals = targets()[::-1]
    reached = TARGETS - np.searchsorted(goals, regret, side="left")
    return np.asarray(reached.mean(axis=0) / TARGETS)
