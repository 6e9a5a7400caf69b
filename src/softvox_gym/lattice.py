"""The lattice: its sites, their numbering, and the numbering of designs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import log2, prod
from operator import index as as_index
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Sites of the largest lattice. A larger one would need gigabytes before the first step.
MAX_SITES = 10**6

#: Design numbers up to here are int64; larger ones are Python ints in arrays of objects.
_LARGEST = np.iinfo(np.int64).max

#: Most phases; each digit must be one character.
MOST_PHASES = 8

#: Offsets to the six neighbours of a site; the first four are horizontal.
FACES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


class Lattice(NamedTuple):
    """A lattice of nx x ny x nz sites; the paper's is the default.

    Site (x, y, z) has index x + nx (y + ny z). A design gives each site a digit (0 absent,
    1 passive, 2 active), and its number is the sum of digit_i 3^i. A lattice equals the tuple of
    its sides.

    With P phases (`Lattice.of`) active voxels may be pumped at different times: digit 2 + p is
    active, p / P cycles ahead, and numbers are sums of digit_i (2 + P)^i. Such a lattice equals
    only lattices with as many phases.

    Parameters
    ----------
    nx, ny, nz : int
        The sides, unchecked; `Lattice.of` checks them.

    Examples
    --------
    >>> lattice = Lattice.of((3, 3, 3))
    >>> lattice.sites, lattice.n_designs
    (27, 7625597484987)
    >>> Lattice.of((2, 2, 2), phases=4).n_designs
    1679616
    """

    nx: int = 2
    ny: int = 2
    nz: int = 2

    @classmethod
    def of(cls, shape: Sequence[int], *, phases: int | None = None) -> Lattice:
        """Return the lattice of a shape (nx, ny, nz).

        Parameters
        ----------
        shape : sequence of int
        phases : int, optional
            How many phases an active voxel can have; by default those of a Lattice as shape, or 1.

        Raises
        ------
        TypeError, ValueError
            If the sides are not three positive whole numbers, the lattice has more than a million
            sites, or the phases are not a whole number from 1 to 8.
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
                f"shape {nx}x{ny}x{nz} has {nx * ny * nz} sites; at most {MAX_SITES} are allowed"
            )
        if phases is None:
            phases = shape.phases if isinstance(shape, Lattice) else 1
        phases = whole("phases", phases)
        if not 1 <= phases <= MOST_PHASES:
            raise ValueError(f"phases must be from 1 to {MOST_PHASES}, got {phases}")
        return Lattice(nx, ny, nz) if phases == 1 else PhasedLattice(nx, ny, nz, phases)

    @classmethod
    def named(cls, text: str) -> Lattice:
        """Return the lattice whose `str` is this text."""
        *phased, sides = text.split("-phase ")
        return cls.of([int(side) for side in sides.split("x")], phases=int("".join(phased) or 1))

    @property
    def phases(self) -> int:
        """How many phases an active voxel can have."""
        return 1

    @property
    def states(self) -> int:
        """How many digits a site can have, 2 + phases."""
        return 2 + self.phases

    @property
    def sites(self) -> int:
        """How many sites there are."""
        return prod(self)

    @property
    def n_designs(self) -> int:
        """How many designs there are, states^sites."""
        return int(self.states**self.sites)

    @property
    def has_int64_numbers(self) -> bool:
        """Whether every design's number fits into an int64: with one phase, up to 39 sites."""
        return self.sites <= 39 and self.n_designs - 1 <= _LARGEST

    def __str__(self) -> str:
        return f"{self.nx}x{self.ny}x{self.nz}"

    def digits(self, numbers: ArrayLike) -> NDArray[np.uint8]:
        """Return the digits, uint8 of shape (..., sites), of designs given by their numbers.

        Numbers of shape (...) are Python ints (dtype object) if they exceed int64. ValueError if no
        design of the lattice has a number.
        """
        array = np.asarray(numbers)
        for extreme in (array.min(), array.max()) if array.size else ():
            self._check(whole("a design's number", extreme))
        if not self.has_int64_numbers:
            rows = [
                _digits(as_index(number), self.sites, self.states)
                for number in array.ravel().tolist()
            ]
            flat = np.frombuffer(b"".join(rows), dtype=np.uint8)
            return flat.reshape(*array.shape, self.sites).copy()
        powers = self.states ** np.arange(self.sites, dtype=np.int64)
        digits: NDArray[np.int64] = array[..., np.newaxis].astype(np.int64) // powers % self.states
        return digits.astype(np.uint8)

    def numbers(self, rows: ArrayLike) -> NDArray[Any]:
        """Return the numbers, shape (...), of designs given by their digits, shape (..., sites).

        They are int64, or Python ints (dtype object) if the lattice has more designs than int64.
        """
        array = np.asarray(rows)
        if self.has_int64_numbers:
            powers = self.states ** np.arange(self.sites)
            numbers: NDArray[np.int64] = array.astype(np.int64) @ powers
            return numbers
        flat = array.astype(np.uint8).reshape(-1, self.sites)
        made = np.fromiter((number_of(row.tobytes(), self.states) for row in flat), dtype=object)
        return made.reshape(array.shape[:-1])

    def to_stack(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Reshape values in the order of sites, shape (..., sites), to (..., nx, ny, nz)."""
        split = rows.reshape(*rows.shape[:-1], self.nz, self.ny, self.nx)
        return split.swapaxes(-1, -3)

    def to_rows(self, stack: NDArray[Any]) -> NDArray[Any]:
        """Reshape values indexed [..., x, y, z] to the order of sites, shape (..., sites)."""
        flat = np.ascontiguousarray(stack.swapaxes(-1, -3))
        return flat.reshape(*stack.shape[:-3], self.sites)

    def random(self, n: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Return n designs drawn uniformly, digits of shape (n, sites)."""
        return rng.integers(self.states, size=(n, self.sites))

    def pumped(self, digits: NDArray[Any]) -> tuple[NDArray[np.uint8], NDArray[np.float64] | None]:
        """Return the kinds and phases of digits of any shape, as the engine needs them.

        Returns
        -------
        kinds : ndarray of uint8
            The digits 0 absent, 1 passive, 2 active.
        phase : ndarray, or None
            Cycles, 0 if not active; None on a lattice of one phase.
        """
        if self.phases == 1:
            return digits.astype(np.uint8, copy=False), None
        ahead = np.maximum(digits, 2).astype(np.float64) - 2
        return np.minimum(digits, 2).astype(np.uint8), ahead / self.phases

    def place(self, site: int) -> tuple[int, int, int]:
        """Return a site's x, y, z."""
        return site % self.nx, site // self.nx % self.ny, site // self.nx // self.ny

    def neighbours(self, site: int) -> Iterator[int]:
        """Yield the sites that share a face with one."""
        nx, ny, nz = self
        x, y, z = self.place(site)
        for dx, dy, dz in FACES:
            i, j, k = x + dx, y + dy, z + dz
            if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz:
                yield i + nx * (j + ny * k)

    def _check(self, number: int) -> None:
        # Length first: 3^sites of a large lattice takes a while to compute.
        most_bits = log2(self.states) * self.sites + 1
        if number < 0 or number.bit_length() > most_bits or number >= self.n_designs:
            last = self.n_designs - 1 if self.sites <= 40 else f"{self.states}^{self.sites} - 1"
            shown = number if number.bit_length() <= 128 else f"of {number.bit_length()} bits"
            raise ValueError(
                f"design index {shown} is outside 0 ... {last}, the designs of a {self} lattice"
            )


def whole(name: str, value: Any) -> int:
    """Return an argument that is a whole number as an int; otherwise TypeError that names it."""
    try:
        return as_index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, got {value!r}") from None


class PhasedLattice(Lattice):
    """A lattice of several phases; `Lattice.of(shape, phases=...)` makes one."""

    _phases: int

    def __new__(cls, nx: int, ny: int, nz: int, phases: int) -> PhasedLattice:
        """Make a lattice from sides and phases that are known to be valid."""
        lattice = super().__new__(cls, nx, ny, nz)
        lattice._phases = phases
        return lattice

    def __getnewargs__(self) -> tuple[int, int, int, int]:
        return (*self[:], self._phases)

    @property
    def phases(self) -> int:
        """How many phases an active voxel can have."""
        return self._phases

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PhasedLattice) and (*self, self.phases) == (*other, other.phases)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash((*self, self.phases))

    def __repr__(self) -> str:
        return f"Lattice.of({self[:]}, phases={self.phases})"

    def __str__(self) -> str:
        return f"{self.phases}-phase {super().__str__()}"


def _digits(number: int, sites: int, base: int) -> bytes:
    """Return a number's digits in a base, lowest first; by halves, as long division is slow."""
    if sites <= 40:
        digits = bytearray(sites)
        for site in range(sites):
            number, digits[site] = divmod(number, base)
        return bytes(digits)
    half = sites // 2
    high, low = divmod(number, base**half) if number else (0, 0)
    return _digits(low, half, base) + _digits(high, sites - half, base)


def number_of(digits: bytes, base: int = 3) -> int:
    """Return the number that digits in a base stand for, lowest first."""
    if len(digits) <= 40:
        number = 0
        for digit in reversed(digits):
            number = base * number + digit
        return number
    half = len(digits) // 2
    high = number_of(digits[half:], base)
    return number_of(digits[:half], base) + (high * base**half if high else 0)
