"""A searcher that follows a script, and what is told to it and to others."""

import numpy as np
from table_answers import SPACE, fitness_of, info_of, numbers, rows

from softvox_search.protocol import SearcherBase


class Script(SearcherBase):
    """Asks for given batches, one after the other, and writes down what happens to it."""

    def __init__(self, *batches, parents=()):
        super().__init__(SPACE, np.random.default_rng(0))
        self.batches = list(batches)
        self.named = list(parents)
        self.events = []

    def ask(self, n=None):
        self.events.append(("ask", n))
        return rows(*self.batches.pop(0)[:n]) if self.batches else rows()

    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        self.events.append(("tell", *told(designs, values, info)))


class ScriptWithParents(Script):
    def parents(self):
        return rows(*self.named)

    def refresh(self, designs, values, info):
        self.events.append(("refresh", *told(designs, values, info)))


def told(designs, values, info):
    assert len(designs) == len(values) == len(info["diverged"]) == len(info["displacement"])
    np.testing.assert_array_equal(info["displacement"], info_of(designs)["displacement"])
    return numbers(designs), values.tolist()


def tell(searcher, designs, values, error=np.nan):
    info = info_of(designs) | {"standard_error": np.full(len(designs), error)}
    searcher.tell(designs, np.array(values, dtype=float), info)


def to_the_end(searcher, noise, n=None):
    """Run a searcher until it asks for nothing more; all that was asked, by number, and told."""
    asked, values = [], []
    while len(designs := searcher.ask(n)):
        values.append(noise(designs))
        tell(searcher, designs, values[-1])
        asked += numbers(designs)
    return np.array(asked), np.concatenate(values)


def noisy(seed, sigma=0.3):
    rng = np.random.default_rng(seed)
    return lambda designs: fitness_of(designs) + rng.normal(0, sigma, len(designs))
