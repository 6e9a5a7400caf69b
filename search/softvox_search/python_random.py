"""A state of Python's global `random` of a run's own, for libraries that draw from there."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np


class PythonRandom:
    """Lends a run's own random state to the global `random` for the length of a `with` block.

    DEAP's operators draw from the global `random`. Within the block they draw from this run's
    stream; after it, also where the block raised, the global state is what it was before, and the
    next block goes on where this one ended. So runs that take turns neither disturb each other nor
    their caller, and a run that is copied or pickled continues with the same draws.

    Not for threads: the global `random` is one for all of them. Runs in parallel are processes.

    Parameters
    ----------
    rng : numpy.random.Generator
        The run's own; the seed is drawn from it.

    Examples
    --------
    >>> stream = PythonRandom(np.random.default_rng(1))
    >>> with stream.swapped_in():
    ...     parents = tools.selRandom(population, 50)
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._state = random.Random(int.from_bytes(rng.bytes(32), "little")).getstate()

    @contextmanager
    def swapped_in(self) -> Iterator[None]:
        """Put this state in the place of the global one until the block ends."""
        callers = random.getstate()
        random.setstate(self._state)
        try:
            yield
        finally:
            self._state = random.getstate()
            random.setstate(callers)
