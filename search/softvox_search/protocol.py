"""The protocol of searchers: three methods, and a base class that brings two of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol, TypeAlias, TypedDict, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design, Lattice

#: Rows of digits, int64 of shape (n, sites), as in the environment's action space.
Designs: TypeAlias = NDArray[np.int64]


class Info(TypedDict):
    """What a searcher is told besides the values.

    Attributes
    ----------
    displacement : ndarray, shape (n, 3)
        dx, dy, dz in voxel widths; NaN where the design diverged.
    diverged : ndarray of bool, shape (n,)
    standard_error : ndarray, shape (n,)
        Standard error of the values, voxel widths: 0 if they are exact, NaN if a noisy value is a
        single draw.
    """

    displacement: NDArray[np.float64]
    diverged: NDArray[np.bool_]
    standard_error: NDArray[np.float64]


class SearcherError(Exception):
    """A searcher broke the protocol; the message explains how."""


@contextmanager
def naming(who: str) -> Iterator[None]:
    """Put who broke the protocol, "searcher ga", before what the error says of it."""
    try:
        yield
    except SearcherError as error:
        raise SearcherError(f"{who} {error}") from error


@runtime_checkable
class Searcher(Protocol):
    """An optimiser that is asked for designs and told their values.

    It is made as ``Class(space, rng, **options)`` with the `softvox_gym.Lattice` that it searches.
    It must draw all its random numbers from the generator ``rng``, so that a run can be repeated.
    """

    def ask(self, n: int | None = None) -> Any:
        """Propose designs to evaluate.

        Parameters
        ----------
        n : int, optional
            At most this many; by default the searcher's own batch size.

        Returns
        -------
        designs
            Any batch for `softvox_gym.simulate`: rows of digits, shape (m, sites), an array of
            design numbers, a list of Design. A single design is a batch of one, ``[[0, 0, 0, 2, 1,
            2, 2, 2]]``. An empty batch ends the search.
        """
        ...

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Learn the values of the designs of the last `ask`, in the order asked.

        If there are fewer than were asked for, the budget has ended.

        Parameters
        ----------
        designs : ndarray of int64, shape (n, sites)
        values : ndarray, shape (n,)
            Values to be maximised; never NaN. A design that diverged has the value 0.
        info : Info
        """
        ...

    def recommend(self) -> Design:
        """Return the design that the searcher would build now.

        It may differ from the one with the best value seen. Called only after a `tell`.
        """
        ...


def keys_of(designs: Designs) -> list[bytes]:
    """Return a lookup key for every design: its digits, as bytes."""
    rows = np.ascontiguousarray(designs, dtype=np.uint8)
    keys: Any = rows.view(np.dtype((np.void, rows.shape[1]))).ravel().tolist()
    return list(keys)


def rows_of(keys: list[bytes], space: Lattice) -> Designs:
    """Return the designs for keys as rows of digits, shape (n, sites)."""
    flat = np.frombuffer(b"".join(keys), dtype=np.uint8)
    return flat.reshape(len(keys), space.sites).astype(np.int64)


def best_of(values: dict[bytes, float]) -> bytes:
    """Return the key of the largest value; of ties that of the smallest design number."""
    top = max(values.values())
    return min((key for key, value in values.items() if value == top), key=lambda key: key[::-1])


class SearcherBase:
    """Stores the value told last for every design; a subclass needs only an `ask`.

    Parameters
    ----------
    space : Lattice
        The lattice whose designs are searched.
    rng : numpy.random.Generator
        The generator of the run; the only source of random numbers.

    Attributes
    ----------
    space, rng
    values : dict of bytes to float
        The value told last for every evaluated design, voxel widths, by `keys_of`.
    """

    def __init__(self, space: Lattice, rng: np.random.Generator) -> None:
        self.space = space
        self.rng = rng
        self.values: dict[bytes, float] = {}

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Store the values."""
        self.values.update(zip(keys_of(designs), values.tolist(), strict=True))

    def known(self, designs: Designs) -> NDArray[np.float64]:
        """Return the values told last for designs, shape (n,); NaN if there is none."""
        return np.array([self.values.get(key, np.nan) for key in keys_of(designs)])

    @property
    def best(self) -> NDArray[np.int64] | None:
        """The digits of the design with the best value, shape (sites,); None before any."""
        return rows_of([best_of(self.values)], self.space)[0] if self.values else None

    def recommend(self) -> Design:
        """Return the design with the best value; of ties the smallest number.

        Raises
        ------
        ValueError
            Before the first `tell`.
        """
        if self.best is None:
            raise ValueError("nothing to recommend: no design was evaluated yet")
        return Design(self.best, shape=self.space)
