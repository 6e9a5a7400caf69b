"""Methods that hold models of the world and tell by tests which of them are right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.simulation import check_count
from softvox_search.transfer.library import library
from softvox_search.transfer.protocol import Method, Test, best_first, first_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Of what a model misses, squared voxel widths: none is taken to be more exact.
LEAST_VARIANCE = 1e-3

#: How the next test is chosen.
CHOICES = ("random", "disagreement", "fittest", "both")


class Eea(Method):
    """Estimation and exploration: the models that fit all tests so far choose the next one.

    Of a library of models an ensemble is kept, those whose displacements fit the tests best, each
    weighted by its likelihood. Builds the best design in expectation over it, or the best tested
    where that is worth more.

    Parameters
    ----------
    choice : {"both", "disagreement", "fittest", "random"}
        The next test: of the `fittest` designs in expectation the one on whose displacement the
        ensemble disagrees most; that of all designs; the best in expectation; or one drawn.
    models : {"coulomb", "coulomb_area", "all"}
        What varies; see `softvox_search.transfer.library`.
    size, ensemble, fittest : int
        Of the library; of the ensemble; designs of which the most disputed is tested.

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
        """Which models are the ensemble: those with the least misfit, the first of equal ones."""
        return best_first(-self._misfit)[: self._size]

    @property
    def weights(self) -> Array:
        """How likely the models of the ensemble are, shape (ensemble,).

        As if what the best one misses were normal noise of dx and dy; alike before any test.
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
        """Learn how far every model is off."""
        super().tell(test)
        off = self._library.displacement[:, test.design, :2] - test.displacement[:2]
        self._misfit += np.square(off).sum(axis=-1)

    def recommend(self) -> int:
        """Return the best in expectation, of which the tested have what they showed."""
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
