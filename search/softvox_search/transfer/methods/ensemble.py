"""Methods that hold models of the world and select among them by tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.simulation import check_count
from softvox_search.transfer.library import library
from softvox_search.transfer.protocol import Method, Test, best_first, first_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Least misfit of a model, squared voxel widths: no model counts as more exact.
LEAST_VARIANCE = 1e-3

#: How the next test is chosen.
CHOICES = ("random", "disagreement", "fittest", "both")


class Eea(Method):
    """Estimation and exploration: the models that fit all tests so far choose the next one.

    The ensemble is the part of a library of models whose displacements fit the tests best, each
    model weighted by its likelihood. Recommends the design with the best expectation over the
    ensemble, or the best tested one if its reward is higher.

    Parameters
    ----------
    choice : {"both", "disagreement", "fittest", "random"}
        The next test: the design on whose displacement the ensemble disagrees most, among the
        `fittest` designs in expectation ("both") or among all; the best in expectation; or a random
        design.
    models : {"coulomb", "coulomb_area", "all"}
        The varied parameters; see `softvox_search.transfer.library`.
    size, ensemble, fittest : int
        Number of models in the library, and in the ensemble; number of designs among which the most
        disputed is tested.

    Notes
    -----
    Sources: J. Bongard, H. Lipson, "Nonlinear system identification using coevolution of models and
    tests", IEEE TEVC 9(4), 2005; J. Bongard, V. Zykov, H. Lipson, "Resilient machines through
    continuous self-modeling", Science 314, 2006, with fifteen models; choices: A. Klaus, K. Glette,
    J. Torresen, "A comparison of sampling strategies for parameter estimation of a robot
    simulator", SAB 2012.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        choice: str = "both",
        models: str = "all",
        size: int = 40,
        ensemble: int = 15,
        fittest: int = 30,
    ) -> None:
        super().__init__(simulator, task, rng)
        if choice not in CHOICES:
            raise ValueError(f"choice must be one of {', '.join(CHOICES)}, got {choice!r}")
        check_count("ensemble", ensemble, least=1)
        check_count("fittest", fittest, least=1)
        self._library = library(simulator, models, size)
        self.varied = self._library.varied
        self._rewards = task.reward(self._library.displacement)
        self._choice, self._size, self._fittest = choice, min(ensemble, size), fittest
        self._misfit = np.zeros(size)

    @property
    def kept(self) -> NDArray[np.intp]:
        """The models of the ensemble: those with the least misfit, the first of ties."""
        return best_first(-self._misfit)[: self._size]

    @property
    def weights(self) -> Array:
        """The likelihoods of the models in the ensemble, shape (ensemble,).

        The misfit of the best model counts as normal noise of dx and dy. Equal before any test.
        """
        misfit = self._misfit[self.kept]
        variance = max(float(misfit.min()) / max(2 * len(self.tests), 1), LEAST_VARIANCE)
        weights = np.exp(-(misfit - misfit.min()) / (2 * variance))
        return np.asarray(weights / weights.sum())

    def ask(self) -> int:
        """Return the next test."""
        left = self.untested()
        if self._choice == "random":
            return int(self.rng.choice(np.flatnonzero(left)))
        expected = self._expected()
        if self._choice == "fittest":
            return first_best(expected, left)
        moved = self._library.displacement[self.kept, :, :2]
        disputed = moved.var(axis=0).sum(axis=-1)
        if self._choice == "both":
            among = np.flatnonzero(left)
            best = among[best_first(expected[among])[: self._fittest]]
            left = np.zeros(len(left), dtype=bool)
            left[best] = True
        return first_best(disputed, left)

    def tell(self, test: Test) -> None:
        """Learn the misfit of every model."""
        super().tell(test)
        off = self._library.displacement[:, test.design, :2] - test.displacement[:2]
        self._misfit += np.square(off).sum(axis=-1)

    def recommend(self) -> int:
        """Return the best design in expectation; tested designs have their measured rewards."""
        expected = self._expected()
        for test in self.tests:
            expected[test.design] = test.reward
        return first_best(expected)

    def predict(self) -> Array:
        """Return the ensemble's mean displacement."""
        return np.asarray(np.tensordot(self.weights, self._library.displacement[self.kept], 1))

    def models(self) -> Array:
        """Return the library."""
        return self._library.displacement

    def _expected(self) -> Array:
        return np.asarray(np.tensordot(self.weights, self._rewards[self.kept], 1))
