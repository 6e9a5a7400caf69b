"""Recorded paths of searchers, for the page."""

from __future__ import annotations

import base64
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

#: Most evaluations of a run on the page: more would hide the map.
MOST = 2000


def recorded(results: Results) -> dict[str, dict[str, Any]]:
    """Return the finished runs of a folder on the map's lattice, ready for JSON.

    Keys are the searcher, with its setting if that differs between runs, and then the seed. Fitness
    is as the searcher was told; total counts all evaluations.
    """
    table = results.runs
    mine = table[(table["status"] == "ok") & (table["shape"] == "2x2x2")]
    has_physics = mine["physics"].nunique() > 1
    runs: dict[str, dict[str, Any]] = {}
    for row in mine.to_dict("records"):
        level = "" if np.isnan(row["level"]) else f"noise {row['level']:g}"
        parts = (row["searcher"], row["physics"] if has_physics else "", level, row["policy"])
        log = results.evaluations(row["run"])
        runs.setdefault(" · ".join(filter(None, parts)), {})[str(row["seed"])] = {
            "designs": packed(log["design"][:MOST].astype("<u2")),
            "fitness": packed(log["fitness"][:MOST].astype("<f8")),
            "recommended": int(row["recommended"]),
            "total": len(log["design"]),
        }
    return runs


def packed(content: Any) -> str:
    """Return bytes, or those of an array in its own order, compressed and as base64."""
    return base64.b64encode(zlib.compress(bytes(content), 9)).decode("ascii")
