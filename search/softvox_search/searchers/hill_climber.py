"""A restarted hill climber on the graph of single mutations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import digits_of, indices_of
from softvox_gym.landscapes.analysis import neighbours
from softvox_search.options import whole
from softvox_search.protocol import Designs, Info, SearcherBase

#: Designs at Hamming distance 1: eight sites with two other digits each.
N_NEIGHBOURS = 16


class HillClimber(SearcherBase):
    """Climbs to better neighbours; where none is better, restarts from a random unknown design.

    It stands on one design and asks for some of its neighbours that it doesn't know yet, in random
    order. As soon as a neighbour is known to be better it moves, to the best one known. It never
    asks for a design twice, and walks through what it knows for free. Under noise as well: there a
    value told once is believed until another is told. When all 6561 designs are known it asks for
    nothing more.

    Parameters
    ----------
    rng : numpy.random.Generator
    batch : int
        How many neighbours to ask for before moving: 1 is first improvement, 16 is steepest ascent.
        On this landscape the optimum is found after 2482 (1), 2381 (4), 2282 (8) and 2392 (16)
        designs on average over 800 runs, with standard errors of 52 to 62.

    Raises
    ------
    TypeError, ValueError
        For a batch that is no whole number from 1 to 16.
    """

    def __init__(self, rng: np.random.Generator, *, batch: int = 8) -> None:
        super().__init__(rng)
        self.batch = whole("batch", batch)
        if batch > N_NEIGHBOURS:
            raise ValueError(f"batch must be at most {N_NEIGHBOURS}, the neighbours, got {batch}")
        self._point: int | None = None

    def ask(self, n: int | None = None) -> Designs:
        """Return unknown neighbours of the design it stands on, or a new start; shape (n, 8)."""
        self._climb()
        if self._point is None:
            return digits_of(np.zeros(0, dtype=np.int64))
        if np.isnan(self.values[self._point]):
            return digits_of(np.array([self._point]))
        around = neighbours()[self._point]
        unknown = self.rng.permutation(around[np.isnan(self.values[around])])
        return digits_of(unknown[: self.batch if n is None else min(n, self.batch)])

    def parents(self) -> Designs:
        """Return the design that it stands on, shape (1, 8); none before its value is known."""
        known = self._point is not None and not np.isnan(self.values[self._point])
        return digits_of(np.array([self._point] if known else [], dtype=np.int64))

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Believe newer values of designs."""
        self.values[indices_of(designs)] = values

    def _climb(self) -> None:
        """Move until something must be asked: better, or anew where nothing better is left."""
        while self._point is not None and not np.isnan(self.values[self._point]):
            around = neighbours()[self._point]
            values = self.values[around]
            better = values > self.values[self._point]  # False where unknown
            if better.any():
                self._point = int(around[np.argmax(np.where(better, values, -np.inf))])
            elif np.isnan(values).any():
                return
            else:
                self._point = None
        if self._point is None:
            unknown = np.flatnonzero(np.isnan(self.values))
            self._point = int(self.rng.choice(unknown)) if len(unknown) else None
