"""Methods that fit the parameters of the simulator to the tests, and search the fitted one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.noise import not_negative
from softvox_gym.simulation import check_count
from softvox_search.transfer.library import CLASSES, SHARES, check_class, physics_at
from softvox_search.transfer.protocol import Method, Test, after_tests, half_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]


class Identification(Method):
    """Fits models after some of the tests, and judges candidates by the mean over the models.

    Candidates are testable designs: half of them the best in the nominal simulator, the others
    drawn at random. The next test, and the recommendation, is the best candidate in expectation;
    tested designs count with their measured rewards. Before the first fit the simulator's order
    decides. A subclass has `fit`.

    Parameters
    ----------
    models : {"coulomb", "coulomb_area", "all"}
        The fitted parameters; see `softvox_search.transfer.library`.
    fit_at : list of int
        Numbers of tests after which to fit.
    candidates : int
        Number of designs that are simulated under the fitted models.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        models: str = "coulomb_area",
        fit_at: Iterable[int] = (1, 5, 10, 20),
        candidates: int = 400,
    ) -> None:
        super().__init__(simulator, task, rng)
        check_count("candidates", candidates, least=1)
        self.varied = CLASSES[check_class(models)]
        self._class, self._fit_at = models, after_tests("fit_at", fit_at)
        moved = simulator.landscape()
        self._candidates = half_best(task.reward(moved), candidates, rng, self.untested())
        self._expected = moved[self._candidates]

    def fit(self) -> Array:
        """Return the fitted models as shares of the prior's ranges, shape (models, 8)."""
        raise NotImplementedError(f"{type(self).__name__} must have a fit()")

    def ask(self) -> int | None:
        """Return the candidate that is best in expectation; None if all were tested."""
        reward = np.round(self.task.reward(self._expected), 9)
        reward[~self.untested()[self._candidates]] = -np.inf
        best = int(np.argmax(reward))
        return None if np.isneginf(reward[best]) else int(self._candidates[best])

    def tell(self, test: Test) -> None:
        """Learn the result, and fit if it is time."""
        super().tell(test)
        if len(self.tests) in self._fit_at:
            self._expected = self.simulate(self.fit(), self._candidates).mean(axis=0)

    def recommend(self) -> int:
        """Return the best design in expectation; tested designs have their measured rewards."""
        best = super().recommend()
        seen = max(test.reward for test in self.tests)
        asked = self.ask()
        if asked is None:
            return best
        expected = self.task.reward(self._expected[self._candidates == asked])[0]
        return asked if expected > seen else best

    def predict(self) -> Any:
        """Return None: it has expectations only for the candidates."""

    def models(self) -> Any:
        """Return None: its models do not cover most designs."""

    def simulate(self, shares: Array, designs: Any) -> Array:
        """Return the displacement of designs under models, all in one batch.

        Of one model, shares of shape (8,), the shape is (n, 3); of several, (models, 8), it is
        (models, n, 3).
        """
        nominal, n = self.simulator.nominal, len(designs)
        models = [physics_at(one, nominal, self._class) for one in np.atleast_2d(shares)]
        varied: dict[str, Any] = {
            name: np.repeat([getattr(one, name) for one in models], n)
            for name in (*self.varied, "duration")
        }
        moved = self.simulator.displacement(
            np.tile(designs, len(models)), replace(nominal, **varied)
        )
        return moved.reshape(*np.shape(shares)[:-1], n, 3)

    def misfit(self, shares: Array) -> Array:
        """Return the mean squared misfit of models over all tests, voxel widths.

        A number of one model, shares of shape (8,); shape (models,) of several.
        """
        tested = np.array([test.design for test in self.tests])
        seen = np.array([test.displacement for test in self.tests])
        off = self.simulate(shares, tested) - seen
        return np.asarray(np.square(off[..., :2]).sum(axis=-1).mean(axis=-1))


class SimOpt(Identification):
    """A normal distribution over the parameters, moved towards the results of the tests.

    At every fit, models are drawn and weighted by their misfit, as far as the divergence from the
    previous distribution allows. The new distribution is that of the weighted models, and its mean
    is the model that judges designs.

    Parameters
    ----------
    draws, rounds : int
        Number of models drawn in a round, and of rounds in a fit.
    divergence : float
        The largest Kullback-Leibler divergence of a round.
    models, fit_at, candidates
        As in `Identification`.

    Notes
    -----
    Source: Y. Chebotar et al., "Closing the sim-to-real loop: adapting simulation randomization
    with real world experience", ICRA 2019.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        draws: int = 16,
        rounds: int = 2,
        divergence: float = 1.0,
        models: str = "coulomb_area",
        fit_at: Iterable[int] = (1, 5, 10, 20),
        candidates: int = 400,
    ) -> None:
        super().__init__(simulator, task, rng, models=models, fit_at=fit_at, candidates=candidates)
        check_count("draws", draws, least=2)
        check_count("rounds", rounds, least=1)
        if not_negative("divergence", divergence) == 0:
            raise ValueError("divergence must be above 0, got 0")
        self._draws, self._rounds, self._divergence = draws, rounds, divergence
        self._mean, self._covariance = np.full(SHARES, 0.5), np.eye(SHARES) * 0.3**2

    def fit(self) -> Array:
        """Move the distribution; return its mean, shape (1, 8)."""
        for _ in range(self._rounds):
            normal = self.rng.standard_normal((self._draws, SHARES))
            drawn = self._mean + normal @ np.linalg.cholesky(self._covariance).T
            drawn = np.clip(drawn, 0.0, 1.0)
            weight = weights(self.misfit(drawn), self._divergence)
            self._mean = weight @ drawn
            off = drawn - self._mean
            self._covariance = (off * weight[:, np.newaxis]).T @ off + 1e-4 * np.eye(SHARES)
        return self._mean[np.newaxis]


def weights(cost: Array, divergence: float) -> Array:
    """Return weights that fall with cost, as far from equal weights as the divergence allows.

    They are exp(-cost / temperature), with the lowest temperature that keeps the Kullback-Leibler
    divergence from equal weights.

    Notes
    -----
    Source: J. Peters, K. Mulling, Y. Altun, "Relative entropy policy search", AAAI 2010.
    """
    scaled = (cost - cost.min()) / max(float(np.ptp(cost)), 1e-12)

    def at(log_temperature: float) -> Array:
        made = np.exp(-scaled / np.exp(log_temperature))
        return np.asarray(made / made.sum())

    low, high = -10.0, 10.0
    for _ in range(60):
        middle = (low + high) / 2
        made = at(middle)
        spread = float((made * np.log(np.maximum(made * len(cost), 1e-300))).sum())
        low, high = (middle, high) if spread > divergence else (low, middle)
    return at(high)
