"""A run: a searcher with an oracle until the budget ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design, Lattice
from softvox_search.function import FunctionSearcher
from softvox_search.log import identity
from softvox_search.oracle import Oracle
from softvox_search.protocol import Searcher, SearcherError, naming


def run(searcher: Searcher, oracle: Oracle, *, name: str | None = None) -> Design:
    """Run a searcher until the budget is used up or it proposes nothing more.

    Parameters
    ----------
    searcher : Searcher
        A searcher with `ask`, or a `FunctionSearcher`.
    oracle : Oracle
        Its log lists what was evaluated.
    name : str, optional
        Name of the searcher in errors; by default its class.

    Returns
    -------
    Design
        The searcher's recommendation.

    Raises
    ------
    SearcherError
        If the searcher breaks the protocol; the message names it.
    """
    with naming(f"searcher {name or name_of(searcher)}"):
        advice: Any = None
        if isinstance(searcher, FunctionSearcher):
            advice = searcher.search(oracle)
        else:
            while not oracle.is_exhausted:
                answer = oracle.evaluate(searcher.ask())
                if len(answer.designs) == 0:
                    break
                searcher.tell(*answer)
        if oracle.evaluations == 0:
            raise SearcherError("proposed no design at all")
        return recommended(searcher.recommend() if advice is None else advice, oracle.space)


def name_of(searcher: Searcher) -> str:
    """Return the name of a searcher: its class or function."""
    function = getattr(searcher, "function", None)
    return getattr(function, "__name__", type(searcher).__name__)


def recommended(design: Any, space: Lattice) -> Design:
    """Return a recommendation as a Design of the lattice.

    Raises
    ------
    SearcherError
        If it is none.
    """
    try:
        return Design(design, shape=space)
    except (TypeError, ValueError) as error:
        raise SearcherError(f"recommended an invalid design of {space}: {error}") from error


def believed(
    searcher: Searcher, design: Design, columns: Mapping[str, NDArray[Any]]
) -> float | None:
    """Return the value that a searcher believes a design to have, voxel widths.

    Its policy's belief; without a policy the value that it was told last, or None if it was told
    none for this design.

    Parameters
    ----------
    searcher : Searcher
    design : Design
    columns : dict of ndarray
        The log of its run.
    """
    if hasattr(searcher, "belief"):
        value = float(searcher.belief(design))
        return None if np.isnan(value) else value
    told = columns["fitness"][columns["design"] == identity(design)]
    return float(told[-1]) if len(told) else None
