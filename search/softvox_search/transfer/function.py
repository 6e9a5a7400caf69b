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
    """A function that tests designs until no tests are left.

    Parameters
    ----------
    function : callable (test, simulator, task, rng, **options)
        ``test(design)`` takes one design, as `softvox_gym.Design` does, and returns a `Test`. When
        no tests are left it raises `softvox_search.BudgetEnd`, which ``except Exception`` does not
        catch. The function may return its final recommendation; before that, and if it returns
        none, the best tested design counts.
    simulator, task, rng
        As in `TransferMethod`.
    **options
        Options of the function.
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
        """Call the function; return its recommendation after every test."""
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
        """Raise an error: a function can't be asked, it calls ``test``."""
        raise SearcherError("is a function, which can't be asked in turn; give a class with ask")
