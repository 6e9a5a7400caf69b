"""Searchers compared against the known optimum of the 2x2x2 landscape, and beyond it.

A searcher is any object with the three methods of `Searcher`, of which `SearcherBase` implements
two, or a function that calls ``evaluate`` (`FunctionSearcher`). It evaluates designs only through
an `Oracle`, which uses a Gymnasium vector environment and counts the evaluations. `make` makes one
of the searchers that come with the package, `run` runs a searcher, and `check` tests whether its
runs can be trusted.
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
