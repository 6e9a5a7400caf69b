"""The statistics of the report, each a few lines with its source."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

Array = NDArray[np.float64]

#: Reduces the last axis, the runs, to a number.
Statistic = Callable[[Array], Array]

RESAMPLES = 2000
TAILS = ((1 - 0.95) / 2, 1 - (1 - 0.95) / 2)  # of a band of 95 %

#: A fixed seed for every band, so that a band does not depend on which others a report has.
SEED = 2021


def iqm(values: ArrayLike) -> Array:
    """Return the interquartile mean over the last axis: the mean of the middle half of the runs.

    The floor(n / 4) lowest and as many of the highest of n runs are left out.

    Notes
    -----
    Source: R. Agarwal et al., Deep reinforcement learning at the edge of the statistical
    precipice, NeurIPS 2021: more robust than the mean, more efficient than the median.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=-1)
    n = ordered.shape[-1]
    cut = n // 4
    return np.asarray(ordered[..., cut : n - cut].mean(axis=-1))


def mean(values: ArrayLike) -> Array:
    """Return the mean over the last axis."""
    return np.asarray(np.mean(np.asarray(values, dtype=np.float64), axis=-1))


def resampled(strata: ArrayLike) -> NDArray[np.intp] | None:
    """Draw runs with replacement, as many from each stratum as it has, with a fixed seed.

    The strata of n runs have shape (n,). Returns the positions of the drawn runs, shape
    (RESAMPLES, n), or None if no stratum has two runs.
    """
    labels, rng = np.asarray(strata), np.random.default_rng(SEED)
    names = np.unique(labels)
    if len(names) == len(labels):
        return None
    drawn = []
    for name in names:
        members = np.flatnonzero(labels == name)
        drawn.append(members[rng.integers(len(members), size=(RESAMPLES, len(members)))])
    return np.concatenate(drawn, axis=1)


def band(
    values: ArrayLike, *, statistic: Statistic = iqm, strata: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Return the percentile band of a statistic by the stratified bootstrap over runs.

    Whole runs are drawn, so all columns of a resample have the same runs. A stratum is what the
    design of the experiment fixes and does not sample: where runs of several searchers are pooled,
    each searcher's runs are resampled separately. One stratum makes it the ordinary bootstrap.

    Parameters
    ----------
    values : ndarray, shape (n,) or (n, m)
        Values of n runs, at m places.
    statistic : callable
        Reduces the last axis.
    strata : array_like, shape (n,), optional
        By default all runs are one stratum.

    Returns
    -------
    low, high : ndarray, shape () or (m,)
        NaN if no stratum has two runs, as their spread is unknown.

    Notes
    -----
    Source: Agarwal et al., NeurIPS 2021, where the strata are the tasks of a suite.
    """
    table = np.asarray(values, dtype=np.float64)
    columns = table[:, np.newaxis] if table.ndim == 1 else table
    drawn = resampled(np.zeros(len(table)) if strata is None else strata)
    if drawn is None:
        return np.full(table.shape[1:], np.nan), np.full(table.shape[1:], np.nan)
    made = np.stack([statistic(column[drawn]) for column in columns.T], axis=-1)
    low, high = np.quantile(made, TAILS, axis=0)
    return low.reshape(table.shape[1:]), high.reshape(table.shape[1:])


def expected_running_time(used: ArrayLike, succeeded: ArrayLike) -> Array:
    """Return the evaluations of all runs together per run that reached the target.

    It estimates how many evaluations a target takes if a run that ends without reaching it is
    followed by another; infinite if no run reached it. Both arguments have shape (..., n): for n
    runs, the evaluations until they reached the target, or all they used; and whether they did.

    Notes
    -----
    Source: A. Auger, N. Hansen, Performance evaluation of an advanced local search evolutionary
    algorithm, CEC 2005.
    """
    total = np.asarray(used, dtype=np.float64).sum(axis=-1)
    successes = np.asarray(succeeded, dtype=np.float64).sum(axis=-1)
    never = np.full(np.shape(total), np.inf)
    return np.asarray(np.divide(total, successes, out=never, where=successes > 0))


def running_time_band(
    used: ArrayLike, succeeded: ArrayLike, *, strata: ArrayLike
) -> tuple[float, float]:
    """Return the band of `expected_running_time` by the bootstrap of `band`."""
    drawn = resampled(strata)
    if drawn is None:
        return np.nan, np.nan
    made = expected_running_time(np.asarray(used)[drawn], np.asarray(succeeded)[drawn])
    # No interpolation, as there is nothing between a number and infinity.
    low, high = np.quantile(made, TAILS, method="inverted_cdf")
    return float(low), float(high)


class Comparison(NamedTuple):
    """Two samples compared: U of the first, its two-sided p, and A12, which is U per pair."""

    u: float
    p: float
    a12: float


def compare(first: ArrayLike, second: ArrayLike) -> Comparison:
    """Compare two independent samples by rank.

    U is the number of pairs in which the first is larger, ties counted half. A12 is the probability
    of that: 0.5 is no difference, 1 means that the first is always larger. p is exact for small
    samples without ties; otherwise it is the normal approximation, corrected for ties.

    Notes
    -----
    Source: H. B. Mann, D. R. Whitney, Annals of Mathematical Statistics 18, 1947; A. Vargha, H. D.
    Delaney, Journal of Educational and Behavioral Statistics 25(2), 2000.
    """
    a = np.asarray(first, dtype=np.float64)
    b = np.asarray(second, dtype=np.float64)
    pairs = len(a) * len(b)
    if np.ptp(np.concatenate([a, b])) == 0:
        return Comparison(pairs / 2, 1.0, 0.5)  # all tied: the approximation has no variance
    found = stats.mannwhitneyu(a, b, alternative="two-sided")
    return Comparison(float(found.statistic), float(found.pvalue), float(found.statistic) / pairs)


def holm(p: ArrayLike) -> Array:
    """Return p-values adjusted for a whole family of hypotheses by Holm's step-down.

    With m hypotheses the i-th smallest p is multiplied by m - i + 1. No adjusted value is below
    that of a smaller p, nor above 1.

    Notes
    -----
    Source: S. Holm, A simple sequentially rejective multiple test procedure, Scandinavian Journal
    of Statistics 6(2), 1979.
    """
    values = np.asarray(p, dtype=np.float64)
    order = np.argsort(values, kind="stable")
    stepped = np.maximum.accumulate(values[order] * np.arange(len(values), 0, -1))
    adjusted = np.empty_like(values)
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted
