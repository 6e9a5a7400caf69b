"""A searcher that follows a script, and what is told to it and to others."""

import numpy as np
from table_answers import FITNESS, info_of

from softvox_gym.design import digits_of, indices_of
from softvox_search.protocol import SearcherBase


class Script(SearcherBase):
    """Asks for given batches, one after the other, and writes down what happens to it."""

    def __init__(self, *batches, parents=()):
        super().__init__(np.random.default_rng(0))
        self.batches = list(batches)
        self.named = list(parents)
        self.events = []

    def ask(self, n=None):
        self.events.append(("ask", n))
        return np.array(self.batches.pop(0)[:n]) if self.batches else np.zeros((0, 8), int)

    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        self.events.append(("tell", *told(designs, values, info)))


class ScriptWithParents(Script):
    def parents(self):
        return digits_of(np.array(self.named, dtype=int))

    def refresh(self, designs, values, info):
        self.events.append(("refresh", *told(designs, values, info)))


def told(designs, values, info):
    assert len(designs) == len(values) == len(info["status"]) == len(info["displacement"])
    np.testing.assert_array_equal(info["displacement"], info_of(designs)["displacement"])
    return indices_of(designs).tolist(), values.tolist()


def tell(guarded, designs, values, error=np.nan):
    info = info_of(designs) | {"standard_error": np.full(len(designs), error)}
    guarded.tell(designs, np.array(values, dtype=float), info)


def numbers(designs):
    return indices_of(designs).tolist()


def to_the_end(guarded, noise, n=None):
    """Run a searcher until it asks for nothing more; all that was asked, by number, and told."""
    asked, values = [], []
    while len(designs := guarded.ask(n)):
        values.append(noise(designs))
        tell(guarded, designs, values[-1])
        asked.append(indices_of(designs))
    return np.concatenate(asked), np.concatenate(values)


def exact(designs):
    return FITNESS[indices_of(designs)]


def noisy(seed, sigma=0.3):
    rng = np.random.default_rng(seed)
    return lambda designs: exact(designs) + rng.normal(0, sigma, len(designs))
