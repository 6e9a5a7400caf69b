"""Two objectives at once: what dominates what, by DEAP's fast sorting."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from deap import base, tools

from softvox_search.variation import Individual


class Objectives(base.Fitness):  # type: ignore[misc]  # DEAP has no type hints
    """A value to be maximised, and something to be minimised: (value, cost)."""

    weights = (1.0, -1.0)

    def __deepcopy__(self, memo: dict[int, Any]) -> Objectives:
        """Copy the crowding distance too, which DEAP's own copy forgets: a resumed run needs it."""
        copy = type(self)()
        copy.__dict__.update(self.__dict__)
        return copy


def fronts(population: Sequence[Individual], k: int) -> list[list[Individual]]:
    """Return the non-dominated fronts of individuals with a `fitness`, best first.

    Parameters
    ----------
    population : sequence of Individual
    k : int
        As many fronts as it takes to hold k individuals; the last is whole.

    Notes
    -----
    DEAP's generalisation of the sorting of Jensen, *Reducing the run-time complexity of
    multiobjective EAs*, 2003: for a hundred individuals ten times as fast as comparing all pairs.
    """
    sorted_fronts: list[list[Individual]] = tools.sortLogNondominated(list(population), k)
    return sorted_fronts
