"""Searchers' paths over the map: a live run on the exact table, or one that was recorded."""

from __future__ import annotations

import threading
from collections.abc import Hashable, Mapping
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

import softvox_gym
from softvox_gym.engine import Progress
from softvox_gym.missing import missing
from softvox_gym.physics import ParameterError
from softvox_view.explore.landscapes import listed

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

#: Rows of `Results.runs` by what the page calls the searcher, and by seed.
Runs = dict[str, dict[int, Mapping[Hashable, Any]]]

#: Searchers of other libraries draw from the global random state, which is one for all threads.
_one_at_a_time = threading.Lock()


def searchers() -> list[str]:
    """Return the names of the searchers; none where their package is missing."""
    if find_spec("softvox_search") is None:
        return []
    from softvox_search.registry import SEARCHERS

    return list(SEARCHERS)


def search(name: str, *, seed: int, budget: int, progress: Progress) -> dict[str, Any]:
    """Let a searcher of the registry search, and return its path ready for JSON.

    Returns
    -------
    dict
        designs, fitness : what was evaluated, in order, repetitions included; recommended : the
        design that it recommends; rank : of that one among all.

    Raises
    ------
    ParameterError
        For an unknown searcher; one's own would be code. Others as `single.search` does.
    """
    if name not in searchers():
        known = ", ".join(searchers())
        raise ParameterError("searcher", f"{name[:60]!r} is unknown; the searchers are {known}")
    from softvox_search import single
    from softvox_search.oracle import Budget

    try:
        with _one_at_a_time:
            facts, log = single.search(
                name, budget=Budget(unique=budget), seed=seed, progress=progress
            )
    except ImportError as error:
        raise RuntimeError(missing(f"searcher {name}", error)) from error
    return _path(log, facts["design"])


def _path(log: Mapping[str, Any], recommended: int) -> dict[str, Any]:
    published = softvox_gym.landscape()["fitness"]
    return {
        "designs": log["design"].tolist(),
        "fitness": listed(log["fitness"]),
        "recommended": recommended,
        "rank": 1 + int((published > published[recommended]).sum()),
    }


def runs_of(results: Results) -> Runs:
    """Return the finished runs of a folder on the lattice that the map is of.

    They are called by their searcher, with what it was put to where that differs.
    """
    table = results.runs
    mine = table[(table["status"] == "ok") & (table["shape"] == "2x2x2")]
    has_physics = mine["physics"].nunique() > 1
    runs: Runs = {}
    for row in mine.to_dict("records"):
        level = "" if np.isnan(row["level"]) else f"noise {row['level']:g}"
        parts = (row["searcher"], row["physics"] if has_physics else "", level, row["policy"])
        runs.setdefault(" · ".join(filter(None, parts)), {})[row["seed"]] = row
    return runs


def recorded(
    results: Results, runs: Runs, searcher: str, *, seed: int, budget: int
) -> dict[str, Any]:
    """Return a run's first evaluations as a path: see `search`; total has all of them.

    Fitness is as the searcher was told; the rank is that in the published landscape.
    """
    if searcher not in runs:
        raise ParameterError("searcher", f"{searcher[:60]!r} is not among {', '.join(runs)}")
    seeds = runs[searcher]
    if seed not in seeds:
        has = f"{searcher} has {len(seeds)} finished runs, seeds {min(seeds)} to {max(seeds)}"
        raise ParameterError("seed", f"{seed} was not recorded: {has}")
    log = results.evaluations(seeds[seed]["run"])
    first = {name: log[name][:budget] for name in ("design", "fitness")}
    return {**_path(first, int(seeds[seed]["recommended"])), "total": len(log["design"])}
