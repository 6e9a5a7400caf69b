"""CatCMA, as a searcher."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_search.adapter import Adapter
from softvox_search.global_random import library
from softvox_search.protocol import Designs


class CatCma(Adapter):
    """CatCMA with margin, restarted on convergence.

    This is the one of the ``cmaes`` library's two variants that works without continuous variables.
    It has no stopping rule for categorical ones, so here a generation without a new design counts
    as converged, and the distribution is reset to uniform.

    Raises
    ------
    ImportError
        If cmaes is not installed.

    Source: Hamano, Saito, Nomura, Uchida & Shirakawa, *CatCMA: stochastic optimization for
    mixed-category problems*, GECCO 2024; https://github.com/CyberAgentAILab/cmaes.
    """

    def _start(self) -> None:
        self._optimiser = library("cmaes").CatCMAwM(
            c_space=[self.space.states] * self.space.sites, seed=self._seed()
        )
        self._generation: list[tuple[Any, float]] = []
        self._has_news = False

    def _propose(self, n: int | None) -> Designs:
        left = self._optimiser.population_size - len(self._generation)
        batch = left if n is None else min(n, left)
        self._proposed = [self._optimiser.ask() for _ in range(batch)]
        return np.array([solution.c.argmax(axis=1) for solution in self._proposed])

    def _learn(self, designs: Designs, values: NDArray[np.float64]) -> None:
        self._has_news |= bool(np.isnan(self.known(designs)).any())
        self._generation += zip(self._proposed, (-values).tolist(), strict=False)
        if len(self._generation) < self._optimiser.population_size:
            return
        self._optimiser.tell(self._generation)
        if self._has_news:
            self._generation, self._has_news = [], False
        else:
            self._start()
