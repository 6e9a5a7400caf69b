"""A restarted hill climber on the graph of single mutations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_gym.simulation import check_count
from softvox_search.protocol import Designs, Info, SearcherBase
from softvox_search.searchers.random_search import Urn


class HillClimber(SearcherBase):
    """Climbs to better neighbours; if none is better, restarts from a random unknown design.

    It stands on one design and asks for some of the neighbours, one digit away, that it doesn't
    know yet, in random order. As soon as it knows a better neighbour it moves, to the best known
    one. It never asks for a design twice, and moves through known designs at no cost, even under
    noise: it believes a value told once until it is told another. When it knows all designs it asks
    for nothing more.

    Parameters
    ----------
    batch : int
        Number of neighbours to ask for before moving: 1 is first improvement, all of them (two per
        site, and one more for every further phase) is steepest ascent. On the 2x2x2 landscape it
        finds the optimum after 2482 (1), 2381 (4), 2282 (8) and 2392 (16) designs on average over
        800 runs, with standard errors of 52 to 62.

    Raises
    ------
    TypeError, ValueError
        If the batch is no whole number from 1 to the number of neighbours.
    """

    def __init__(self, space: Lattice, rng: np.random.Generator, *, batch: int = 8) -> None:
        super().__init__(space, rng)
        check_count("batch", batch, least=1)
        most = (space.states - 1) * space.sites
        if batch > most:
            raise ValueError(f"batch must be at most {most}, the neighbours, got {batch}")
        self._batch = batch
        self._urn = Urn(space, rng)
        self._point: Designs = np.zeros((0, space.sites), dtype=np.int64)  # at most one row

    def ask(self, n: int | None = None) -> Designs:
        """Return unknown neighbours of the design it stands on, or a new start; (n, sites)."""
        self._climb()
        if np.isnan(self.known(self._point)).any() or not len(self._point):
            return self._point.copy()
        around = neighbours(self._point[0], self.space.states)
        unknown = self.rng.permutation(around[np.isnan(self.known(around))])
        return unknown[: self._batch if n is None else min(n, self._batch)]

    def parents(self) -> Designs:
        """Return the design that it stands on, (1, sites); none before its value is known."""
        return self._point[~np.isnan(self.known(self._point))]

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Store newer values of designs."""
        super().tell(designs, values, info)

    def _climb(self) -> None:
        """Move uphill, restarting at each local optimum, until a design must be asked for."""
        while len(self.parents()):
            around = neighbours(self._point[0], self.space.states)
            values = self.known(around)
            better = values > self.known(self._point)  # False if unknown
            if better.any():
                self._point = around[[np.argmax(np.where(better, values, -np.inf))]]
            elif np.isnan(values).any():
                return
            else:
                self._point = self._point[:0]
        if not len(self._point):
            self._point = self._urn.draw(1, self.values)


def neighbours(design: NDArray[np.int64], states: int = 3) -> Designs:
    """Return all designs that differ in a single digit, shape ((states - 1) sites, sites)."""
    change = np.eye(len(design), dtype=np.int64)
    changes = np.concatenate([step * change for step in range(1, states)])
    neighbours: Designs = (design + changes) % states
    return neighbours
