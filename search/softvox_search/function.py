"""Functions as searchers, such as SciPy's optimisers."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_search.oracle import Oracle, checked
from softvox_search.protocol import SearcherBase, SearcherError


class BudgetEnd(BaseException):
    """The budget is used up. Ends a searching function; ``except Exception`` does not catch it.

    A function that recommends another design than the best it saw may catch it and return.
    """


class FunctionSearcher(SearcherBase):
    """A function as a searcher: it calls ``evaluate`` until the budget ends it.

    Parameters
    ----------
    function : callable (evaluate, space, rng, ...)
        ``evaluate(designs)`` accepts what `Searcher.ask` may return, or a single design: a Design,
        a str of digits, a number, or a row of as many digits as the lattice has sites. It returns
        the values, float64 of shape (n,), to be maximised; (1,) for a single design. When the
        budget is used up it raises `BudgetEnd`. The function may return the design that it
        recommends; otherwise the best value told decides.
    space : Lattice
    rng : numpy.random.Generator
        The generator of the run; the function must draw from no other.
    **options
        Options of the function.
    """

    def __init__(
        self, function: Callable[..., Any], space: Lattice, rng: np.random.Generator, **options: Any
    ) -> None:
        super().__init__(space, rng)
        self.function = function
        self._options = options

    def search(self, oracle: Oracle) -> Any:
        """Call the function and return its recommendation; None if it gives none.

        Raises
        ------
        Exception
            Whatever the function raises.
        SearcherError
            If it evaluates invalid designs.
        """

        def evaluate(designs: Any) -> NDArray[np.float64]:
            rows = checked(self._batch(designs), self.space)
            if oracle.is_exhausted:
                raise BudgetEnd
            answer = oracle.evaluate(rows)
            self.tell(*answer)
            if len(answer.designs) < len(rows):
                raise BudgetEnd
            return answer.values

        if oracle.is_exhausted:  # the first look, from which on processor time counts
            return None
        try:
            return self.function(evaluate, self.space, self.rng, **self._options)
        except BudgetEnd:
            return None

    def ask(self, n: int | None = None) -> Any:
        """Raise an error: a function can't be asked, it calls ``evaluate``."""
        raise SearcherError("is a function, which can't be asked in turn; give a class with ask")

    def _batch(self, designs: Any) -> Any:
        """Return a batch; a single row of digits is a batch of one."""
        try:
            row = np.asarray(designs)
        except ValueError:  # ragged
            return designs
        is_row = row.shape == (self.space.sites,) and row.dtype.kind in "iu"
        are_digits = is_row and ((row >= 0) & (row < self.space.states)).all()
        return row[np.newaxis] if are_digits else designs


def is_function(what: Any, arguments: int = 3) -> bool:
    """Return whether something is a function with as many arguments as a searching one.

    Classes and factories of searchers are not.
    """
    if inspect.isclass(what):
        return False
    try:
        parameters = inspect.signature(what).parameters.values()
    except (TypeError, ValueError):
        return False
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    required = [one for one in parameters if one.kind in kinds and one.default is one.empty]
    return len(required) == arguments
