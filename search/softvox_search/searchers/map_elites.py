"""MAP-Elites: the fittest design of every kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_gym.design import ABSENT, ACTIVE
from softvox_gym.simulation import check_count
from softvox_search.evolution import mutate, mutation_rate, rows
from softvox_search.global_random import GlobalRandom, library
from softvox_search.protocol import Designs, Info, SearcherBase, keys_of

#: Number of sectors of headings; sector k is centred on k / SECTORS of a full turn from +x towards
#: +y, so that a robot that walks straight along an axis is on no boundary.
SECTORS = 8

#: The "sector" of a design without a heading.
NOWHERE = SECTORS

#: Voxel widths; a robot that travels less has no heading. A tenth of a millimetre.
STILL = 0.01


class MapElites(SearcherBase):
    """Keeps the fittest design known for every (n_voxels, n_active, heading).

    The heading is the sector of a circle into which the design travels. A design that diverged or
    hardly moved (`STILL`) has none, and cells of their own hold such designs. Children are mutants
    of elites drawn uniformly, with replacement.

    Under noise, `parents` are not all elites, as there may be hundreds, but only the parents of the
    latest batch. An elite that turns out to head elsewhere moves to the cell of that heading, if it
    is fitter than the elite there.

    Parameters
    ----------
    population : int
        Number of designs in a batch; the first batch is drawn at random.
    mutation : float, optional
        Probability that each digit of a child changes; at least one always does. By default one
        over the number of sites.

    Source
    ------
    J.-B. Mouret, J. Clune, *Illuminating search spaces by mapping elites*, arXiv:1504.04909, 2015.
    """

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        population: int = 50,
        mutation: float | None = None,
    ) -> None:
        super().__init__(space, rng)
        check_count("population", population, least=1)
        self._mutation = mutation_rate(mutation, space)
        self._size = population
        self._random = GlobalRandom(rng)
        self._n_random = population  # of the first batch, still to be told
        self._bred_of: Designs = np.zeros((0, space.sites), dtype=np.int64)
        dims = (space.sites + 1, space.sites + 1, SECTORS + 1)
        self._archive = library("ribs.archives").GridArchive(
            solution_dim=space.sites,
            dims=dims,
            ranges=[(-0.5, n - 0.5) for n in dims],
        )

    def ask(self, n: int | None = None) -> Designs:
        """Return mutants of elites, at most n; random designs at first."""
        if self._n_random:
            return self.space.random(min(self._n_random, n or self._n_random), self.rng)
        elites, size = self.elites()[0], min(self._size, n or self._size)
        self._bred_of = elites[self.rng.integers(len(elites), size=size)]
        with self._random.swapped_in():
            return rows(
                (
                    mutate(elite, self._mutation, self.space.states)[0]
                    for elite in self._bred_of.tolist()
                ),
                self.space,
            )

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Store the values, and let the designs compete for their cells."""
        super().tell(designs, values, info)
        self._n_random = max(0, self._n_random - len(designs))
        self._archive.add(designs, values, kinds(designs, info))

    def elites(self) -> tuple[Designs, NDArray[np.float64], NDArray[np.int64]]:
        """Return the elites in order of their cells: designs, values (m,), kinds (m, 3)."""
        found = self._archive.data(["solution", "objective", "measures", "index"])
        order = np.argsort(found["index"])
        return (
            found["solution"][order].astype(np.int64),
            found["objective"][order],
            found["measures"][order].astype(np.int64),
        )

    def parents(self) -> Designs:
        """Return the parents of the designs asked for last, each once."""
        return np.unique(self._bred_of, axis=0)

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Take newer values and headings of elites; those of others are only stored."""
        super().tell(designs, values, info)
        known, objectives, found = self.elites()
        elites, newer = set(keys_of(known)), set(keys_of(designs))
        is_newer = np.array([key in newer for key in keys_of(known)], dtype=np.bool_)
        is_elite = np.array([key in elites for key in keys_of(designs)], dtype=np.bool_)
        if not is_newer.any():
            return
        self._archive.clear()
        self._archive.add(known[~is_newer], objectives[~is_newer], found[~is_newer])
        self._archive.add(designs[is_elite], values[is_elite], kinds(designs, info)[is_elite])


def kinds(designs: Designs, info: Info) -> NDArray[np.int64]:
    """Return (n_voxels, n_active, sector) of designs, shape (n, 3)."""
    dx, dy = info["displacement"][:, 0], info["displacement"][:, 1]
    is_moving = np.hypot(dx, dy) >= STILL  # False where they are NaN
    turns = np.arctan2(dy, dx) / (2 * np.pi)
    sector = np.full(len(designs), NOWHERE)
    sector[is_moving] = np.rint(turns[is_moving] * SECTORS).astype(np.int64) % SECTORS
    return np.stack(
        [(designs != ABSENT).sum(axis=1), (designs >= ACTIVE).sum(axis=1), sector], axis=1
    )
