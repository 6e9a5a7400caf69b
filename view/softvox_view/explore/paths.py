"""A searcher's path over the map: a live run on the exact table, in a process of its own.

Searchers of other libraries touch the global random state and import for seconds; a process keeps
that away from the server, and can be ended at once when its result is no longer wanted.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from typing import Any

from softvox_view.explore.jobs import CancelledError, Job
from softvox_view.explore.parameters import BadRequestError

#: Evaluations that a path may have: more would hide the map.
MOST_BUDGET = 2000


class PathError(Exception):
    """A run that failed; the message is what it said."""


def searchers() -> list[str]:
    """Return the names of the searchers; none where their package is missing."""
    if find_spec("softvox_search") is None:
        return []
    from softvox_search.registry import SEARCHERS

    return list(SEARCHERS)


def searcher(value: Any) -> str:
    """Read the name of a searcher; only those of the registry, since one's own is code.

    Raises
    ------
    BadRequestError
        For any other.
    """
    known = searchers()
    if isinstance(value, str) and value in known:
        return value
    raise BadRequestError(
        f"there is no searcher {str(value)[:60]!r}; the searchers are {', '.join(known)}",
        "searcher",
    )


def follow(job: Job, name: str, *, seed: int, budget: int) -> dict[str, Any]:
    """Let a searcher search, and return its path ready for JSON.

    Parameters
    ----------
    job : Job
        Told how far it is; when it is cancelled, the run ends.
    name : str
    seed, budget : int

    Returns
    -------
    dict
        designs, fitness : what was evaluated, in order, repetitions included; recommended : the
        design that it recommends; rank : of that one among all.

    Raises
    ------
    PathError
        Where the run fails, as for a library that is not installed.
    CancelledError
        Where the job was cancelled.
    """
    command = [
        sys.executable,
        "-P",
        "-m",
        "softvox_view.explore.path_run",
        name,
        str(seed),
        str(budget),
    ]
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=said, text=True
        )
        job.when_cancelled(process.kill)
        made: dict[str, Any] | None = None
        assert process.stdout is not None
        with process, process.stdout:
            for line in process.stdout:
                event = json.loads(line)
                if "total" in event:
                    job.report(event["done"], event["total"])
                else:
                    made = event
        if job.is_cancelled:
            raise CancelledError
        if made is None:
            said.seek(0)
            words = said.read().decode(errors="replace").strip().splitlines()
            raise PathError(words[-1] if words else f"{name} ended with no word")
    if "error" in made:
        raise PathError(made["error"])
    return made
