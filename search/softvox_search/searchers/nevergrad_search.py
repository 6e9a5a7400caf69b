"""Nevergrad's optimisers, as searchers."""

from __future__ import annotations

from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_search.adapter import Adapter
from softvox_search.global_random import library
from softvox_search.protocol import Designs


class Nevergrad(Adapter):
    """An optimiser of Nevergrad, over a choice of one digit per site.

    Asks for one design at a time, including known ones. The choices are ``TransitionChoice``, as
    Nevergrad's documentation recommends for discrete variables; ``Choice`` has a weight per digit
    and samples by it, which here left the discrete optimisers no better than random search.

    Parameters
    ----------
    optimizer : str
        A name in ``nevergrad.optimizers.registry``. The default is the one that Nevergrad's
        documentation recommends for these variables; it ignores the order of the digits. It gets no
        budget, so optimisers that need one do not work.

    Raises
    ------
    ImportError
        If nevergrad is not installed.
    ValueError
        If Nevergrad has no such optimizer.

    Source: https://facebookresearch.github.io/nevergrad/machinelearning.html
    """

    def __init__(
        self,
        space: Lattice,
        rng: np.random.Generator,
        *,
        optimizer: str = "PortfolioDiscreteOnePlusOne",
    ) -> None:
        self.optimizer = optimizer
        super().__init__(space, rng)

    def _start(self) -> None:
        nevergrad = library("nevergrad")
        known = nevergrad.optimizers.registry
        if self.optimizer not in known:
            near = get_close_matches(str(self.optimizer), known, n=5, cutoff=0)
            raise ValueError(
                f"optimizer {self.optimizer!r} is none of Nevergrad's; near it are "
                f"{', '.join(near)}; all are in nevergrad.optimizers.registry"
            )
        states = list(range(self.space.states))
        digits = nevergrad.p.TransitionChoice(states, repetitions=self.space.sites)
        digits.random_state = np.random.RandomState(self._seed())
        self._optimiser = known[self.optimizer](digits)

    def _propose(self, n: int | None) -> Designs:
        self._candidate = self._optimiser.ask()
        return np.array([self._candidate.value])

    def _learn(self, designs: Designs, values: NDArray[np.float64]) -> None:
        self._optimiser.tell(self._candidate, -float(values[0]))
