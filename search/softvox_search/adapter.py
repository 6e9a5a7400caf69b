"""A base for searchers around optimisers of other libraries."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_search.global_random import GlobalRandom
from softvox_search.protocol import Designs, Info, SearcherBase


class Adapter(SearcherBase):
    """A searcher around an optimiser of another library.

    During every call of the optimiser, its own global random states of Python and NumPy, seeded
    from the run's generator, replace the global ones. So optimisers that draw from those neither
    disturb others nor are disturbed.

    A subclass has `_start`, `_propose` and `_learn`. It sets its options before it calls
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
        """Make the optimiser; take all its seeds from `_seed`."""

    @abstractmethod
    def _propose(self, n: int | None) -> Designs:
        """Return proposals of the optimiser, at most n, shape (m, sites)."""

    @abstractmethod
    def _learn(self, designs: Designs, values: NDArray[np.float64]) -> None:
        """Tell the optimiser; `known` still returns the earlier values."""

    def ask(self, n: int | None = None) -> Designs:
        """Return the optimiser's proposals, at most n designs, shape (m, sites)."""
        with self._globals.swapped_in():
            return self._propose(n)

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Tell the optimiser and store the values."""
        with self._globals.swapped_in():
            self._learn(designs, values)
        super().tell(designs, values, info)

    def _seed(self) -> int:
        """Draw a seed."""
        return int(self.rng.integers(2**32))
