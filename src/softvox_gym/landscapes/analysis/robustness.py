"""What one mutation, or one error in fabrication, leaves of a design's fitness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import ABSENT, ACTIVE, PASSIVE
from softvox_gym.landscapes.analysis.graph import (
    all_digits,
    checked_fitness,
    neighbours,
    with_digit,
)


@dataclass(frozen=True)
class AfterError:
    """The fitness of every design after one error of a kind.

    Parameters
    ----------
    mean, worst : ndarray, shape (6561,)
        Over the errors of that kind that can befall the design, voxel widths; NaN where none can.
    """

    mean: NDArray[np.float64]
    worst: NDArray[np.float64]


@dataclass(frozen=True)
class Kept:
    """What a group of designs keeps after one error of a kind.

    Parameters
    ----------
    designs : int
        The designs of the group that such an error can befall.
    own : float or None
        Their mean fitness without error, voxel widths. None, as what follows, where there are no
        such designs.
    mean, worst : float or None
        Mean over them of the fitness after one error: the average over its places, and the worst
        place. Voxel widths.
    mean_share, worst_share : float or None
        mean / own and worst / own, ratios of averages, which tiny fitness does not disturb. None
        where own is not positive. For one mutation and all designs mean_share is 1, because every
        design is as often a neighbour as any other.
    least_share : float or None
        The smallest worst / own of a single design. None where one has a fitness that is not
        positive.
    """

    designs: int
    own: float | None
    mean: float | None
    worst: float | None
    mean_share: float | None
    worst_share: float | None
    least_share: float | None


def after_mutation(fitness: ArrayLike) -> AfterError:
    """Return the mean and the worst fitness over the 16 neighbours of each design.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.
    """
    around = checked_fitness(fitness)[neighbours()]
    return AfterError(mean=around.mean(axis=1), worst=around.min(axis=1))


def after_dead_actuator(fitness: ArrayLike) -> AfterError:
    """Return the same over the designs in which one active voxel stays passive (2 becomes 1).

    Parameters and errors are those of `after_mutation`.
    """
    return _after(fitness, with_digit(PASSIVE), all_digits() == ACTIVE)


def after_missing_voxel(fitness: ArrayLike) -> AfterError:
    """Return the same over the designs in which one voxel is missing (1 or 2 becomes 0).

    Parameters and errors are those of `after_mutation`.
    """
    return _after(fitness, with_digit(ABSENT), all_digits() != ABSENT)


def kept(fitness: ArrayLike, after: AfterError, designs: NDArray[np.int64]) -> Kept:
    """Return what a group of designs keeps on average.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.
    after : AfterError
    designs : ndarray of int
        The group's numbers.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.
    """
    values = checked_fitness(fitness)
    group = designs[~np.isnan(after.mean[designs])]
    if not len(group):
        return Kept(0, None, None, None, None, None, None)
    own, mean, worst = (float(some[group].mean()) for some in (values, after.mean, after.worst))
    positive = bool((values[group] > 0).all())
    return Kept(
        designs=len(group),
        own=own,
        mean=mean,
        worst=worst,
        mean_share=mean / own if own > 0 else None,
        worst_share=worst / own if own > 0 else None,
        least_share=float((after.worst[group] / values[group]).min()) if positive else None,
    )


def _after(
    fitness: ArrayLike, changed: NDArray[np.int64], possible: NDArray[np.bool_]
) -> AfterError:
    """Return mean and worst over the sites at which an error is possible."""
    values = checked_fitness(fitness)[changed]
    count = possible.sum(axis=1)
    total = np.where(possible, values, 0.0).sum(axis=1)
    worst = np.where(possible, values, np.inf).min(axis=1)
    mean = np.full(len(values), np.nan)
    np.divide(total, count, out=mean, where=count > 0)
    return AfterError(mean=mean, worst=np.where(count > 0, worst, np.nan))
