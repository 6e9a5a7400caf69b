"""Methods with a Gaussian process over all designs, with or without the simulator as prior."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from functools import lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.landscapes.table import LATTICE, N_DESIGNS
from softvox_gym.noise import not_negative
from softvox_search.global_random import library
from softvox_search.transfer.protocol import Method, Test, after_tests, first_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Distances from one design to all, shape (6561,).
Distances = Callable[[int], Array]


class GaussianProcess:
    """An exact Gaussian process over all designs; each test costs tests x designs operations.

    Parameters
    ----------
    mean : ndarray, shape (6561,)
        Mean before any test.
    covariance : callable (design) -> ndarray, shape (6561,)
        Covariance of a design with all.
    variance : ndarray, shape (6561,)
        Variance of each design before any test.
    noise : float
        Variance of a test's noise.

    Notes
    -----
    Source: C. Rasmussen, C. Williams, Gaussian Processes for Machine Learning, 2006, chapter 2.
    """

    def __init__(self, mean: Array, covariance: Distances, variance: Array, noise: float) -> None:
        self.mean = mean.copy()
        self.variance = variance.copy()
        self._covariance, self._noise = covariance, noise
        self._rows: list[Array] = []

    def add(self, design: int, value: float) -> None:
        """Add a value: one more row of the Cholesky factor, for all designs at once."""
        row = self._covariance(design).copy()
        for before in self._rows:
            row -= before[design] * before
        scale = sqrt(max(float(row[design]), 0.0) + self._noise)
        row /= scale
        self.mean += (value - self.mean[design]) / scale * row
        self.variance = np.maximum(self.variance - row * row, 0.0)
        self._rows.append(row)

    @property
    def deviation(self) -> Array:
        """Standard deviations, shape (6561,)."""
        return np.sqrt(self.variance)


def matern(distance: Array, length: float) -> Array:
    """Return the Matern kernel of smoothness 5/2."""
    scaled = sqrt(5) / length * distance
    return np.asarray((1 + scaled + scaled * scaled / 3) * np.exp(-scaled))


def hamming(design: int) -> Array:
    """Return the root of the share of sites in which designs differ from this one, (6561,).

    The root is a distance between points (`points`): a Matern kernel over the share itself has
    negative eigenvalues.
    """
    digits = _digits()
    return np.asarray(np.sqrt((digits != digits[design]).mean(axis=1)))


@lru_cache(maxsize=1)
def _digits() -> NDArray[np.uint8]:
    return LATTICE.digits(np.arange(N_DESIGNS))


class Ite(Method):
    """Intelligent trial and error: the simulator's rewards are the prior of a Gaussian process.

    Rewards are in units of the simulator's best. The next test is the largest upper confidence
    bound. Recommends the best tested design.

    Parameters
    ----------
    kernel : {"hamming", "behaviour"}
        Over the root of the share of sites that differ, or over the displacement in the simulator,
        dx and dy in units of the farthest travel.
    prior : {"signed", "simulated"}
        The simulator's rewards times a learnt factor, normal with mean 1 and standard deviation 1,
        so that it may change its sign; or unchanged.
    length, signal, noise, exploration : float
        Length and standard deviation of the kernel; variance of a test; number of standard
        deviations in the upper confidence bound.
    stop : float, optional
        End as soon as the best tested design reaches this share of the best expected one that can
        be tested; by default never.

    Notes
    -----
    Source: A. Cully, J. Clune, D. Tarapore, J.-B. Mouret, "Robots that can adapt like animals",
    Nature 521, 2015, with a stop at 0.9.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        kernel: str = "hamming",
        prior: str = "signed",
        length: float = 0.4,
        signal: float = 1.0,
        noise: float = 0.001,
        exploration: float = 0.05,
        stop: float | None = None,
    ) -> None:
        super().__init__(simulator, task, rng)
        if kernel not in ("hamming", "behaviour"):
            raise ValueError(f"kernel must be hamming or behaviour, got {kernel!r}")
        if prior not in ("signed", "simulated"):
            raise ValueError(f"prior must be signed or simulated, got {prior!r}")
        if not_negative("length", length) == 0:
            raise ValueError("length must be above 0, got 0")
        for name, value in (("signal", signal), ("noise", noise), ("exploration", exploration)):
            not_negative(name, value)
        said = task.reward(simulator.landscape())
        best = float(said.max())
        self._unit = best if best > 0 else 1.0
        if stop is not None:
            not_negative("stop", stop)
        self._exploration, self._stop = exploration, stop
        mean = said / self._unit
        distances = hamming if kernel == "hamming" else self._behaviour()
        share = 1.0 if prior == "signed" else 0.0

        def covariance(design: int) -> Array:
            slope = share * mean[design] * mean
            return np.asarray(signal**2 * matern(distances(design), length) + slope)

        self.process = GaussianProcess(mean, covariance, signal**2 + share * mean**2, noise)

    def ask(self) -> int | None:
        """Return the untested design with the largest upper confidence bound."""
        process = self.process
        if self._stop is not None and self.tests:
            seen = max(test.reward for test in self.tests) / self._unit
            if seen >= self._stop * float(process.mean[self.simulator.testable].max()):
                return None
        return first_best(process.mean + self._exploration * process.deviation, self.untested())

    def tell(self, test: Test) -> None:
        """Learn it."""
        super().tell(test)
        self.process.add(test.design, test.reward / self._unit)

    def predict(self) -> Array:
        """Return the mean of the process."""
        return self.process.mean * self._unit

    def deviation(self) -> Array:
        """Return the standard deviation of the process, voxel widths, shape (6561,)."""
        return self.process.deviation * self._unit

    def _behaviour(self) -> Distances:
        moved = self.simulator.landscape()[:, :2]
        moved = moved / max(float(np.hypot(*moved.T).max()), 1e-12)

        def distances(design: int) -> Array:
            return np.asarray(np.hypot(*(moved - moved[design]).T))

        return distances


class GpUcb(Method):
    """Bayesian optimisation without a simulator: a Gaussian process over the designs' digits.

    The kernel uses the distance of one-hot digits, the root of the share of sites that differ. The
    first design is drawn at random. Rewards are in units of the largest tested so far. Amplitude,
    length and noise are learnt by their marginal likelihood, with scikit-learn, after some of the
    tests. The next test is the largest upper confidence bound. Recommends the best tested design.

    Parameters
    ----------
    exploration : float
        Number of standard deviations in the upper confidence bound.
    learn_at : list of int
        Numbers of tests after which to learn.

    Notes
    -----
    Source: N. Srinivas, A. Krause, S. Kakade, M. Seeger, "Gaussian process optimization in the
    bandit setting", ICML 2010.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        exploration: float = 1.0,
        learn_at: Iterable[int] = (5, 10, 20, 40),
    ) -> None:
        super().__init__(simulator, task, rng)
        self._exploration = not_negative("exploration", exploration)
        self._learn_at = after_tests("learn_at", learn_at)
        self._variance, self._length, self._noise = 1.0, 0.4, 0.001
        self._unit = 1.0
        self.process: GaussianProcess | None = None

    def ask(self) -> int:
        """Return the untested design with the largest upper confidence bound; at first draw one."""
        if self.process is None:
            left = np.flatnonzero(self.untested())
            return int(left[self.rng.integers(len(left))])
        bound = self.process.mean + self._exploration * self.process.deviation
        return first_best(bound, self.untested())

    def tell(self, test: Test) -> None:
        """Learn the result, and after some tests the kernel."""
        super().tell(test)
        largest = max(abs(one.reward) for one in self.tests)
        is_time = len(self.tests) in self._learn_at
        if self.process is not None and largest <= self._unit and not is_time:
            self.process.add(test.design, test.reward / self._unit)
            return
        self._unit = largest or 1.0
        if is_time:
            self._learn()
        self.process = GaussianProcess(
            np.zeros(N_DESIGNS),
            lambda design: self._variance * matern(hamming(design), self._length),
            np.full(N_DESIGNS, self._variance),
            self._noise,
        )
        for one in self.tests:
            self.process.add(one.design, one.reward / self._unit)

    def predict(self) -> Array | None:
        """Return the mean of the process."""
        return None if self.process is None else self.process.mean * self._unit

    def models(self) -> None:
        """Return None: it has no models."""

    def _learn(self) -> None:
        """Fit amplitude, length and noise by scikit-learn."""
        processes = library("sklearn.gaussian_process")
        kernels = processes.kernels
        regressor = processes.GaussianProcessRegressor(
            kernels.ConstantKernel(self._variance, (0.01, 10))
            * kernels.Matern(self._length, (0.05, 5), nu=2.5)
            + kernels.WhiteKernel(self._noise, (1e-4, 1))
        )
        values = np.array([test.reward for test in self.tests]) / self._unit
        with warnings.catch_warnings():  # ignore the warning that a parameter is at its bound
            warnings.simplefilter("ignore")
            regressor.fit(points()[[test.design for test in self.tests]], values)
        found = regressor.kernel_
        self._variance, self._noise = found.k1.k1.constant_value, found.k2.noise_level
        self._length = found.k1.k2.length_scale


@lru_cache(maxsize=1)
def points() -> Array:
    """Return designs as points; the distance squared is the share of sites that differ."""
    one_hot = _digits()[:, :, np.newaxis] == np.arange(3)
    return np.asarray(one_hot.reshape(N_DESIGNS, -1) / sqrt(2 * LATTICE.sites))
