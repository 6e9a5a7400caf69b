"""A method with a Gaussian process over simulator and reality, two fidelities of one function."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.landscapes.table import LATTICE, N_DESIGNS
from softvox_gym.simulation import check_count
from softvox_search.torch_random import own_torch, quiet_library
from softvox_search.transfer.methods.gaussian import points
from softvox_search.transfer.protocol import Method, Test, after_tests, first_best, half_best
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Fidelities: of the simulator, and of reality, the target.
SIMULATED, REAL = 0.0, 1.0


class Mfbo(Method):
    """Multi-fidelity Bayesian optimisation: the simulator is a cheap approximation of reality.

    A Gaussian process of botorch over one-hot digits and the fidelity learns from the tests and
    from some designs in the simulator, which are known from the start because they cost nothing.
    Its parameters are learnt by their marginal likelihood, after some of the tests. The next test
    is the candidate with the most information about the largest reward in reality. Recommends the
    best tested design. The kernel has no negative correlation, so simulator and reality are assumed
    to agree in sign.

    Parameters
    ----------
    simulated, candidates : int
        Number of designs whose simulation it learns from, and of designs that it may test, among
        the testable ones: half of each the best in the simulator, half drawn from the others.
    learn_at : list of int
        Numbers of tests after which to learn.
    noise : float
        Variance of a test and of a simulation, in units of the simulator's best reward squared.
    iterations : int
        Most iterations of the optimiser that learns the parameters.

    Raises
    ------
    ImportError
        If botorch is not installed.

    Notes
    -----
    Sources: S. Takeno et al., "Multi-fidelity Bayesian optimization with max-value entropy search
    and its parallelization", ICML 2020; kernel: J. Wu et al., "Practical multi-fidelity Bayesian
    optimization for hyperparameter tuning", UAI 2019; botorch: M. Balandat et al., NeurIPS 2020.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        simulated: int = 200,
        candidates: int = 300,
        learn_at: Iterable[int] = (0, 1, 5, 10, 20),
        noise: float = 0.001,
        iterations: int = 50,
    ) -> None:
        super().__init__(simulator, task, rng)
        check_count("simulated", simulated, least=2)
        check_count("candidates", candidates, least=2)
        learnt = after_tests("learn_at", learn_at, least=0)
        self._botorch, self._gpytorch = quiet_library("botorch"), quiet_library("gpytorch")
        self._learn_at, self._noise, self._iterations = learnt, noise, iterations
        said = task.reward(simulator.landscape())
        self._unit = max(float(said.max()), 1e-9)
        shown = half_best(said, simulated, rng)
        self._candidates = np.sort(half_best(said, candidates, rng, self.untested()))
        self._x, self._y = _at(shown, SIMULATED), said[shown] / self._unit
        self._learnt: Any = None  # the parameters, as of the last ask

    def ask(self) -> int | None:
        """Return the most informative candidate; None if all were tested."""
        among = self._candidates[self.untested()[self._candidates]]
        if not len(among):
            return None
        with own_torch(self.rng) as torch:
            process = self._process(torch)
            self._learnt = process.state_dict()
            real = torch.as_tensor(_at(among, REAL))
            with torch.no_grad():
                search = self._botorch.acquisition.qMultiFidelityMaxValueEntropy(process, real)
                gain = search(real[:, None])
            return int(among[first_best(gain.numpy())])

    def tell(self, test: Test) -> None:
        """Learn the result."""
        super().tell(test)
        self._x = np.concatenate([self._x, _at(np.array([test.design]), REAL)])
        self._y = np.append(self._y, test.reward / self._unit)

    def predict(self) -> Array:
        """Return the mean of the process in reality."""
        with own_torch(np.random.default_rng(0)) as torch:  # asks don't depend on it
            process = self._process(torch)
            # In parts, because memory grows with the square.
            parts = torch.as_tensor(_at(np.arange(N_DESIGNS), REAL)).split(300)
            with torch.no_grad(), self._gpytorch.settings.skip_posterior_variances():
                mean = torch.cat([process.posterior(part).mean[:, 0] for part in parts])
            return np.asarray(mean.numpy() * self._unit)

    def models(self) -> None:
        """Return None: it has no models."""

    def _process(self, torch: Any) -> Any:
        """Return the process given all data; learn its parameters if it is time."""
        x, y = torch.as_tensor(self._x), torch.as_tensor(self._y)[:, None]
        noise = torch.full_like(y, self._noise)
        kind = self._botorch.models.SingleTaskMultiFidelityGP
        process = kind(x, y, noise, data_fidelities=[x.shape[1] - 1], outcome_transform=None)
        if self._learnt is not None:
            process.load_state_dict(self._learnt)
        if len(self.tests) in self._learn_at:
            likelihood = self._gpytorch.mlls.ExactMarginalLogLikelihood(process.likelihood, process)
            options = {"options": {"maxiter": self._iterations}}
            self._botorch.fit.fit_gpytorch_mll(likelihood, optimizer_kwargs=options)
        return process.eval()


def _at(designs: NDArray[np.intp], fidelity: float) -> Array:
    """Return designs at a fidelity as points, shape (n, 25)."""
    # One-hot digits of 0 and 1, the cube for which botorch's priors of the lengths are made.
    one_hot = points()[designs] * sqrt(2 * LATTICE.sites)
    return np.column_stack([one_hot, np.full(len(designs), fidelity)])
