"""Random search, with replacement or without."""

from __future__ import annotations

from collections.abc import Container

import numpy as np

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.protocol import Designs, SearcherBase, keys_of, rows_of


class RandomSearch(SearcherBase):
    """Asks for designs drawn uniformly, from all or from those not drawn yet.

    Without replacement the first of k optima is expected at evaluation (N + 1) / (k + 1) of N
    designs, with the variance k (N - k) (N + 1) / ((k + 1)^2 (k + 2)): it is the smallest of k
    numbers drawn without replacement from 1 ... N. With replacement the expectation is N / k.

    Parameters
    ----------
    replacement : bool
        Whether a design may be drawn again. If not, it asks for nothing after the last.
    batch : int
        Number of designs to ask for at a time.

    Raises
    ------
    TypeError, ValueError
        If an option has the wrong type, or the batch is not positive.
    """

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        replacement: bool = False,
        batch: int = 64,
    ) -> None:
        super().__init__(space, rng)
        check_count("batch", batch, least=1)
        self._urn = None if replacement else Urn(space, rng)
        self._batch = batch

    def ask(self, n: int | None = None) -> Designs:
        """Draw designs, shape (n, sites)."""
        size = self._batch if n is None else n
        if self._urn is None:
            return self.space.random(size, self.rng)
        return self._urn.draw(size, self.values)


class Urn:
    """Draws designs uniformly, each once; memory grows with the draws, not with the lattice.

    Until half of all designs are drawn, a design that was drawn before is put back and another is
    drawn. Then the other half is shuffled.

    Parameters
    ----------
    space : Lattice
    rng : numpy.random.Generator
    """

    def __init__(self, space: Lattice, rng: np.random.Generator) -> None:
        self._space = space
        self._rng = rng
        self._drawn: set[bytes] = set()
        self._rest: list[bytes] | None = None

    def draw(self, n: int, known: Container[bytes] = ()) -> Designs:
        """Return n designs, shape (n, sites); fewer if no more are left.

        Parameters
        ----------
        n : int
        known : container of keys
            Further designs not to draw.
        """
        keys: list[bytes] = []
        while len(keys) < n and self._rest is None:
            if 2 * len(self._drawn) >= self._space.n_designs:
                self._rest = self._shuffled_rest()
                break
            for key in keys_of(self._space.random(n - len(keys), self._rng)):
                if key not in self._drawn:
                    self._drawn.add(key)
                    keys += [] if key in known else [key]
        while len(keys) < n and self._rest:
            key = self._rest.pop()
            keys += [] if key in known else [key]
        return rows_of(keys, self._space)

    def _shuffled_rest(self) -> list[bytes]:
        every = keys_of(self._space.digits(np.arange(self._space.n_designs)).astype(np.int64))
        rest = [key for key in every if key not in self._drawn]
        return [rest[i] for i in self._rng.permutation(len(rest))]
