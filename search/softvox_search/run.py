"""A run: a searcher against an oracle until the budget ends."""

from __future__ import annotations

from typing import Any

from softvox_gym import Design
from softvox_search.oracle import Oracle, SearcherError
from softvox_search.protocol import Searcher


def run(searcher: Searcher, oracle: Oracle, *, name: str | None = None) -> Design:
    """Let a searcher search until a budget is used up or it proposes nothing more.

    Parameters
    ----------
    searcher : Searcher
    oracle : Oracle
        Its log tells afterwards what was evaluated.
    name : str, optional
        What to call the searcher in errors; its class where None.

    Returns
    -------
    Design
        The searcher's recommendation.

    Raises
    ------
    SearcherError
        Where the searcher breaks the protocol, naming it.
    """
    called = name or type(searcher).__name__
    try:
        while not oracle.is_exhausted:
            answer = oracle.evaluate(searcher.ask())
            if len(answer.designs) == 0:
                break
            searcher.tell(*answer)
        if oracle.evaluations == 0:
            raise SearcherError("proposed no design at all")
        return recommended(searcher.recommend())
    except SearcherError as error:
        raise SearcherError(f"searcher {called} {error}") from error


def recommended(design: Any) -> Design:
    """Return a recommendation as a Design of the 2x2x2 lattice.

    Raises
    ------
    SearcherError
        Where it is none.
    """
    try:
        made = Design(design)
    except (TypeError, ValueError) as error:
        raise SearcherError(f"recommended what is no design: {error}") from error
    if made.shape != (2, 2, 2):
        raise SearcherError(f"recommended a design of shape {made.shape}, not (2, 2, 2)")
    return made
