"""Searchers that breed a generation, wait until all of it is told, and then select."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import N_SITES, digits_of, indices_of
from softvox_search.protocol import Designs, Info, SearcherBase
from softvox_search.variation import Individual, digits


class Generational(SearcherBase):
    """Hands out a generation in pieces as asked, and selects when the last piece is told.

    A subclass says how the first generation is made (`_initial`), how a later one is bred
    (`_breed`), and what becomes of one that was evaluated (`_select`). Everything that it
    remembers must be in attributes that can be copied: they are its state.

    Asking again before telling gives the same designs again. Where fewer are told than were asked
    for, the next `ask` begins with those left.

    Parameters
    ----------
    rng : numpy.random.Generator
        The run's own.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(rng)
        self._generation = 0
        self._queue: Designs = np.zeros((0, N_SITES), dtype=np.int64)
        self._told: list[tuple[Designs, NDArray[np.float64], Info]] = []

    def ask(self, n: int | None = None) -> Designs:
        """Return what is left of the generation, at most n; of the next where none is left."""
        if len(self._queue) == 0:
            self._queue = self._initial() if self._generation == 0 else self._breed()
            self._generation += 1
        return self._queue[:n].copy()

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Remember the values, and select once all of the generation is told.

        Raises
        ------
        ValueError
            For designs that were not asked for, or a value that is NaN: it is neither better nor
            worse than any other, so that no selection would ever remove it.
        """
        if not np.array_equal(designs, self._queue[: len(designs)]):
            raise ValueError("tell must get the designs that ask returned, in that order")
        if np.isnan(values).any():
            raise ValueError("values told must be numbers, got NaN; a diverged design is worth 0")
        super().tell(designs, values, info)
        self._told.append((designs, values, info))
        self._queue = self._queue[len(designs) :]
        if len(self._queue) == 0:
            told, self._told = self._told, []
            self._select(*_joined(told))

    def parents(self) -> Designs:
        """Return the designs whose values the next selection relies on beside the offspring's.

        Returns
        -------
        ndarray of int64, shape (m, 8)
            Each once, in order of their numbers.
        """
        return digits_of(np.unique(indices_of(digits(self._carried()))))

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Take newer values for parents, as `tell` does for offspring; no selection follows."""
        super().tell(designs, values, info)
        newer = dict(zip(map(tuple, designs.tolist()), values.tolist(), strict=True))
        for individual in self._carried():
            individual.value = newer.get(tuple(individual), individual.value)

    def _carried(self) -> Sequence[Individual]:
        """Return the individuals that compete again in the next selection."""
        return ()

    def _initial(self) -> Designs:
        """Return the first generation."""
        raise NotImplementedError(f"{type(self).__name__} must have an _initial()")

    def _breed(self) -> Designs:
        """Return the next generation."""
        raise NotImplementedError(f"{type(self).__name__} must have a _breed()")

    def _select(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Decide what becomes of a generation, in the order in which it was made."""
        raise NotImplementedError(f"{type(self).__name__} must have a _select(...)")


def _joined(
    told: list[tuple[Designs, NDArray[np.float64], Info]],
) -> tuple[Designs, NDArray[np.float64], Info]:
    """Return what was told in pieces as one."""
    if len(told) == 1:
        return told[0]
    designs, values, infos = zip(*told, strict=True)
    columns: dict[str, Any] = {
        name: np.concatenate([cast(Any, info)[name] for info in infos]) for name in infos[0]
    }
    return np.concatenate(designs), np.concatenate(values), cast(Info, columns)
