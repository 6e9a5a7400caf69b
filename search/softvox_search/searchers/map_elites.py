"""MAP-Elites: the fittest design of every kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from ribs.archives import GridArchive

from softvox_gym.design import ABSENT, ACTIVE, N_SITES, digits_of, indices_of
from softvox_search.generational import Generational
from softvox_search.options import share, whole
from softvox_search.protocol import Designs, Info
from softvox_search.variation import mutated, random_designs

#: Headings are told apart by so many sectors; number k is centred on k / SECTORS of a full turn
#: from +x towards +y, so that a robot that walks straight along an axis is on no boundary.
SECTORS = 8

#: The "sector" of a design without a heading.
NOWHERE = SECTORS

#: Who travels less, voxel widths, has no heading: a tenth of a millimetre.
STILL = 0.01


class MapElites(Generational):
    """Keeps the fittest design known for every (n_voxels, n_active, heading).

    The heading is the sector of a circle into which the design travels. A design that diverged or
    hardly moved (`STILL`) has none, and the cells of such designs are apart. Children are mutants
    of elites drawn uniformly, with replacement.

    Under noise, `parents` are the elites of which the present generation was bred, not all: there
    may be hundreds. One that turns out to head elsewhere moves to the cell of that heading, if it
    is fitter than who is there.

    Parameters
    ----------
    rng : numpy.random.Generator
    population : int
        Designs in a generation; those of the first are drawn at random.
    mutation : float
        Probability of each digit of a child to change; at least one always does.

    Raises
    ------
    TypeError, ValueError
        For an option that is not what it must be.

    Source
    ------
    J.-B. Mouret, J. Clune, *Illuminating search spaces by mapping elites*, arXiv:1504.04909, 2015.
    """

    def __init__(
        self, rng: np.random.Generator, *, population: int = 50, mutation: float = 1 / 8
    ) -> None:
        super().__init__(rng)
        self._size = whole("population", population)
        self._mutation = share("mutation", mutation)
        self._bred_of: Designs = np.zeros((0, N_SITES), dtype=np.int64)
        dims = (N_SITES + 1, N_SITES + 1, SECTORS + 1)
        self._archive = GridArchive(
            solution_dim=N_SITES,
            dims=dims,
            ranges=[(-0.5, n - 0.5) for n in dims],
            solution_dtype=np.int64,
            objective_dtype=np.float64,
            measures_dtype=np.float64,
        )

    def elites(self) -> tuple[Designs, NDArray[np.float64], NDArray[np.int64]]:
        """Return the elites in order of their cells: designs (m, 8), values (m,), kinds (m, 3)."""
        found = self._archive.data(["solution", "objective", "measures", "index"])
        order = np.argsort(found["index"])
        return (
            found["solution"][order],
            found["objective"][order],
            found["measures"][order].astype(np.int64),
        )

    def parents(self) -> Designs:
        """Return the elites of which the present generation was bred, each once."""
        return digits_of(np.unique(indices_of(self._bred_of)))

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Take newer values and headings for elites; others are only remembered."""
        self.values[indices_of(designs)] = values
        known, objectives, found = self.elites()
        is_newer = np.isin(indices_of(known), indices_of(designs))
        if not is_newer.any():
            return
        is_elite = np.isin(indices_of(designs), indices_of(known))
        self._archive.clear()
        self._archive.add(known[~is_newer], objectives[~is_newer], found[~is_newer])
        self._archive.add(designs[is_elite], values[is_elite], kinds(designs, info)[is_elite])

    def _initial(self) -> Designs:
        return random_designs(self._size, self.rng)

    def _breed(self) -> Designs:
        elites, _, _ = self.elites()
        self._bred_of = elites[self.rng.integers(len(elites), size=self._size)]
        return mutated(self._bred_of, self._mutation, self.rng)

    def _select(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        self._archive.add(designs, values, kinds(designs, info))


def kinds(designs: Designs, info: Info) -> NDArray[np.int64]:
    """Return (n_voxels, n_active, sector) of designs, shape (n, 3)."""
    dx, dy = info["displacement"][:, 0], info["displacement"][:, 1]
    is_moving = np.hypot(dx, dy) >= STILL  # False where they are NaN
    turns = np.arctan2(dy, dx) / (2 * np.pi)
    sector = np.full(len(designs), NOWHERE)
    sector[is_moving] = np.rint(turns[is_moving] * SECTORS).astype(np.int64) % SECTORS
    return np.stack(
        [(designs != ABSENT).sum(axis=1), (designs == ACTIVE).sum(axis=1), sector], axis=1
    )
