"""Searchers around foreign optimisers: resumed by replay, with random numbers of their own."""

from __future__ import annotations

import random
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.random.mtrand import get_bit_generator, set_bit_generator
from numpy.typing import NDArray

from softvox_gym.design import indices_of
from softvox_search.protocol import Designs, Info, SearcherBase, State


class Replayed(SearcherBase):
    """A base for searchers that ask an optimiser of another library.

    Such an optimiser's state may lie anywhere. What it does next is yet determined by its seed and
    by what it was asked and told. So the state of this searcher is just that, and going on means to
    replay it, which takes as long as the optimiser took. Every call of the optimiser finds the
    global random states of Python and NumPy replaced by its own, which are seeded from the run's
    generator: optimisers that draw from those neither disturb others nor are disturbed.

    A searcher on it has `_start`, `_propose` and `_learn`. Options are set before
    ``super().__init__(rng)``, which calls `_start`.

    Parameters
    ----------
    rng : numpy.random.Generator
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._begin(rng)

    @abstractmethod
    def _start(self) -> None:
        """Make the optimiser, all its seeds by `_seed`."""

    @abstractmethod
    def _propose(self, n: int | None) -> Designs:
        """Return designs of the optimiser, at most n, shape (m, 8)."""

    @abstractmethod
    def _learn(self, designs: Designs, values: NDArray[np.float64]) -> None:
        """Tell the optimiser; `values` of the searcher still holds what was known before."""

    def ask(self, n: int | None = None) -> Designs:
        """Return what the optimiser proposes, at most n designs, shape (m, 8)."""
        with self._globals.swapped_in():
            designs = self._propose(n)
        self._history.append(_Asked(n, indices_of(designs)))
        return designs

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Tell the optimiser, and remember the values."""
        with self._globals.swapped_in():
            self._learn(designs, values)
        super().tell(designs, values, info)
        self._history.append(_Told(designs.copy(), values.copy(), deepcopy(info)))

    def state_dict(self) -> State:
        """Return the generator as it was at first, and all that was asked and told since."""
        return {"rng": deepcopy(self._first_rng), "history": list(self._history)}

    def load_state_dict(self, state: State) -> None:
        """Repeat all that was asked and told.

        Raises
        ------
        ValueError
            Where the optimiser now proposes something else, as another version of its library may.
        """
        self._begin(deepcopy(state["rng"]))
        for event in state["history"]:
            if isinstance(event, _Told):
                self.tell(*event)
            elif not np.array_equal(indices_of(self.ask(event.n)), event.indices):
                raise ValueError(
                    f"{type(self).__name__} can't go on from this state: replayed, it proposes "
                    "other designs; use the options and the version of its library that the state "
                    "was made with"
                )

    def _begin(self, rng: np.random.Generator) -> None:
        super().__init__(rng)
        self._first_rng = deepcopy(rng)
        self._history: list[_Asked | _Told] = []
        self._globals = GlobalRandom(rng)
        with self._globals.swapped_in():
            self._start()

    def _seed(self) -> int:
        """Draw a seed."""
        return int(self.rng.integers(2**32))


class _Asked(NamedTuple):
    n: int | None
    indices: NDArray[np.int64]


class _Told(NamedTuple):
    designs: Designs
    values: NDArray[np.float64]
    info: Info


class GlobalRandom:
    """Generators in place of the global ones, `random` and `numpy.random`, while swapped in.

    Parameters
    ----------
    rng : numpy.random.Generator
        Draws the seeds.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        first, second = rng.integers(2**32, size=2).tolist()
        self._python = random.Random(first).getstate()
        self._numpy = np.random.MT19937(second)

    @contextmanager
    def swapped_in(self) -> Iterator[None]:
        """Let the global functions draw from these for a while; they go on where they got to."""
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


def set_global_states(states: tuple[Any, Any]) -> None:
    """Set the states of the global generators of `random` and `numpy.random`."""
    random.setstate(states[0])
    np.random.set_state(states[1])  # noqa: NPY002, it is meant


def library(name: str) -> Any:
    """Import an optional library, and leave the global random states as they were.

    Raises
    ------
    ImportError
        Where it is not installed, saying how to mend it.
    """
    states = global_states()
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise ImportError(
            f"{name} is not installed; it comes with: pip install 'softvox-gym[adapters]'",
            name=name,
        ) from error
    finally:
        set_global_states(states)
