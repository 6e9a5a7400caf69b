"""What a searcher is told in tests: the exact table's answers, noise on them where wanted."""

import numpy as np

from softvox_gym import Lattice, landscape

SPACE = Lattice()
TABLE = landscape()
FITNESS = np.asarray(TABLE["fitness"])
DISPLACEMENT = np.stack([TABLE["dx"], TABLE["dy"], TABLE["dz"]], axis=1)


def rows(*numbers):
    """Designs of the 2x2x2 lattice, given by their numbers."""
    return SPACE.digits(np.array(numbers, dtype=np.int64)).astype(np.int64)


def numbers(designs):
    return SPACE.numbers(designs).tolist()


def fitness_of(designs):
    return FITNESS[SPACE.numbers(designs)]


def info_of(designs):
    """What is told of designs beside their exact values."""
    indices = SPACE.numbers(designs)
    return {
        "displacement": DISPLACEMENT[indices],
        "diverged": np.asarray(TABLE["diverged"][indices]),
        "standard_error": np.zeros(len(indices)),
    }


def answered(searcher, n=None):
    """Ask for at most n designs, tell their exact values, and return the designs."""
    designs = searcher.ask(n)
    searcher.tell(designs, fitness_of(designs), info_of(designs))
    return designs


class NoisyTable:
    """The table with Gaussian noise on it, a fresh draw for every evaluation."""

    def __init__(self, sigma, seed):
        self.sigma = sigma
        self.rng = np.random.default_rng(seed)

    def answered(self, searcher, n=None):
        """Ask for at most n designs, tell noisy values, and return the designs and values."""
        designs = searcher.ask(n)
        values = fitness_of(designs) + self.rng.normal(0, self.sigma, len(designs))
        searcher.tell(designs, values, info_of(designs) | {"standard_error": values * np.nan})
        return designs, values


def made_up(designs):
    """Values and info on any lattice, for searchers that only need some landscape."""
    site = np.arange(designs.shape[1])
    weights = np.stack([site - len(site) // 2, site**2 % 7 - 3, site], axis=1)
    heading = (designs @ weights).astype(float)  # exact, however many at a time
    info = {
        "displacement": heading,
        "diverged": np.zeros(len(designs), dtype=bool),
        "standard_error": np.zeros(len(designs)),
    }
    return np.hypot(heading[:, 0], heading[:, 1]), info
