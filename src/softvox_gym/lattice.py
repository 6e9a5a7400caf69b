"""The lattice: how many sites there are, how they are numbered, and how designs are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import prod
from operator import index as as_index
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Sites of the largest lattice. Larger ones would need gigabytes before the first step.
MAX_SITES = 10**6

#: Design numbers up to here are int64; larger ones are Python ints in arrays of objects.
_LARGEST = np.iinfo(np.int64).max

_FACES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


class Lattice(NamedTuple):
    """A lattice of nx x ny x nz sites; the paper's is the default.

    Site (x, y, z) has index x + nx (y + ny z). A design gives each site a digit (0 absent,
    1 passive, 2 active), and its number is the sum of digit_i 3^i. A lattice equals the tuple of
    its sides.

    Parameters
    ----------
    nx, ny, nz : int
        Use `Lattice.of` for sides that need to be checked.

    Examples
    --------
    >>> lattice = Lattice.of((3, 3, 3))
    >>> lattice.sites, lattice.n_designs
    (27, 7625597484987)
    """

    nx: int = 2
    ny: int = 2
    nz: int = 2

    @classmethod
    def of(cls, shape: Sequence[int]) -> Lattice:
        """Return the lattice of a shape (nx, ny, nz).

        Raises
        ------
        ValueError
            Where these are not three positive whole numbers, or the lattice has more than a
            million sites.
        """
        try:
            nx, ny, nz = (as_index(side) for side in shape)
        except (TypeError, ValueError):
            raise ValueError(
                f"shape must be three whole numbers (nx, ny, nz), got {shape!r}"
            ) from None
        if min(nx, ny, nz) < 1:
            raise ValueError(f"shape must have positive sides, got {shape!r}")
        if nx * ny * nz > MAX_SITES:
            raise ValueError(
                f"shape {nx}x{ny}x{nz} has {nx * ny * nz} sites, and at most {MAX_SITES} are taken"
            )
        return cls(nx, ny, nz)

    @property
    def sites(self) -> int:
        """How many sites there are."""
        return prod(self)

    @property
    def n_designs(self) -> int:
        """How many designs there are, 3^sites."""
        return int(3**self.sites)

    @property
    def has_int64_numbers(self) -> bool:
        """Whether every design's number fits into an int64, as on up to 39 sites."""
        return self.sites <= 39

    def __str__(self) -> str:
        return f"{self.nx}x{self.ny}x{self.nz}"

    def digits(self, numbers: ArrayLike) -> NDArray[np.uint8]:
        """Return the digits, uint8 of shape (..., sites), of designs given by their numbers.

        Numbers of shape (...) are Python ints (dtype object) where they exceed int64; ValueError
        for one that no design of the lattice has.
        """
        array = np.asarray(numbers)
        for extreme in (array.min(), array.max()) if array.size else ():
            self._check(as_index(extreme))
        if not self.has_int64_numbers:
            rows = [_digits(as_index(number), self.sites) for number in array.ravel().tolist()]
            flat = np.frombuffer(b"".join(rows), dtype=np.uint8)
            return flat.reshape(*array.shape, self.sites).copy()
        powers = 3 ** np.arange(self.sites, dtype=np.int64)
        digits: NDArray[np.int64] = array[..., np.newaxis].astype(np.int64) // powers % 3
        return digits.astype(np.uint8)

    def numbers(self, rows: ArrayLike) -> NDArray[Any]:
        """Return the numbers, shape (...), of designs given by their digits, shape (..., sites).

        They are int64; Python ints (dtype object) on lattices with more designs than that counts.
        """
        array = np.asarray(rows)
        if self.has_int64_numbers:
            numbers: NDArray[np.int64] = array.astype(np.int64) @ 3 ** np.arange(self.sites)
            return numbers
        flat = array.astype(np.uint8).reshape(-1, self.sites)
        made = np.fromiter((number_of(row.tobytes()) for row in flat), dtype=object)
        return made.reshape(array.shape[:-1])

    def to_stack(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Turn values in the order of sites, shape (..., sites), into (..., nx, ny, nz)."""
        split = rows.reshape(*rows.shape[:-1], self.nz, self.ny, self.nx)
        return split.swapaxes(-1, -3)

    def to_rows(self, stack: NDArray[Any]) -> NDArray[Any]:
        """Turn values indexed [..., x, y, z] into the order of sites, shape (..., sites)."""
        flat = np.ascontiguousarray(stack.swapaxes(-1, -3))
        return flat.reshape(*stack.shape[:-3], self.sites)

    def random(self, n: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Return n designs drawn uniformly, digits of shape (n, sites)."""
        return rng.integers(3, size=(n, self.sites))

    def neighbours(self, site: int) -> Iterator[int]:
        """Yield the sites that share a face with one."""
        nx, ny, nz = self
        x, y, z = site % nx, site // nx % ny, site // nx // ny
        for dx, dy, dz in _FACES:
            i, j, k = x + dx, y + dy, z + dz
            if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz:
                yield i + nx * (j + ny * k)

    def _check(self, number: int) -> None:
        # By length first: 3^sites of a large lattice takes a while to compute.
        if number < 0 or number.bit_length() > 1.6 * self.sites + 1 or number >= self.n_designs:
            last = self.n_designs - 1 if self.sites <= 40 else f"3^{self.sites} - 1"
            shown = number if number.bit_length() <= 128 else f"of {number.bit_length()} bits"
            raise ValueError(
                f"design index {shown} is outside 0 ... {last}, the designs of a {self} lattice"
            )


def _digits(number: int, sites: int) -> bytes:
    """Return the base-3 digits of a number, lowest first; by halves, as long division is slow."""
    if sites <= 40:
        digits = bytearray(sites)
        for site in range(sites):
            number, digits[site] = divmod(number, 3)
        return bytes(digits)
    half = sites // 2
    high, low = divmod(number, 3**half) if number else (0, 0)
    return _digits(low, half) + _digits(high, sites - half)


def number_of(digits: bytes) -> int:
    """Return the number that base-3 digits stand for, lowest first."""
    if len(digits) <= 40:
        number = 0
        for digit in reversed(digits):
            number = 3 * number + digit
        return number
    half = len(digits) // 2
    high = number_of(digits[half:])
    return number_of(digits[:half]) + (high * 3**half if high else 0)
