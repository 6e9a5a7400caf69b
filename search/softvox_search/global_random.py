"""A run's own global random states, for libraries that draw from the global generators."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np
from numpy.random.mtrand import get_bit_generator, set_bit_generator

from softvox_gym.missing import PACKAGES


class GlobalRandom:
    """Generators that replace the global ones, `random` and `numpy.random`, while swapped in.

    So runs that take turns neither disturb each other nor their caller. Not for threads, which
    share the global generators. Parallel runs are processes.

    Parameters
    ----------
    rng : numpy.random.Generator
        The generator of the run; draws the seeds.

    Examples
    --------
    >>> own = GlobalRandom(np.random.default_rng(1))
    >>> with own.swapped_in():
    ...     parents = tools.selRandom(population, 50)
    """

    def __init__(self, rng: np.random.Generator) -> None:
        first, second = rng.integers(2**32, size=2).tolist()
        self._python = random.Random(first).getstate()
        self._numpy = np.random.MT19937(second)

    @contextmanager
    def swapped_in(self) -> Iterator[None]:
        """Let the global functions draw from these for a while, continuing where they stopped."""
        outside_python, outside_numpy = global_states()
        generator = get_bit_generator()
        random.setstate(self._python)
        set_bit_generator(self._numpy)  # a fifth of the cost of setting its state
        try:
            yield
        finally:
            self._python = random.getstate()
            random.setstate(outside_python)
            set_bit_generator(generator)
            if outside_numpy["has_gauss"]:  # normal numbers are made in pairs: one was left over
                np.random.set_state(outside_numpy)  # noqa: NPY002, it is meant


def global_states() -> tuple[Any, Any]:
    """Return the states of the global generators of `random` and `numpy.random`."""
    return random.getstate(), np.random.get_state(legacy=False)  # noqa: NPY002, it is meant


@contextmanager
def global_states_kept() -> Iterator[None]:
    """Put the states of the global generators back afterwards."""
    of_python, of_numpy = global_states()
    try:
        yield
    finally:
        random.setstate(of_python)
        np.random.set_state(of_numpy)  # noqa: NPY002, it is meant


def library(name: str) -> Any:
    """Import an optional library without changing the global random states.

    Raises
    ------
    ImportError
        If it is not installed; the message names what to install.
    """
    try:
        with global_states_kept():
            return import_module(name)
    except ModuleNotFoundError as error:
        if not error.name or not f"{name}.".startswith(f"{error.name}."):
            raise
        module = name.partition(".")[0]
        package = PACKAGES.get(module, module)
        raise ImportError(
            f"{package} is not installed: pip install {package}", name=package
        ) from error
