"""One number for several values of one design."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Aggregate = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over the last axis."""
    return np.asarray(values.mean(axis=-1))


def least(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the smallest over the last axis."""
    return np.asarray(values.min(axis=-1))


def q10(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the 10 % quantile over the last axis, between values interpolated linearly."""
    return np.asarray(np.quantile(values, 0.1, axis=-1))


def cvar25(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean of the worst quarter over the last axis; a value may count in part.

    Source: R. T. Rockafellar, S. Uryasev, "Optimization of conditional value-at-risk", 2000.
    """
    ordered = np.sort(values, axis=-1)
    quarter = values.shape[-1] / 4
    weights = np.clip(quarter - np.arange(values.shape[-1]), 0.0, 1.0)
    return np.asarray((ordered * weights).sum(axis=-1) / quarter)


#: By the names that `Resample` takes.
AGGREGATES: dict[str, Aggregate] = {"mean": mean, "min": least, "q10": q10, "cvar25": cvar25}


def aggregate_of(name: str) -> Aggregate:
    """Return an aggregate by its name.

    Raises
    ------
    ValueError
        For an unknown name.
    """
    if name not in AGGREGATES:
        raise ValueError(
            f"aggregate {name!r} is unknown; the aggregates are {', '.join(AGGREGATES)}"
        )
    return AGGREGATES[name]


def standard_error(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard error of the mean over the last axis; NaN of a single value."""
    n = values.shape[-1]
    if n == 1:
        return np.full(values.shape[:-1], np.nan)
    return np.asarray(values.std(axis=-1, ddof=1) / np.sqrt(n))
