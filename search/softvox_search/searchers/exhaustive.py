"""Exhaustive search: every design once."""

from __future__ import annotations

import numpy as np

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.protocol import Designs, SearcherBase


class Exhaustive(SearcherBase):
    """Asks for every design once, in order of number.

    In random order it is `RandomSearch` without replacement.

    Parameters
    ----------
    batch : int
        Number of designs to ask for at a time.

    Raises
    ------
    TypeError, ValueError
        If the batch is no positive whole number.
    """

    def __init__(self, space: Lattice, rng: np.random.Generator, *, batch: int = 64) -> None:
        super().__init__(space, rng)
        check_count("batch", batch, least=1)
        self._batch = batch
        self._asked = 0

    def ask(self, n: int | None = None) -> Designs:
        """Return the next designs by number, shape (n, sites); none after the last."""
        first = self._asked
        self._asked = min(self.space.n_designs, first + (self._batch if n is None else n))
        kind = np.int64 if self.space.has_int64_numbers else object
        return self.space.digits(np.array(range(first, self._asked), dtype=kind)).astype(np.int64)
