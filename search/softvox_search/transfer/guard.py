"""The guard around a method: it checks the order of calls and the returned designs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from softvox_search.protocol import SearcherError, naming
from softvox_search.transfer.function import FunctionMethod
from softvox_search.transfer.protocol import Method, Test, TransferMethod, design_of


class Guarded:
    """A method with its protocol enforced: `ask`, `tell` and, once told, `recommend`.

    All other attributes are those of the method.

    Parameters
    ----------
    method : TransferMethod
    name : str
        Its name in errors.

    Raises
    ------
    SearcherError
        By its three methods: if a call is out of order, or the method returns no valid design.
    """

    def __init__(self, method: TransferMethod, name: str) -> None:
        self.method, self.name, self._who = method, name, f"method {name}"
        self._due: int | None = None
        self._is_told = False

    def __getattr__(self, name: str) -> Any:
        if name == "method":  # not made yet, as during unpickling
            raise AttributeError(name)
        return getattr(self.method, name)

    def ask(self) -> int | None:
        """Return the number of the next design to test; None to test no more."""
        with naming(self._who):
            if self._due is not None:
                raise SearcherError(
                    f"was asked twice in a row; tell it first what the test of design {self._due}, "
                    "which it asked for, showed"
                )
            asked = self.method.ask() if self._may_ask() else None
            self._due = None if asked is None else design_of(asked, "asked for")
        return self._due

    def tell(self, test: Test) -> None:
        """Tell it the result of the test of the design last asked for."""
        with naming(self._who):
            if self._due is None:
                raise SearcherError(
                    f"was told of design {test.design}, for which it had not asked; ask it first"
                )
            if test.design != self._due:
                raise SearcherError(
                    f"was told of design {test.design} where it had asked for {self._due}; tell it "
                    f"what the test of design {self._due} showed"
                )
            self.method.tell(test)
            self._due, self._is_told = None, True

    def recommend(self) -> int:
        """Return the number of the design that it would build now."""
        with naming(self._who):
            if not self._is_told:
                raise SearcherError(
                    "was asked for its recommendation before any test; ask it, test, and tell it "
                    "first"
                )
            return design_of(self.method.recommend(), "recommended")

    def course(
        self,
        test: Callable[[int], Test],
        tests: int,
        *,
        may_repeat: bool = False,
        is_advised: bool = True,
    ) -> list[tuple[Test, int]]:
        """Let it test designs; return every test with the recommendation after it.

        Parameters
        ----------
        test : callable
            Tests a design.
        tests : int
            The most tests.
        may_repeat : bool
            Whether a design may be tested again.
        is_advised : bool
            Whether a method with `ask` is asked for its recommendations; otherwise they are -1.
        """
        shown: list[Test] = []
        tested: set[int] = set()

        def once(design: int) -> Test:
            if not may_repeat and design in tested:
                raise SearcherError(
                    f"asked for design {design} a second time, which would show the same; ask for "
                    "another, or for None to end"
                )
            tested.add(design)
            shown.append(test(design))
            return shown[-1]

        advice: list[int] = []
        if isinstance(self.method, FunctionMethod):
            with naming(self._who):
                advice = self.method.run(once, tests)
        else:
            while len(shown) < tests and (asked := self.ask()) is not None:
                with naming(self._who):
                    told = once(asked)
                self.tell(told)
                advice.append(self.recommend() if is_advised else -1)
        if not shown:
            with naming(self._who):
                raise SearcherError("tested no design at all")
        return list(zip(shown, advice, strict=True))

    def _may_ask(self) -> bool:
        """Whether any design is left for a method that stores its tests."""
        return not isinstance(self.method, Method) or bool(self.method.untested().any())
