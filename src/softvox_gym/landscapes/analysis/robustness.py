"""The fitness that is left after one mutation, or one fabrication error."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, ACTIVE, PASSIVE, Design
from softvox_gym.landscapes.analysis.graph import all_digits, neighbours, with_digit
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import N_DESIGNS

#: Sizes of the groups of fittest designs that are tested for one error.
RANKS = (1, 10, 100, N_DESIGNS)


class AfterError(NamedTuple):
    """The fitness of every design after one error of a kind, shape (6561,), voxel widths.

    Over the errors of that kind that are possible in the design; NaN if none is.
    """

    mean: NDArray[np.float64]
    worst: NDArray[np.float64]


def after_error(fitness: NDArray[np.float64]) -> dict[str, AfterError]:
    """Return the fitness after one error, by the error's kind, fitness of shape (6561,).

    The kinds are "mutation", of any site; "dead_actuator", an active voxel that stays passive (2
    becomes 1); and "missing_voxel" (1 or 2 becomes 0).
    """
    around, digits = neighbours(), all_digits()
    return {
        "mutation": _after(fitness[around], np.full(around.shape, True)),
        "dead_actuator": _after(fitness[with_digit(PASSIVE)], digits == ACTIVE),
        "missing_voxel": _after(fitness[with_digit(ABSENT)], digits != ABSENT),
    }


def _after(fitness: NDArray[np.float64], possible: NDArray[np.bool_]) -> AfterError:
    """Return mean and worst over the places (axis 1) at which an error is possible."""
    count = possible.sum(axis=1)
    mean = np.full(len(fitness), np.nan)
    np.divide(np.where(possible, fitness, 0.0).sum(axis=1), count, out=mean, where=count > 0)
    worst = np.where(possible, fitness, np.inf).min(axis=1)
    return AfterError(mean, np.where(count > 0, worst, np.nan))


def robustness(fitness: NDArray[np.float64], after: dict[str, AfterError]) -> Section:
    """Return the fitness that groups of the fittest designs keep after one error of each kind."""
    order = np.argsort(-fitness, kind="stable")
    names = {1: "the fittest", N_DESIGNS: "all designs"}
    rows = []
    for rank in RANKS:
        group = order[:rank]
        kept = [number for kind in after.values() for number in _kept(fitness, kind, group)]
        name = names.get(rank, f"the fittest {rank}")
        rows.append((name, rank, float(fitness[group].mean()), *kept))
    mutation = after["mutation"]
    return Section(
        title="Robustness to one error",
        note="What is left of fitness, on average over the places where the error can happen and "
        "at the worst place: after one mutation, after an active voxel that stays passive (a dead "
        "actuator), and after a missing voxel. Averages over the group, as shares of its own. "
        "For all designs a mutation leaves 100 % on average by construction: every design is as "
        "often a neighbour as any other. The file neighbours.csv has every design.",
        columns=(
            Column("group", "what one error leaves"),
            Column("fittest"),
            Column("fitness", "fitness", ".4f"),
            *(
                column
                for kind, title in zip(after, ("mutation", "dead", "missing"), strict=True)
                for column in (
                    Column(f"{kind}_designs"),
                    Column(f"{kind}_mean_share", title, ".1%"),
                    Column(f"{kind}_worst_share", "worst", ".1%"),
                )
            ),
        ),
        rows=rows,
        facts={
            "by_worst": int(mutation.worst.argmax()),
            "worst": float(mutation.worst.max()),
            "by_mean": int(mutation.mean.argmax()),
            "mean": float(mutation.mean.max()),
        },
        sentence="most is left of {by_worst} after its worst mutation ({worst:.4f}), of {by_mean} "
        "on average ({mean:.4f})",
    )


def _kept(
    fitness: NDArray[np.float64], after: AfterError, group: NDArray[np.int64]
) -> tuple[int, float | None, float | None]:
    """Return how many designs of a group can have the error, and their kept share of fitness.

    The shares, on average and at the worst place, are ratios of averages, which are robust to tiny
    fitness. None if the fitness of these designs is not positive, or there are none.
    """
    group = group[~np.isnan(after.mean[group])]
    own = float(fitness[group].mean()) if len(group) else 0.0
    if own <= 0:
        return len(group), None, None
    mean, worst = (float(values[group].mean()) / own for values in after)
    return len(group), mean, worst


def every_design(fitness: NDArray[np.float64], after: dict[str, AfterError]) -> Section:
    """Return the table of each design's fitness after one error, for programs."""
    columns = {
        "design": range(N_DESIGNS),
        "digits": [Design(number).digits for number in range(N_DESIGNS)],
        "fitness": fitness.tolist(),
        **{
            f"{kind}_{name}": values.tolist()
            for kind, found in after.items()
            for name, values in found._asdict().items()
        },
    }
    return Section(
        columns=tuple(map(Column, columns)),
        rows=list(zip(*columns.values(), strict=True)),
        file="neighbours.csv",
        screen=0,
        document=0,
    )
