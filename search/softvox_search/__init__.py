"""Searchers compared against the known optimum of the 2x2x2 landscape."""
