"""The finished runs of an experiment, sorted into cells: searcher by level by policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_search.report.frames import groups
from softvox_search.report.results import Results
from softvox_search.report.truth import TERMS, optimum

Array = NDArray[np.float64]


class Improvements(NamedTuple):
    """When a run's best value improved, in order.

    at : ndarray of int64, shape (k,)
        Unique evaluations until then.
    fitness : ndarray, shape (k,)
        Voxel widths.
    """

    at: NDArray[np.int64]
    fitness: Array


@dataclass(frozen=True, eq=False)
class Cell:
    """The finished runs of one searcher at one level of noise under one policy.

    Attributes
    ----------
    searcher, level, policy
        Which; the level is NaN where the experiment has no such axis.
    limit : int
        The unique evaluations that the budget allows each run.
    run, unique, recommended : ndarray of int64, shape (n,)
    believed : ndarray, shape (n,)
    improvements : dict of tuple of Improvements
        By terms, for each run.
    """

    searcher: str
    level: float
    policy: str
    limit: int
    run: NDArray[np.int64]
    unique: NDArray[np.int64]
    recommended: NDArray[np.int64]
    believed: Array
    improvements: Mapping[str, tuple[Improvements, ...]]

    def best(self, terms: str, positions: NDArray[np.int64]) -> Array:
        """Return the best value of every run after so many unique evaluations.

        A run that has ended keeps its value; one that has not begun has none, which counts as 0,
        what standing still is worth.

        Returns
        -------
        ndarray, shape (n, len(positions))
            Voxel widths.
        """
        rows = [
            np.concatenate([[0.0], run.fitness])[np.searchsorted(run.at, positions, side="right")]
            for run in self.improvements[terms]
        ]
        return np.array(rows, dtype=np.float64).reshape(len(self.run), len(positions))

    def regret(self, terms: str, positions: NDArray[np.int64]) -> Array:
        """Return how far every run's best value is below the optimum, shape as `best`."""
        return optimum() - self.best(terms, positions)

    def hit(self, terms: str, target: float) -> Array:
        """Return the unique evaluations until every run reached a value; infinite where never.

        Returns
        -------
        ndarray, shape (n,)
        """
        first = []
        for run in self.improvements[terms]:
            reached = np.flatnonzero(run.fitness >= target)
            first.append(float(run.at[reached[0]]) if len(reached) else np.inf)
        return np.array(first, dtype=np.float64)


def cells_of(results: Results) -> list[Cell]:
    """Return the cells of an experiment that have finished runs.

    Sorted by level, then in the order in which policies and searchers first appear.
    """
    runs = results.runs[results.runs["status"] == "ok"]
    improvements = _improvements(results)
    policies, searchers = (list(dict.fromkeys(runs[name])) for name in ("policy", "searcher"))
    cells = []
    for (level, policy, searcher), group in groups(runs, "level", "policy", "searcher"):
        group = group.sort_values("run", kind="stable")
        numbers = group["run"].to_numpy(np.int64)
        unique = group["unique"].to_numpy(np.int64)
        cells.append(
            Cell(
                searcher=searcher,
                level=float(level),
                policy=policy,
                limit=_limit(results.budget, searcher, unique),
                run=numbers,
                unique=unique,
                recommended=group["recommended"].to_numpy(np.int64),
                believed=group["believed"].to_numpy(np.float64),
                improvements={
                    terms: tuple(improvements.get((run, terms), _NONE) for run in numbers)
                    for terms in TERMS
                },
            )
        )
    return sorted(
        cells,
        key=lambda cell: (
            -1.0 if np.isnan(cell.level) else cell.level,
            policies.index(cell.policy),
            searchers.index(cell.searcher),
        ),
    )


_NONE = Improvements(np.zeros(0, dtype=np.int64), np.zeros(0))


def _improvements(results: Results) -> dict[tuple[int, str], Improvements]:
    """Return when each run's best value improved, by run and terms."""
    frame = results.improvements.sort_values(["run", "terms", "sequence"], kind="stable")
    return {
        (int(run), str(terms)): Improvements(
            group["unique_sequence"].to_numpy(np.int64), group["fitness"].to_numpy(np.float64)
        )
        for (run, terms), group in groups(frame, "run", "terms")
    }


def _limit(budget: Mapping[str, Any], searcher: str, unique: NDArray[np.int64]) -> int:
    """Return the unique evaluations that a searcher's budget allows; what was used, if unstated."""
    own = {**budget, **budget.get("searchers", {}).get(searcher, {})}
    stated = [own[name] for name in ("unique", "evaluations") if own.get(name) is not None]
    return int(min(stated)) if stated else int(unique.max())


@dataclass(frozen=True, eq=False)
class Section:
    """The cells that share a level of noise and a policy, so that searchers can be compared."""

    level: float
    policy: str
    cells: tuple[Cell, ...]

    @property
    def length(self) -> int:
        """The most unique evaluations that any run used."""
        return max(int(cell.unique.max()) for cell in self.cells)


def sections_of(cells: list[Cell]) -> list[Section]:
    """Return a section per level, of the policy that the experiment names first."""
    sections = []
    for level in dict.fromkeys(_key(cell.level) for cell in cells):
        here = [cell for cell in cells if _key(cell.level) == level]
        policy = here[0].policy
        chosen = tuple(cell for cell in here if cell.policy == policy)
        sections.append(Section(here[0].level, policy, chosen))
    return sections


def _key(level: float) -> float | None:
    return None if np.isnan(level) else level
