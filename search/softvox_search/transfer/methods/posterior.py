"""A method that learns to infer the physics from test results, by simulating the tests."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Task
from softvox_gym.simulation import check_count
from softvox_search.torch_random import own_torch, quiet_library
from softvox_search.transfer.library import SHARES, SHARES_OF
from softvox_search.transfer.methods.identification import Identification
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Voxel widths; if all models agree on a design, a test counts as no more exact than this.
LEAST_SPREAD = 0.02

#: Test results are clipped to this many standard deviations of the models' predictions.
MOST_DEVIATIONS = 4.0

#: Training: models in a batch, most epochs, most epochs without gain, learning rate.
BATCH, EPOCHS, PATIENCE, RATE = 64, 200, 20, 5e-3


class Npe(Identification):
    """Neural posterior estimation: a network infers the physics from the test results.

    Models are drawn from the prior once. At every fit the tested designs are simulated under each,
    and a conditional density estimator of sbi learns the models' shares from dx and dy of these
    designs. Models drawn from its posterior, given the test results, judge designs. A tenth of the
    models is held out and decides when to stop.

    Parameters
    ----------
    draws : int
        Number of models drawn from the prior, at least 20.
    particles : int
        Number of models drawn from the posterior; values beyond the prior's range are clipped.
    estimator : str
        An estimator of sbi: "maf", "mdn", "nsf", "made".
    models, fit_at, candidates
        As in `Identification`.

    Raises
    ------
    ImportError
        If sbi is not installed.

    Notes
    -----
    Sources: F. Ramos, R. Possas, D. Fox, "BayesSim: adaptive domain randomization via probabilistic
    inference for robotics simulators", RSS 2019, with a mixture density network ("mdn"); sbi: A.
    Tejero-Cantero et al., JOSS 5(52), 2020. In one round: all models are of the prior.
    """

    def __init__(
        self,
        simulator: Simulator,
        task: Task,
        rng: np.random.Generator,
        *,
        draws: int = 256,
        particles: int = 12,
        estimator: str = "maf",
        models: str = "coulomb_area",
        fit_at: Iterable[int] = (5, 20),
        candidates: int = 400,
    ) -> None:
        super().__init__(simulator, task, rng, models=models, fit_at=fit_at, candidates=candidates)
        check_count("draws", draws, least=20)
        check_count("particles", particles, least=1)
        self._nets = quiet_library("sbi.neural_nets")
        self._particles, self._estimator = particles, estimator
        self._drawn = rng.random((draws, SHARES))
        self._said = np.zeros((draws, 0, 2))  # dx, dy by model and test

    def fit(self) -> Array:
        """Learn from simulations of the tests; return models of the posterior, (particles, 8)."""
        new = np.array([test.design for test in self.tests[self._said.shape[1] :]])
        said = self.simulate(self._drawn, new)[..., :2]
        self._said = np.concatenate([self._said, said], axis=1)
        seen = np.array([test.displacement[:2] for test in self.tests])
        matter = SHARES_OF[self._class]
        shares = np.full((self._particles, SHARES), 0.5)
        shares[:, :matter] = self._posterior(self._drawn[:, :matter], *_scaled(self._said, seen))
        return shares

    def _posterior(self, theta: Array, x: Array, seen: Array) -> Array:
        """Return draws of the posterior of theta, shape (particles, k), given the observations."""
        with own_torch(self.rng) as torch:
            given, known = torch.as_tensor(theta), torch.as_tensor(x)
            held = max(2, len(theta) // 10)
            build = self._nets.posterior_nn(
                self._estimator, z_score_x="none", hidden_features=32, num_transforms=3
            )
            net = build(given[held:], known[held:])
            optimiser = torch.optim.Adam(net.parameters(), lr=RATE)
            least, epoch_of, best = np.inf, 0, net.state_dict()
            for epoch in range(EPOCHS):
                for batch in (torch.randperm(len(given) - held) + held).split(BATCH):
                    optimiser.zero_grad()
                    net.loss(given[batch], known[batch]).mean().backward()
                    torch.nn.utils.clip_grad_norm_(net.parameters(), 5.0)
                    optimiser.step()
                with torch.no_grad():
                    loss = float(net.loss(given[:held], known[:held]).mean())
                if loss < least:
                    best = {name: value.clone() for name, value in net.state_dict().items()}
                    least, epoch_of = loss, epoch
                elif epoch - epoch_of >= PATIENCE:
                    break
            net.load_state_dict(best)
            with torch.no_grad():
                drawn = net.sample((self._particles,), condition=torch.as_tensor(seen)[None])
            return np.asarray(np.clip(drawn[:, 0].numpy(), 0.0, 1.0))


def _scaled(said: Array, seen: Array) -> tuple[Array, Array]:
    """Return predictions and observations in standard deviations of the models, flat."""
    mean = said.mean(axis=0)
    scale = np.maximum(said.std(axis=0), LEAST_SPREAD)
    limit = MOST_DEVIATIONS
    x, y = (np.clip((one - mean) / scale, -limit, limit) for one in (said, seen))
    return x.reshape(len(x), -1), y.reshape(-1)
