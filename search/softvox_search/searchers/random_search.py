"""Random search, with replacement or without."""

from __future__ import annotations

import numpy as np

from softvox_gym.design import N_DESIGNS, digits_of
from softvox_search.options import whole
from softvox_search.protocol import Designs, SearcherBase


class RandomSearch(SearcherBase):
    """Asks for designs drawn uniformly, of all or of those not known yet.

    Without replacement the first of k optima is expected as evaluation (N + 1) / (k + 1) of
    N = 6561 designs, with the variance k (N - k) (N + 1) / ((k + 1)^2 (k + 2)): it is the smallest
    of k numbers drawn without replacement from 1 ... N. With replacement the expectation is N / k.

    Parameters
    ----------
    rng : numpy.random.Generator
    replacement : bool
        Whether a design may be drawn again. If not, nothing is asked after the last.
    batch : int
        How many designs to ask for at a time.

    Raises
    ------
    TypeError, ValueError
        For an option of the wrong type, or a batch that is not positive.
    """

    def __init__(
        self, rng: np.random.Generator, *, replacement: bool = False, batch: int = 64
    ) -> None:
        super().__init__(rng)
        if not isinstance(replacement, bool):
            raise TypeError(f"replacement must be True or False, got {replacement!r}")
        self.replacement = replacement
        self.batch = whole("batch", batch)

    def ask(self, n: int | None = None) -> Designs:
        """Draw designs, shape (n, 8)."""
        batch = self.batch if n is None else n
        if self.replacement:
            return digits_of(self.rng.integers(N_DESIGNS, size=batch))
        unknown = np.flatnonzero(np.isnan(self.values))
        return digits_of(self.rng.choice(unknown, size=min(batch, len(unknown)), replace=False))
