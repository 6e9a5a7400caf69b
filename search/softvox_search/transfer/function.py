"""A function as a transfer method."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from softvox_gym import Task
from softvox_search.function import BudgetEnd
from softvox_search.protocol import SearcherError
from softvox_search.transfer.protocol import Method, Test, design_of
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

    def run(self, test: Callable[[int], Test], tests: int) -> list[int]:
        """Call the function; return what it recommends after every test."""
        advice: list[int] = []

        def one(design: Any) -> Test:
            if len(self.tests) == tests:
                raise BudgetEnd
            made = test(design_of(design, "tested"))
            self.tell(made)
            advice.append(self.recommend())
            return made

        last: Any = None
        with suppress(BudgetEnd):
            last = self.function(one, self.simulator, self.task, self.rng, **self._options)
        if last is not None and advice:
            advice[-1] = design_of(last, "recommended")
        return advice

    def ask(self) -> Any:
        """Refuse: a function is not asked, it tests."""
        raise SearcherError("is a function, which can't be asked in turn; give a class with ask")
