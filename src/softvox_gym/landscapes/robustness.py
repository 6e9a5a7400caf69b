"""The effect of noise on the landscape: which designs survive it, and how ranks change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym.data import records
from softvox_gym.design import Design
from softvox_gym.landscapes.noisy import LEVELS, noisy_landscape
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import landscape

#: The number of designs that count as the best of a ranking.
TOP = 100

#: Designs of the published top hundred that fall over; the last bit decides to which side.
SENSITIVE = (6453, 4295, 6481, 6507)

#: Of the numbers in `levels`.
MEANING = """\
mean: the mean fitness of the best design under noise, with its standard error (+-), in voxel
widths. tau: Kendall's rank correlation of mean and exact fitness, over all designs and over the 100
fittest without noise. overlap: how many of these 100 are among the 100 with the best mean, and with
the best 10 % quantile (q10), which no single lucky draw can move. retained: mean / exact fitness,
averaged over these 100. diverged: the share of draws that diverged, for the design with most.
"""


def ranked(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the designs, best first; ties by number."""
    return np.argsort(-values, kind="stable")


def kendall_tau(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return Kendall's rank correlation tau-b of two rows of values, shape (n,); NaN without one.

    Source: M. G. Kendall, The treatment of ties in ranking problems, Biometrika 33, 1945.
    """
    ranks = [np.unique(values, return_inverse=True)[1] for values in (first, second)]
    pairs = len(first) * (len(first) - 1) // 2
    tied = [_pairs(rank) for rank in ranks]
    tied_twice = _pairs(ranks[0] * len(first) + ranks[1])
    disagreeing = _inversions(ranks[1][np.lexsort(ranks[::-1])])
    agreeing = pairs - sum(tied) + tied_twice - 2 * disagreeing
    if pairs in tied:  # one of the rows does not vary
        return float("nan")
    return float(agreeing / np.sqrt(pairs - tied[0]) / np.sqrt(pairs - tied[1]))


def _pairs(values: NDArray[np.int64]) -> int:
    """Return the number of pairs of equal values."""
    counts = np.unique(values, return_counts=True)[1]
    return int((counts * (counts - 1) // 2).sum())


def _inversions(row: NDArray[np.int64]) -> int:
    """Return the number of pairs in falling order in a row of whole numbers of at least 0.

    The first bit in which two numbers differ is set in the larger. For each bit, this counts the
    pairs that agree in all higher bits and have it set in the earlier number and not in the later.
    """
    total = 0
    for bit in range(int(row.max(initial=0)).bit_length()):
        order = np.argsort(row >> (bit + 1), kind="stable")
        has = (row[order] >> bit) & 1
        group = row[order] >> (bit + 1)
        before = np.cumsum(has) - has
        starts = np.flatnonzero(np.r_[True, group[1:] != group[:-1]])
        of_group = np.repeat(before[starts], np.diff(np.r_[starts, len(row)]))
        total += int(((before - of_group) * (1 - has)).sum())
    return total


def levels() -> Section:
    """Return how the ranking by mean fitness at each noise level differs from that without."""
    exact = landscape()["fitness"]
    top = ranked(exact)[:TOP]
    rows = []
    for level in LEVELS:
        noisy = noisy_landscape(level)
        mean = noisy["mean"]
        order = ranked(mean)
        best = int(order[0])
        rows.append(
            (
                level,
                best,
                Design(best).digits,
                float(mean[best]),
                float(noisy["std"][best] / np.sqrt(noisy["draws"][best])),
                kendall_tau(exact, mean),
                kendall_tau(exact[top], mean[top]),
                len(np.intersect1d(order[:TOP], top)),
                len(np.intersect1d(ranked(noisy["q10"])[:TOP], top)),
                float((mean[top] / exact[top]).mean()),
                float(noisy["p_diverged"].max()),
            )
        )
    return Section(
        note=MEANING,
        columns=(
            Column("level", "level", "g"),
            Column("best", "best"),
            Column("digits", "digits"),
            Column("mean", "mean", ".3f"),
            Column("standard_error", "+-", ".3f"),
            Column("kendall_tau", "tau", ".2f"),
            Column("kendall_tau_top", "tau 100", ".2f"),
            Column("overlap", "overlap"),
            Column("overlap_q10", "by q10"),
            Column("retained", "retained", ".0%"),
            Column("p_diverged", "diverged", ".1%"),
        ),
        rows=rows,
    )


def published(level: float) -> Section:
    """Return the fate of the published top hundred at a level of `noisy_landscape`."""
    noisy, exact = noisy_landscape(level), landscape()["fitness"]
    rank = np.empty(len(exact), dtype=np.int64)
    rank[ranked(noisy["mean"])] = 1 + np.arange(len(exact))
    rows = []
    for printed in records("published_top100.csv"):
        design = int(printed["design"])
        survives, is_sensitive = bool(rank[design] <= TOP), design in SENSITIVE
        remarks = ["sensitive: falls over"] * is_sensitive + ["out"] * (not survives)
        rows.append(
            (
                int(printed["rank"]),
                design,
                Design(design).digits,
                float(printed["fitness"]),
                *(float(noisy[name][design]) for name in ("mean", "std", "q10", "min")),
                float(noisy["mean"][design] / exact[design]),
                int(rank[design]),
                survives,
                is_sensitive,
                ", ".join(remarks),
            )
        )
    return Section(
        note="rank and fitness as published; mean, standard deviation, 10 % quantile and minimum "
        "under noise; retained, mean / exact fitness; noisy rank, by mean, among all designs; "
        "survives, whether that is among the first 100; sensitive, whether the design falls over, "
        "to a side that rounding decides. Lengths in voxel widths.",
        columns=(
            Column("rank", "rank"),
            Column("design", "design"),
            Column("digits", "digits"),
            Column("fitness", "fitness", ".2f"),
            Column("mean", "mean", ".2f"),
            Column("std", "std", ".2f"),
            Column("q10", "q10", ".2f"),
            Column("min"),
            Column("retained", "retained", ".0%"),
            Column("noisy_rank", "noisy rank"),
            Column("survives"),
            Column("is_sensitive"),
            Column("remark", "remark"),
        ),
        rows=rows,
        facts={"level": level, "survivors": sum(row[10] for row in rows), "published": len(rows)},
        sentence="{survivors} of the published top {published} are among the 100 with the best "
        "mean at level {level:g}.",
    )


def tables() -> dict[str, str]:
    """Return everything as CSV, by file name."""
    made = {"levels.csv": levels().csv()}
    for level in LEVELS[1:]:
        made[f"top100_level_{level:g}.csv"] = published(level).csv()
        made[f"landscape_level_{level:g}.csv"] = noisy_landscape(level).section().csv()
    return made
