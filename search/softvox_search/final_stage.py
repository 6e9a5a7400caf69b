"""The final stage: fresh draws of the designs believed best, to recommend by these alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_search.protocol import Designs


class FinalStage:
    """Deals a number of draws out among finalists, in turn, and keeps their means.

    In turn, so that a budget that ends before the stage does leaves all with equally many draws,
    to within one.

    Parameters
    ----------
    finalists : ndarray of int64, shape (k, sites)
        Their digits, each design once, the one believed best first.
    draws : int
        Evaluations in all; where k does not divide it, the first get one more.
    """

    def __init__(self, finalists: Designs, draws: int) -> None:
        self.finalists = finalists
        self._draws = draws
        self._values: list[float] = []

    def ask(self, n: int | None = None) -> Designs:
        """Return the next draws, shape (at most n, sites); none at the end of the stage."""
        told = len(self._values)
        end = self._draws if n is None else min(self._draws, told + n)
        return self.finalists[np.arange(told, end) % len(self.finalists)]

    def tell(self, designs: Designs, values: NDArray[np.float64]) -> None:
        """Take in draws, in the order asked.

        Raises
        ------
        ValueError
            For designs that were not asked for.
        """
        if not np.array_equal(designs, self.ask(len(designs))):
            raise ValueError("tell must get the designs that ask returned, in that order")
        self._values += values.tolist()

    @property
    def is_decided(self) -> bool:
        """Whether every finalist had a draw."""
        return len(self._values) >= len(self.finalists)

    @property
    def means(self) -> NDArray[np.float64]:
        """Mean of every finalist's fresh draws, shape (k,); once `is_decided`."""
        k = len(self.finalists)
        return np.array([np.mean(self._values[i::k]) for i in range(k)])

    @property
    def best(self) -> NDArray[np.int64]:
        """The finalist with the best mean; of equals the one that was believed better."""
        row: NDArray[np.int64] = self.finalists[self.means.argmax()]
        return row
