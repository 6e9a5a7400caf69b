"""A base for searchers around optimisers of other libraries."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_search.global_random import GlobalRandom
from softvox_search.protocol import Designs, Info, SearcherBase


class Adapter(SearcherBase):
    """Asks an optimiser of another library.

    Every call of the optimiser finds the global random states of Python and NumPy replaced by its
    own, which are seeded from the run's generator: optimisers that draw from those neither disturb
    others nor are disturbed.

    A searcher on it has `_start`, `_propose` and `_learn`. Options are set before
    ``super().__init__(space, rng)``, which calls `_start`.

    Parameters
    ----------
    space : Lattice
    rng : numpy.random.Generator
    """

    def __init__(self, space: Lattice, rng: np.random.Generator) -> None:
        super().__init__(space, rng)
        self._globals = GlobalRandom(rng)
        with self._globals.swapped_in():
            self._start()

    @abstractmethod
    def _start(self) -> None:
        """Make the optimiser, all its seeds by `_seed`."""

    @abstractmethod
    def _propose(self, n: int | None) -> Designs:
        """Return designs of the optimiser, at most n, shape (m, sites)."""

    @abstractmethod
    def _learn(self, designs: Designs, values: NDArray[np.float64]) -> None:
        """Tell the optimiser; `known` still says what was known before."""

    def ask(self, n: int | None = None) -> Designs:
        """Return what the optimiser proposes, at most n designs, shape (m, sites)."""
        with self._globals.swapped_in():
            return self._propose(n)

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Tell the optimiser, and remember the values."""
        with self._globals.swapped_in():
            self._learn(designs, values)
        super().tell(designs, values, info)

    def _seed(self) -> int:
        """Draw a seed."""
        return int(self.rng.integers(2**32))
