"""A function as a transfer method."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from softvox_gym import Design, Task
from softvox_gym.landscapes.table import LATTICE
from softvox_search.function import BudgetEnd
from softvox_search.protocol import SearcherError
from softvox_search.transfer.protocol import Method, Test
from softvox_search.transfer.simulator import Simulator


class FunctionMethod(Method):
    """A function that tests designs until there are no more tests.

    Parameters
    ----------
    function : callable (test, simulator, task, rng, **options)
        ``test(design)`` takes one design, as `softvox_gym.Design` does, and returns a `Test`. When
        there are no more it raises `softvox_search.BudgetEnd`, which ``except Exception`` lets by.
        The function may return the design that it recommends in the end; until then, and where it
        doesn't, that is the best tested.
    simulator, task, rng
        As `TransferMethod` has them.
    **options
        Of the function.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        **options: Any,
    ) -> None:
        super().__init__(simulator, task, rng)
        self.function = function
        self._options = options

    def run(self, test: Callable[[int], Test], tests: int) -> list[Any]:
        """Call the function; return what it recommends after every test."""
        advice: list[Any] = []

        def one(design: Any) -> Test:
            if len(self.tests) == tests:
                raise BudgetEnd
            try:
                number = Design(design, shape=LATTICE).index
            except (TypeError, ValueError) as error:
                raise SearcherError(
                    f"tested what is not one design of {LATTICE}: {error}"
                ) from error
            made = test(number)
            self.tell(made)
            advice.append(self.recommend())
            return replace(made, displacement=made.displacement.copy())

        last: Any = None
        with suppress(BudgetEnd):
            last = self.function(one, self.simulator, self.task, self.rng, **self._options)
        return advice if last is None or not advice else [*advice[:-1], last]

    def ask(self) -> Any:
        """Refuse: a function is not asked, it tests."""
        raise SearcherError("is a function, which can't be asked in turn; give a class with ask")
