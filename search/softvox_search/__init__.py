"""Searchers compared against the known optimum of the 2x2x2 landscape.

An optimiser is anything with `Searcher`'s five methods; `SearcherBase` brings four of them. It
meets the physics only through an `Oracle`, which stands on the Gymnasium vector environment and
counts what is spent. `run` lets one search, `make` makes one of those that come with the package,
and `check` puts any through the questions that they all have to answer.
"""

from softvox_search.conformance import check
from softvox_search.oracle import Budget, Oracle, SearcherError
from softvox_search.protocol import Designs, Info, Searcher, SearcherBase
from softvox_search.registry import SEARCHERS, make
from softvox_search.run import run

__all__ = [
    "SEARCHERS",
    "Budget",
    "Designs",
    "Info",
    "Oracle",
    "Searcher",
    "SearcherBase",
    "SearcherError",
    "check",
    "make",
    "run",
]
