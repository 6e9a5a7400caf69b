"""The tables of an analysis that have a row per design, optimum or class, as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence

from softvox_gym.design import ABSENT, ACTIVE, N_DESIGNS, Design
from softvox_gym.landscapes.analysis.graph import all_digits
from softvox_gym.landscapes.analysis.groups import n_pieces
from softvox_gym.landscapes.analysis.summary import Analysis
from softvox_gym.landscapes.analysis.symmetry import members, symmetry_classes

#: The files: a row per local optimum, per design and per symmetry class.
NAMES = ("local_optima.csv", "neighbours.csv", "classes.csv")

OPTIMA = ("design", "digits", "fitness", "plateau", "steepest_basin", "random_basin")
NEIGHBOURS = (
    "design",
    "digits",
    "fitness",
    "mutation_mean",
    "mutation_worst",
    "dead_actuator_mean",
    "dead_actuator_worst",
    "missing_voxel_mean",
    "missing_voxel_worst",
)
CLASSES = (
    "class",
    "digits",
    "size",
    "n_voxels",
    "n_active",
    "is_connected",
    "fittest",
    "best",
    "mean",
    "worst",
    "spread",
)

Row = Sequence[object]


def tables(analysis: Analysis) -> dict[str, str]:
    """Return the tables by file name; floats are written so that they read back to the same bits.

    Returns
    -------
    dict of str to str
        local_optima.csv, the fittest first: the smallest design of the plateau, the designs on it,
        and how many starts end there under steepest and (expected) random ascent.
        neighbours.csv, design by design: mean and worst fitness after one error of each kind, nan
        where none is possible. classes.csv, by the smallest design of each class under turns and
        reflections: its members' number, fittest, and best, mean, worst and spread of fitness.
    """
    texts = (
        _csv(OPTIMA, _optima(analysis)),
        _csv(NEIGHBOURS, _neighbours(analysis)),
        _csv(CLASSES, _classes(analysis)),
    )
    return dict(zip(NAMES, texts, strict=True))


def _csv(header: Row, rows: Iterable[Row]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def _optima(analysis: Analysis) -> Iterator[Row]:
    optima = analysis.optima
    # A steepest ascent ends in one place, so these sums of probabilities are whole numbers.
    steepest = optima.basins(optima.steepest).astype(int).tolist()
    random = optima.basins(optima.random).tolist()
    plateau, fitness = optima.plateau.tolist(), optima.fitness.tolist()
    for row, number in enumerate(optima.design.tolist()):
        digits = Design(number).digits
        yield number, digits, fitness[row], plateau[row], steepest[row], random[row]


def _neighbours(analysis: Analysis) -> Iterator[Row]:
    after = analysis.after
    kinds = (after["mutation"], after["dead_actuator"], after["missing_voxel"])
    columns = [values.tolist() for kind in kinds for values in (kind.mean, kind.worst)]
    for number, fitness, *errors in zip(
        range(N_DESIGNS), analysis.fitness.tolist(), *columns, strict=True
    ):
        yield number, Design(number).digits, fitness, *errors


def _classes(analysis: Analysis) -> Iterator[Row]:
    for group in members(symmetry_classes()):
        values = analysis.fitness[group]
        digits = all_digits()[group[0]]
        yield (
            int(group[0]),
            Design(int(group[0])).digits,
            len(group),
            int((digits != ABSENT).sum()),
            int((digits == ACTIVE).sum()),
            bool(n_pieces()[group[0]] == 1),
            int(group[values.argmax()]),
            float(values.max()),
            float(values.mean()),
            float(values.min()),
            float(values.max() - values.min()),
        )
