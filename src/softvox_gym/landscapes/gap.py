"""The reality gap: how rankings and headings change from the simulator to a reality.

All numbers come from the exact landscapes of both. A design that diverged has the value 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.landscapes.robustness import TOP, kendall_tau, ranked
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import N_DESIGNS, Table, displacements, landscape
from softvox_gym.real_tracks import LITTLE
from softvox_gym.realities import Reality, realities
from softvox_gym.tasks import HEADINGS, Task

Array = NDArray[np.float64]

#: Numbers of designs that are taken from the top of the simulator's ranking and tried in reality.
TRIED = (1, 10, TOP)

MEANING = """\
"Here" is the reality. tau: Kendall's rank correlation of the fitness here and in the simulator,
over all designs. SRCC: Pearson's correlation of the two over the simulator's best 100 (Kadian et
al. 2020). kept: how many of these 100 are among the best 100 here. best: the best design here, and
its fitness in voxel widths. regret: what is lost here with the simulator's best design, and with
the best here of its best 10 and of its best 100, as a share of what the best design here is worth.
class: the first of these, if robots that are equal when turned or mirrored count as the same.
directed: the regret if the task is to travel along a heading, mean over four headings. turned:
among designs that travel more than 0.25 voxel widths in both worlds, the share whose heading is off
by more than 90 degrees; of all designs, and of the simulator's best 100. diverged: the number of
designs that diverge here; they are worth 0.
"""

COLUMNS = (
    Column("reality", "reality"),
    Column("tau", "tau", ".2f"),
    Column("srcc", "SRCC", ".2f"),
    Column("kept", "kept"),
    Column("best", "best"),
    Column("best_digits"),
    Column("best_fitness", "fitness", ".2f"),
    Column("regret_1", "regret: 1", ".2f"),
    Column("regret_10", "10", ".2f"),
    Column("regret_100", "100", ".2f"),
    Column("class_regret_1", "class: 1", ".2f"),
    Column("directed_1", "directed: 1", ".2f"),
    Column("directed_10", "10", ".2f"),
    Column("directed_100", "100", ".2f"),
    Column("turned", "turned", ".1%"),
    Column("turned_100", "of 100", ".1%"),
    Column("diverged", "diverged"),
)


def gaps(which: Iterable[Reality] | None = None) -> Section:
    """Return the gap of some realities, or of all named ones, one row each."""
    rows = [row(one) for one in (realities().values() if which is None else which)]
    return Section(
        title="The gap", note=MEANING, columns=COLUMNS, rows=[tuple(one.values()) for one in rows]
    )


def row(reality: Reality) -> dict[str, Any]:
    """Return the gap between a reality and its nominal simulator, by the keys of `COLUMNS`."""
    nominal, real = landscape(reality.nominal), reality.landscape()
    worth, here = value(nominal), value(real)
    top, real_top = ranked(worth)[:TOP].tolist(), ranked(here)[:TOP].tolist()
    tasks = [Task("directed", heading) for heading in HEADINGS]
    directed = [regrets(value(nominal, task), value(real, task)) for task in tasks]
    has_heading = (worth > LITTLE) & (here > LITTLE)
    turns = turned(nominal, real)
    return {
        "reality": reality.name,
        "tau": kendall_tau(worth, here),
        "srcc": srcc(worth, here),
        "kept": len({*top} & {*real_top}),
        "best": real_top[0],
        "best_digits": Design(real_top[0]).digits,
        "best_fitness": float(here[real_top[0]]),
        **{f"regret_{n}": lost for n, lost in zip(TRIED, regrets(worth, here), strict=True)},
        "class_regret_1": regrets(worth, class_best(here))[0],
        **{
            f"directed_{n}": float(mean)
            for n, mean in zip(TRIED, np.mean(directed, axis=0), strict=True)
        },
        "turned": share(turns, has_heading),
        "turned_100": share(turns[top], has_heading[top]),
        "diverged": int(real["diverged"].sum()),
    }


def value(table: Table, task: Task | None = None) -> Array:
    """Return the value of every design in a task, voxel widths; 0 if it diverged."""
    return (task or Task()).reward(displacements(table))


def regrets(nominal: Array, real: Array) -> list[float]:
    """Return the regret of taking the best in reality of the nominal best, for each of `TRIED`.

    It is a share of the best value in reality; 0 if that is 0.
    """
    best, found = real.max(), real[ranked(nominal)]
    return [float(1 - found[:tries].max() / best) if best > 0 else 0.0 for tries in TRIED]


def srcc(nominal: Array, real: Array) -> float:
    """Return Pearson's correlation over the nominal best 100; NaN if one side does not vary.

    Source: A. Kadian et al., "Sim2Real predictivity: does evaluation in simulation predict
    real-world performance?", IEEE RA-L 5(4), 2020.
    """
    top = ranked(nominal)[:TOP]
    return float(pearson(nominal[top], real[top]))


def pearson(first: Array, second: Array) -> Array:
    """Return Pearson's correlation over the last axis; NaN if one side does not vary."""
    a = first - first.mean(axis=-1, keepdims=True)
    b = second - second.mean(axis=-1, keepdims=True)
    varies = (np.ptp(first, axis=-1) > 0) & (np.ptp(second, axis=-1) > 0)
    spread = np.where(varies, np.sqrt((a * a).sum(axis=-1) * (b * b).sum(axis=-1)), np.nan)
    return np.asarray((a * b).sum(axis=-1) / spread)


def turned(nominal: Table, real: Table) -> NDArray[np.bool_]:
    """Return which designs' headings differ by more than 90 degrees, shape (6561,)."""
    along = nominal["dx"] * real["dx"] + nominal["dy"] * real["dy"]
    return np.asarray(along < 0)


def share(these: NDArray[np.bool_], among: NDArray[np.bool_]) -> float:
    """Return the share of `among` that is also in `these`; 0 if there are none."""
    return float(these[among].mean()) if among.any() else 0.0


def class_best(values: Array) -> Array:
    """Return for every design the best value in its class under turns and mirrors.

    A robot that you may turn before its run can follow a heading as well as the best of its class.
    """
    classes = symmetry_classes()
    best = np.full(N_DESIGNS, -np.inf)
    np.maximum.at(best, classes, values)
    return best[classes]
