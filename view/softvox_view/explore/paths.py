"""A searcher's path over the map: a live run on the exact table, in a process of its own.

Searchers of other libraries touch the global random state and import for seconds; a process keeps
that away from the server, and can be ended at once when its result is no longer wanted.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from contextlib import redirect_stdout
from importlib.util import find_spec
from typing import Any

from softvox_gym.engine import Progress
from softvox_gym.missing import missing
from softvox_view.explore.landscapes import listed
from softvox_view.explore.requests import BadRequestError

#: s between lines that say how far a search is; as often it is seen whether it is still wanted.
EVERY_SECONDS = 0.1


def searchers() -> list[str]:
    """Return the names of the searchers; none where their package is missing."""
    if find_spec("softvox_search") is None:
        return []
    from softvox_search.registry import SEARCHERS

    return list(SEARCHERS)


def search(name: str, *, seed: int, budget: int, progress: Progress) -> dict[str, Any]:
    """Let a searcher search, and return its path ready for JSON.

    Parameters
    ----------
    name : str
        One of `searchers`: one's own would be code.
    seed, budget : int
    progress : callable (done, total)
        Called several times a second; an error that it raises ends the search.

    Returns
    -------
    dict
        designs, fitness : what was evaluated, in order, repetitions included; recommended : the
        design that it recommends; rank : of that one among all.

    Raises
    ------
    BadRequestError
        For an unknown searcher, or where the run fails, as for a library that is not installed.
    """
    if name not in searchers():
        raise BadRequestError(
            f"there is no searcher {name[:60]!r}; the searchers are {', '.join(searchers())}",
            "searcher",
        )
    path: dict[str, Any] = {"error": f"{name} ended without a word"}
    command = [sys.executable, "-P", "-m", __name__, name, str(seed), str(budget)]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                path = json.loads(line)
                if "done" in path:
                    progress(path["done"], path["total"])
        finally:
            process.kill()
    if "designs" not in path:
        raise BadRequestError(path.get("error", f"{name} ended before its result"))
    return path


def main(name: str, seed: int, budget: int) -> None:
    """Search, and print lines of JSON: how far it is (done, total), then the path or an error."""
    out, far, ended = sys.stdout, [0, budget], threading.Event()

    def say(what: dict[str, Any]) -> None:
        print(json.dumps(what), flush=True, file=out)

    def tell() -> None:
        while not ended.wait(EVERY_SECONDS):
            say({"done": far[0], "total": far[1]})

    def progress(*now: int) -> None:
        far[:] = now

    teller = threading.Thread(target=tell)
    teller.start()
    with redirect_stdout(sys.stderr):  # what libraries print is not for the reader of the lines
        try:
            path = _path(name, seed, budget, progress)
        except Exception as error:  # whatever a library says, the page is to show
            path = {"error": str(error).replace("--searcher", "searcher") or type(error).__name__}
            for cause in (error, error.__cause__):
                if isinstance(cause, ImportError):
                    path = {"error": missing(f"searcher {name}", cause)}
    ended.set()
    teller.join()
    say(path)


def _path(name: str, seed: int, budget: int, progress: Progress) -> dict[str, Any]:
    from softvox_search import single
    from softvox_search.oracle import Budget

    found = single.search(name, budget=Budget(unique=budget), seed=seed, progress=progress)
    assert found.truth is not None  # on this lattice it is known
    return {
        "designs": found.columns["design"].tolist(),
        "fitness": listed(found.columns["fitness"]),
        "recommended": found.design.index,
        "rank": found.truth.rank,
    }


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
