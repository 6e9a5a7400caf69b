"""Optuna's tree-structured Parzen estimator, as a searcher."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_search.adapter import Adapter
from softvox_search.global_random import library
from softvox_search.protocol import Designs


class Tpe(Adapter):
    """Optuna's TPE sampler, over one categorical variable per site.

    Its settings are the defaults. It asks for one design at a time, including known ones. Its cost
    per evaluation grows with the number of evaluations.

    Raises
    ------
    ImportError
        If optuna is not installed.

    Source: Bergstra, Bardenet, Bengio & Kegl, *Algorithms for hyper-parameter optimization*,
    NeurIPS 2011; https://optuna.org.
    """

    def _start(self) -> None:
        optuna = library("optuna")
        digit = optuna.distributions.CategoricalDistribution(range(self.space.states))
        self._digits = {f"site_{i}": digit for i in range(self.space.sites)}
        with _quiet(optuna):
            self._study = optuna.create_study(
                direction="maximize", sampler=optuna.samplers.TPESampler(seed=self._seed())
            )

    def _propose(self, n: int | None) -> Designs:
        self._trial = self._study.ask(self._digits)
        return np.array([[self._trial.params[site] for site in self._digits]])

    def _learn(self, designs: Designs, values: NDArray[np.float64]) -> None:
        self._study.tell(self._trial, float(values[0]))


@contextmanager
def _quiet(optuna: Any) -> Iterator[None]:
    """Suppress the announcement of a new study, and restore the user's verbosity."""
    verbosity = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(max(verbosity, optuna.logging.WARNING))
    try:
        yield
    finally:
        optuna.logging.set_verbosity(verbosity)
