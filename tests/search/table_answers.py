"""What a searcher is told in tests: the exact table's answers, noise on them where wanted."""

import numpy as np

from softvox_gym import landscape
from softvox_gym.design import indices_of

TABLE = landscape()
FITNESS = TABLE["fitness"]
DISPLACEMENT = np.stack([TABLE["dx"], TABLE["dy"], TABLE["dz"]], axis=1)


def info_of(designs):
    """What is told of designs beside their exact values."""
    indices = indices_of(designs)
    return {
        "displacement": DISPLACEMENT[indices],
        "status": TABLE["status"][indices],
        "standard_error": np.zeros(len(indices)),
    }


def answered(searcher, n=None):
    """Ask for at most n designs, tell their exact values, and return the designs."""
    designs = searcher.ask(n)
    searcher.tell(designs, FITNESS[indices_of(designs)], info_of(designs))
    return designs


class NoisyTable:
    """The table with Gaussian noise on it, a fresh draw for every evaluation."""

    def __init__(self, sigma, seed):
        self.sigma = sigma
        self.rng = np.random.default_rng(seed)

    def answered(self, searcher, n=None):
        """Ask for at most n designs, tell noisy values, and return the designs and values."""
        designs = searcher.ask(n)
        values = FITNESS[indices_of(designs)] + self.rng.normal(0, self.sigma, len(designs))
        searcher.tell(designs, values, info_of(designs) | {"standard_error": values * np.nan})
        return designs, values
