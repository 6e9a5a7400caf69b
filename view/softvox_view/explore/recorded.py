"""Searchers' paths that were recorded: the runs in folders that `softvox compare` has written."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import softvox_gym
from softvox_view.explore.landscapes import listed
from softvox_view.explore.requests import BadRequestError

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Row = Mapping[Hashable, Any]


@dataclass(frozen=True)
class Recorded:
    """The finished runs of a folder on the lattice that the map is of.

    Parameters
    ----------
    results : Results
    runs : dict of dict of dict
        Rows of `Results.runs` by searcher, with what it was put to where that differs, and by seed.
    """

    results: Results
    runs: dict[str, dict[int, Row]]

    @classmethod
    def of(cls, results: Results) -> Recorded:
        """Return what of some results can be shown on the map."""
        table = results.runs
        mine = table[(table["status"] == "ok") & (table["shape"] == "2x2x2")]
        has_physics = mine["physics"].nunique() > 1
        runs: dict[str, dict[int, Row]] = {}
        for row in mine.to_dict("records"):
            level = "" if np.isnan(row["level"]) else f"noise {row['level']:g}"
            parts = (row["searcher"], row["physics"] if has_physics else "", level, row["policy"])
            runs.setdefault(" · ".join(filter(None, parts)), {})[row["seed"]] = row
        return cls(results, runs)

    def run(self, searcher: str, seed: int) -> Row:
        """Return the row of a run; BadRequestError where there is none."""
        runs = self.runs.get(searcher)
        if runs is None:
            raise BadRequestError(
                f"there is no searcher {searcher[:60]!r} in these results; they have "
                f"{', '.join(self.runs)}",
                "searcher",
            )
        if seed not in runs:
            raise BadRequestError(
                f"{searcher} has no finished run with the seed {seed}; its {len(runs)} have seeds "
                f"from {min(runs)} to {max(runs)}",
                "seed",
            )
        return runs[seed]

    def path(self, run: Row, most: int) -> dict[str, Any]:
        """Return a run's first evaluations as a path: see `paths.search`; total has all of them.

        Fitness is as the searcher was told; the rank is that in the published landscape.
        """
        log = self.results.evaluations(run["run"])
        recommended, fitness = int(run["recommended"]), softvox_gym.landscape()["fitness"]
        return {
            "designs": log["design"][:most].tolist(),
            "fitness": listed(log["fitness"][:most]),
            "total": len(log["design"]),
            "recommended": recommended,
            "rank": 1 + int((fitness > fitness[recommended]).sum()),
        }
