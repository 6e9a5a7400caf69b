"""One search for the map, as a process of its own.

``python -m softvox_view.explore.path_run NAME SEED BUDGET``

Prints lines of JSON: how far it is (done, total), then the path, or an error.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import Any, TypeAlias

from softvox_view.explore.landscapes import listed

#: s between lines about the progress.
EVERY_SECONDS = 0.1

Say: TypeAlias = Callable[[dict[str, Any]], None]


def main(name: str, seed: int, budget: int) -> None:
    """Search, and print."""
    out = sys.stdout
    with redirect_stdout(sys.stderr):  # what libraries print is not for the reader of the lines

        def say(what: dict[str, Any]) -> None:
            print(json.dumps(what), flush=True, file=out)

        try:
            say(_path(name, seed, budget, say))
        except Exception as error:  # whatever a library says, the page is to show
            say({"error": _told(name, error)})


def _path(name: str, seed: int, budget: int, say: Say) -> dict[str, Any]:
    from softvox_search import single

    experiment = single.experiment_of(name, options={}, seed=seed, unique=budget)
    found = single.search(experiment, progress=_Teller(say))
    return {
        "designs": found.columns["design"].tolist(),
        "fitness": listed(found.columns["fitness"]),
        "recommended": found.design.index,
        "rank": found.truth.rank,
    }


def _told(name: str, error: Exception) -> str:
    """Return an error in the page's words, with the mend where a library is missing."""
    missing = error if isinstance(error, ModuleNotFoundError) else error.__cause__
    if isinstance(missing, ModuleNotFoundError):
        return f"searcher {name} needs {missing.name}: pip install 'softvox-gym[search]'"
    return str(error).replace("--searcher", "searcher") or type(error).__name__


class _Teller:
    """Prints how far it is, but not more often than a reader wants to know."""

    def __init__(self, say: Say) -> None:
        self._say = say
        self._told = 0.0

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self._told >= EVERY_SECONDS:
            self._told = now
            self._say({"done": done, "total": total})


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
