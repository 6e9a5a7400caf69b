"""The final stage: fresh draws of the designs believed best, to recommend by these alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import digits_of
from softvox_search.protocol import Designs


class FinalStage:
    """Deals a number of draws out among finalists, in turn, and keeps their means.

    In turn, so that a budget that ends before the stage does leaves all with equally many draws,
    to within one.

    Parameters
    ----------
    finalists : ndarray of int64, shape (k,)
        Their numbers, each once.
    draws : int
        Evaluations in all; where k does not divide it, the first get one more.
    """

    def __init__(self, finalists: NDArray[np.int64], draws: int) -> None:
        self.finalists = finalists
        self._draws = draws
        self._told = 0
        self._sums = np.zeros(len(finalists))

    @classmethod
    def of(cls, beliefs: NDArray[np.float64], *, finalists: int, resamples: int) -> FinalStage:
        """Make a stage for the designs believed best.

        Parameters
        ----------
        beliefs : ndarray, shape (6561,)
            NaN for a design never evaluated. Of equals the first by number goes on.
        finalists : int
            How many; fewer where fewer were evaluated, and these get more draws.
        resamples : int
            Draws for each, were there so many.
        """
        order = np.argsort(-beliefs, kind="stable")  # NaN come last
        known = order[: min(finalists, int((~np.isnan(beliefs)).sum()))]
        return cls(known, finalists * resamples)

    def __contains__(self, design: int) -> bool:
        return bool((self.finalists == design).any())

    def ask(self, n: int | None = None) -> Designs:
        """Return the next draws, shape (at most n, 8); none at the end of the stage."""
        end = self._draws if n is None else min(self._draws, self._told + n)
        return digits_of(self.finalists[np.arange(self._told, end) % len(self.finalists)])

    def tell(self, indices: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Take in draws, in the order asked."""
        turns = np.arange(self._told, self._told + len(values)) % len(self.finalists)
        if not np.array_equal(self.finalists[turns], indices):
            raise ValueError("tell must get the designs that ask returned, in that order")
        np.add.at(self._sums, turns, values)
        self._told += len(values)

    @property
    def is_decided(self) -> bool:
        """Whether every finalist had a draw."""
        return self._told >= len(self.finalists)

    @property
    def means(self) -> NDArray[np.float64]:
        """Mean of every finalist's fresh draws, shape (k,); once `is_decided`."""
        turns, rest = divmod(self._told, len(self.finalists))
        counts = turns + (np.arange(len(self.finalists)) < rest)
        means: NDArray[np.float64] = self._sums / counts
        return means

    @property
    def best(self) -> int:
        """Number of the finalist with the best mean; of equals the one that was believed better."""
        return int(self.finalists[self.means.argmax()])

    def mean(self, design: int) -> float:
        """Return the mean of a finalist's fresh draws."""
        return float(self.means[self.finalists == design][0])
