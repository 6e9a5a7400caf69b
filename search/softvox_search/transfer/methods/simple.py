"""Reference methods: chance, the simulator's order, and the truth."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task, noisy_landscape
from softvox_gym.noise import not_negative
from softvox_search.transfer.library import library
from softvox_search.transfer.protocol import Method, first_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]


class Random(Method):
    """Tests designs drawn from the untested ones; recommends the best tested."""

    def ask(self) -> int:
        """Draw a design."""
        return int(self.rng.choice(np.flatnonzero(self.untested())))

    def predict(self) -> None:
        """Return None: it has no expectations."""

    def models(self) -> None:
        """Return None: it has no models."""


class Ranked(Method):
    """Tests designs in a fixed order, the largest `score` first; recommends the best tested."""

    score: Array  #: Which a subclass computes, shape (6561,).

    def ask(self) -> int:
        """Return the best untested design."""
        return first_best(self.score, self.untested())


class SimulatorTop(Ranked):
    """Tests the simulator's best designs in order; recommends the best tested."""

    def __init__(self, simulator: Simulator, task: Task, rng: np.random.Generator) -> None:
        super().__init__(simulator, task, rng)
        self.score = task.reward(simulator.landscape())


class Jakobi(Ranked):
    """Tests the best designs on average in the noisy simulator; recommends the best tested.

    Parameters
    ----------
    level : float
        Level of the noise; see `softvox_gym.noisy_landscape`.

    Notes
    -----
    Source: N. Jakobi, P. Husbands, I. Harvey, "Noise and the reality gap", ECAL 1995.
    """

    def __init__(
        self, simulator: Simulator, task: Task, rng: np.random.Generator, *, level: float = 1.0
    ) -> None:
        super().__init__(simulator, task, rng)
        self._moved = simulator.noisy(level)
        # The mean distance under noise exceeds the distance of the mean displacement.
        is_directed = task.heading is not None
        self.score = task.reward(self._moved) if is_directed else noisy_landscape(level)["mean"]

    def predict(self) -> Array:
        """Return the score."""
        return self.score

    def models(self) -> Array:
        """Return the mean of the noisy simulators."""
        return self._moved[np.newaxis]


class DomainRandomisation(Ranked):
    """Tests the best designs over an ensemble of models; recommends the best tested.

    Parameters
    ----------
    models : {"coulomb", "coulomb_area", "all"}
        The varied parameters; see `softvox_search.transfer.library`.
    size : int
        Size of the ensemble.
    tail : float, optional
        Designs are judged by the mean over this share of the models, those in which they do worst
        (the conditional value at risk); by default by the mean over all.

    Notes
    -----
    Source: A. Rajeswaran et al., "EPOpt: learning robust neural network policies using model
    ensembles", ICLR 2017, with a tail of 0.1.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        models: str = "all",
        size: int = 40,
        tail: float | None = None,
    ) -> None:
        super().__init__(simulator, task, rng)
        if tail is not None and not 0 < not_negative("tail", tail) <= 1:
            raise ValueError(f"tail must be a share above 0 and at most 1, got {tail!r}")
        self._library = library(simulator, models, size)
        self.varied = self._library.varied
        rewards = task.reward(self._library.displacement)
        if tail is not None:
            rewards = np.sort(rewards, axis=0)[: max(1, round(tail * size))]
        self.score = rewards.mean(axis=0)

    def predict(self) -> Array:
        """Return the mean displacement over all models."""
        return np.asarray(self._library.displacement.mean(axis=0))

    def models(self) -> Array:
        """Return the ensemble."""
        return self._library.displacement


class Oracle(Method):
    """Knows the truth, which no other method gets: the upper bound."""

    #: Reward of every design in reality, shape (6561,).
    truth: Any = None

    def ask(self) -> int:
        """Return the best untested design."""
        return first_best(self.truth, self.untested())

    def predict(self) -> Array:
        """Return the truth; 0 for designs that nobody measured."""
        truth: Array = np.nan_to_num(self.truth)
        return truth

    def models(self) -> None:
        """Return None: it needs none."""
