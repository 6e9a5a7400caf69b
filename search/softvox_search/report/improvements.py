"""When a run came upon something better: all that the report needs of its log."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_search.report.truth import TERMS, exact_fitness


def improvements(columns: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return one row for every evaluation of a design that is better than all before it.

    Better in truth, not by what the searcher was told: the noise-free fitness of the landscape
    counts. So under noise a row says that the searcher came past a better design, not that it
    knew.

    Parameters
    ----------
    columns : dict of ndarray
        The log of one run; sequence, unique_sequence and design are read.

    Returns
    -------
    dict of ndarray
        In equal lengths, first all rows in raw terms, then those in class terms:

        =============== =================================================================
        terms           "raw": the design's own fitness; "class": the best fitness among
                        all designs that are the same robot turned or mirrored
        sequence        number of the evaluation, from 1
        unique_sequence how many evaluations until then were not answered from the cache
        design          its number
        fitness         in these terms, voxel widths; grows from row to row
        =============== =================================================================

        The first evaluation is always a row.
    """
    parts = [_improvements(columns, terms) for terms in TERMS]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _improvements(columns: Mapping[str, NDArray[Any]], terms: str) -> dict[str, NDArray[Any]]:
    fitness = exact_fitness(terms)[columns["design"].astype(np.intp)]
    best = np.maximum.accumulate(fitness)
    before = np.concatenate([[-np.inf], best])[: len(best)]
    rows = np.flatnonzero(fitness > before)
    return {
        "terms": np.full(len(rows), terms, dtype="<U5"),
        **{name: columns[name][rows] for name in ("sequence", "unique_sequence", "design")},
        "fitness": fitness[rows],
    }
