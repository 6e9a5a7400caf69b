"""Searchers compared against the known optimum of the 2x2x2 landscape, and beyond it.

An optimiser is anything with `Searcher`'s three methods, of which `SearcherBase` brings two, or a
function that calls ``evaluate`` (`FunctionSearcher`). It meets the physics only through an
`Oracle`, which stands on the Gymnasium vector environment and counts what is spent. `run` lets one
search, `make` makes one of those that come with the package, and `check` puts any through the
questions that they all have to answer.
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
