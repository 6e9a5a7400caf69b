"""Comparison of searchers with the known optimum of the 2x2x2 landscape, and beyond it.

A searcher is anything with `Searcher`'s three methods, of which `SearcherBase` brings two, or a
function that calls ``evaluate`` (`FunctionSearcher`). It reaches the physics only through an
`Oracle`, which wraps the Gymnasium vector environment and counts what is used. `run` runs one
search, `make` makes one of the searchers that come with the package, and `check` tests whether a
searcher follows the protocol.
"""

from softvox_search.conformance import check
from softvox_search.function import BudgetEnd, FunctionSearcher
from softvox_search.oracle import Budget, Oracle
from softvox_search.protocol import Designs, Info, Searcher, SearcherBase, SearcherError
from softvox_search.registry import SEARCHERS, make
from softvox_search.run import run

__all__ = [
    "SEARCHERS",
    "Budget",
    "BudgetEnd",
    "Designs",
    "FunctionSearcher",
    "Info",
    "Oracle",
    "Searcher",
    "SearcherBase",
    "SearcherError",
    "check",
    "make",
    "run",
]
