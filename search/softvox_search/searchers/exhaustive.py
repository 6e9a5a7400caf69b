"""Exhaustive search: every design once."""

from __future__ import annotations

import numpy as np

from softvox_gym.design import N_DESIGNS, digits_of
from softvox_search.options import whole
from softvox_search.protocol import Designs, SearcherBase


class Exhaustive(SearcherBase):
    """Asks for every design once, by number or in random order, and then for nothing more.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws the order where shuffled; else unused.
    shuffled : bool
        Whether the order is random instead of by number.
    batch : int
        How many designs to ask for at a time.

    Raises
    ------
    TypeError, ValueError
        For an option of the wrong type, or a batch that is not positive.
    """

    def __init__(
        self, rng: np.random.Generator, *, shuffled: bool = False, batch: int = 64
    ) -> None:
        super().__init__(rng)
        if not isinstance(shuffled, bool):
            raise TypeError(f"shuffled must be True or False, got {shuffled!r}")
        self.batch = whole("batch", batch)
        self._order = rng.permutation(N_DESIGNS) if shuffled else np.arange(N_DESIGNS)
        self._asked = 0

    def ask(self, n: int | None = None) -> Designs:
        """Return the next designs of the order, shape (n, 8); none after the last."""
        batch = self.batch if n is None else n
        designs = self._order[self._asked : self._asked + batch]
        self._asked += len(designs)
        return digits_of(designs)
