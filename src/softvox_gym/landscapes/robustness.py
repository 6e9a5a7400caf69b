"""What noise does to the landscape: who survives it, and how the ranking moves."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kendalltau

from softvox_gym import Design, landscape, noisy_landscape
from softvox_gym.landscapes.noisy import LEVELS

#: How many count as the best of a ranking.
TOP = 100

#: Designs of the published top hundred that fall over, to a side that the last bit decides.
SENSITIVE = (6453, 4295, 6481, 6507)


@dataclass(frozen=True)
class Level:
    """How the ranking by mean fitness at one level of noise differs from that without.

    Parameters
    ----------
    level : float
        Of `JakobiNoise`.
    best : int
        The design with the best mean.
    mean, standard_error : float
        Of the best, voxel widths.
    kendall_tau : float
        Kendall's tau-b between mean and exact fitness, over all designs.
    kendall_tau_top : float
        The same over the 100 that are fittest without noise.
    overlap : int
        How many of those are among the 100 with the best mean.
    overlap_q10 : int
        How many of those are among the 100 with the best 10 % quantile, which no single lucky draw
        can move.
    retained : float
        Mean over those of mean / exact fitness.
    p_diverged : float
        The largest share of draws that diverged, of any design.
    """

    level: float
    best: int
    mean: float
    standard_error: float
    kendall_tau: float
    kendall_tau_top: float
    overlap: int
    overlap_q10: int
    retained: float
    p_diverged: float


@dataclass(frozen=True)
class Published:
    """What becomes of a design of the published top hundred at one level of noise.

    Parameters
    ----------
    rank, design, digits, fitness
        As published; fitness in voxel widths.
    mean, std, q10, min : float
        Under noise, voxel widths.
    retained : float
        Mean / exact fitness.
    noisy_rank : int
        By mean, among all designs.
    survives : bool
        Whether that is among the first 100.
    is_sensitive : bool
        Whether the design falls over, to a side that rounding decides.
    """

    rank: int
    design: int
    digits: str
    fitness: float
    mean: float
    std: float
    q10: float
    min: float
    retained: float
    noisy_rank: int
    survives: bool
    is_sensitive: bool


def ranked(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the designs, best first; equal ones by number."""
    return np.argsort(-values, kind="stable")


def levels() -> list[Level]:
    """Return a summary of every level that the noisy landscape has."""
    exact = landscape()["fitness"]
    top = ranked(exact)[:TOP]
    return [_level(level, noisy_landscape(level), exact, top) for level in LEVELS]


def _level(
    level: float, noisy: NDArray[np.void], exact: NDArray[np.float64], top: NDArray[np.intp]
) -> Level:
    mean = noisy["mean"]
    order = ranked(mean)
    best = int(order[0])
    return Level(
        level=level,
        best=best,
        mean=float(mean[best]),
        standard_error=float(noisy["std"][best] / np.sqrt(noisy["draws"][best])),
        kendall_tau=float(kendalltau(exact, mean).statistic),
        kendall_tau_top=float(kendalltau(exact[top], mean[top]).statistic),
        overlap=len(np.intersect1d(order[:TOP], top)),
        overlap_q10=len(np.intersect1d(ranked(noisy["q10"])[:TOP], top)),
        retained=float((mean[top] / exact[top]).mean()),
        p_diverged=float(noisy["p_diverged"].max()),
    )


def published(level: float) -> list[Published]:
    """Return what becomes of the published top hundred at a level of noise.

    Raises
    ------
    ValueError
        For a level that the noisy landscape does not have.
    """
    noisy, exact = noisy_landscape(level), landscape()["fitness"]
    rank = np.empty(len(exact), dtype=np.int64)
    rank[ranked(noisy["mean"])] = 1 + np.arange(len(exact))
    return [
        Published(
            rank=place,
            design=design,
            digits=Design(design).digits,
            fitness=fitness,
            **{name: float(noisy[name][design]) for name in ("mean", "std", "q10", "min")},
            retained=float(noisy["mean"][design] / exact[design]),
            noisy_rank=int(rank[design]),
            survives=bool(rank[design] <= TOP),
            is_sensitive=design in SENSITIVE,
        )
        for place, design, fitness in _published_table()
    ]


@lru_cache(maxsize=1)
def _published_table() -> list[tuple[int, int, float]]:
    path = files("softvox_gym") / "data" / "authors" / "published_top100.csv"
    with path.open(encoding="utf-8") as file:
        rows = csv.DictReader(file)
        return [(int(row["rank"]), int(row["design"]), float(row["fitness"])) for row in rows]


def tables() -> dict[str, str]:
    """Return everything as CSV, by file name."""
    made = {"levels.csv": as_csv(asdict(row) for row in levels())}
    for level in LEVELS[1:]:
        made[f"top100_level_{level:g}.csv"] = as_csv(asdict(row) for row in published(level))
        made[f"landscape_level_{level:g}.csv"] = as_csv(_rows(noisy_landscape(level)))
    return made


def _rows(table: NDArray[np.void]) -> Iterable[dict[str, Any]]:
    names = table.dtype.names or ()
    return (dict(zip(names, row, strict=True)) for row in table.tolist())


def as_csv(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows with the same keys as CSV; numbers read back to the same bits."""
    text = io.StringIO()
    writer: csv.DictWriter[str] | None = None
    for row in rows:
        if writer is None:
            writer = csv.DictWriter(text, list(row), lineterminator="\n")
            writer.writeheader()
        writer.writerow(row)
    return text.getvalue()
