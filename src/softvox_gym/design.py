"""A design: which voxels a robot has, and which of them are active."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache, reduce
from math import prod
from operator import index as as_index
from typing import Any, TypeAlias, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

Shape: TypeAlias = tuple[int, int, int]
DesignLike: TypeAlias = Union[int, str, "Design", ArrayLike]

ABSENT, PASSIVE, ACTIVE = 0, 1, 2
DEFAULT_SHAPE: Shape = (2, 2, 2)
N_SITES = prod(DEFAULT_SHAPE)
N_DESIGNS = 3**N_SITES

#: What a digit of the 2x2x2 lattice counts for in a design's number, by site.
POWERS = 3 ** np.arange(N_SITES, dtype=np.int64)


class Design:
    """A robot on a lattice: one digit per site, 0 absent, 1 passive, 2 active.

    Site (x, y, z) has index i = x + nx (y + ny z), and a design the number sum of d_i 3^i, so that
    the designs of the 2x2x2 lattice are 0 ... 6560. Designs are values: immutable, hashable, equal
    where shape and digits are.

    Parameters
    ----------
    design : int, str, sequence of int, ndarray or Design
        A number, a string or sequence of digits d_0 d_1 d_2 ..., or an array of shape (nx, ny, nz)
        indexed [x, y, z].
    shape : (int, int, int), optional
        The lattice (nx, ny, nz). Taken from a 3-D array or a Design; otherwise 2x2x2.

    Raises
    ------
    TypeError
        Where the design is not made of whole numbers.
    ValueError
        For a digit other than 0, 1, 2, a number or length that does not fit the lattice, or a
        shape that is no lattice.

    Examples
    --------
    >>> Design(6453)
    Design('00021222')
    >>> Design("00021222") == Design([0, 0, 0, 2, 1, 2, 2, 2])
    True
    """

    __slots__ = ("_digits", "_shape")

    _digits: bytes
    _shape: Shape

    def __init__(self, design: DesignLike, *, shape: Sequence[int] | None = None) -> None:
        lattice = None if shape is None else checked_shape(shape)
        if isinstance(design, Design):
            digits, own_shape = design._digits, design._shape
        elif isinstance(design, str):
            digits, own_shape = _digits_of_string(design, lattice or DEFAULT_SHAPE)
        elif isinstance(design, (int, np.integer)) and not isinstance(design, (bool, np.bool_)):
            digits, own_shape = _digits_of_index(as_index(design), lattice or DEFAULT_SHAPE)
        else:
            digits, own_shape = _digits_of_array(design, lattice)
        if lattice is not None and lattice != own_shape:
            raise ValueError(f"design has shape {own_shape}, but shape={lattice} was asked for")
        object.__setattr__(self, "_digits", digits)
        object.__setattr__(self, "_shape", own_shape)

    @classmethod
    def _of(cls, digits: bytes, shape: Shape) -> Design:
        """Make a design of digits already known to be good."""
        design = object.__new__(cls)
        object.__setattr__(design, "_digits", digits)
        object.__setattr__(design, "_shape", shape)
        return design

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Design can't be changed: cannot set {name}")

    def __reduce__(self) -> tuple[Any, ...]:
        return Design._of, (self._digits, self._shape)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Design):
            return NotImplemented
        return self._digits == other._digits and self._shape == other._shape

    def __hash__(self) -> int:
        return hash((self._digits, self._shape))

    def __repr__(self) -> str:
        shape = "" if self._shape == DEFAULT_SHAPE else f", shape={self._shape}"
        return f"Design('{self.digits}'{shape})"

    @property
    def shape(self) -> Shape:
        """The lattice (nx, ny, nz)."""
        return self._shape

    @property
    def digits(self) -> str:
        """The digits d_0 d_1 d_2 ... as a string."""
        return self._digits.translate(_DIGIT_TO_CHARACTER).decode("ascii")

    @property
    def index(self) -> int:
        """The design's number, sum of d_i 3^i."""
        return reduce(lambda number, digit: 3 * number + digit, reversed(self._digits), 0)

    @property
    def array(self) -> NDArray[np.uint8]:
        """The digits as an array of shape (nx, ny, nz), indexed [x, y, z]; read-only."""
        return np.frombuffer(self._digits, dtype=np.uint8).reshape(self._shape, order="F")

    @property
    def n_voxels(self) -> int:
        """How many voxels are present."""
        return len(self._digits) - self._digits.count(ABSENT)

    @property
    def n_active(self) -> int:
        """How many voxels are active."""
        return self._digits.count(ACTIVE)

    @property
    def components(self) -> tuple[tuple[int, ...], ...]:
        """The pieces that hang together by faces: the sites of each, in order of the first."""
        return _components(bytes(digit != ABSENT for digit in self._digits), self._shape)

    @property
    def is_connected(self) -> bool:
        """Whether the robot is one piece. The empty design is none."""
        return len(self.components) == 1

    def rotated(self, k: int = 1) -> Design:
        """Turn the robot about the vertical.

        Parameters
        ----------
        k : int
            Quarter turns, counter-clockwise seen from above (+x goes to +y).

        Returns
        -------
        Design
            On a lattice of shape (ny, nx, nz) where k is odd.
        """
        return _of_array(np.rot90(self.array, as_index(k)))

    def mirrored(self) -> Design:
        """Mirror the robot in a plane across x (x becomes nx - 1 - x)."""
        return _of_array(self.array[::-1])

    def canonical(self, *, reflections: bool = True) -> Design:
        """Return the one design that stands for all that look the same when turned (and mirrored).

        Gravity and the floor look the same from every heading, so these travel equally far, but for
        what the beams' frames make of it (a few thousandths of the way; more where a robot falls
        over).

        Parameters
        ----------
        reflections : bool
            Whether mirror images count as the same.

        Returns
        -------
        Design
            The one with the smallest shape and then the smallest index.
        """
        poses = [self.rotated(k) for k in range(4)]
        if reflections:
            poses += [pose.mirrored() for pose in poses]
        return min(poses, key=lambda pose: (pose.shape, pose.index))


_DIGIT_TO_CHARACTER = bytes.maketrans(bytes((0, 1, 2)), b"012")
_CHARACTER_TO_DIGIT = bytes.maketrans(b"012", bytes((0, 1, 2)))


def checked_shape(shape: Sequence[int]) -> Shape:
    """Return a lattice's shape as three positive ints.

    Raises
    ------
    ValueError
        Where it is anything else.
    """
    try:
        nx, ny, nz = (as_index(side) for side in shape)
    except (TypeError, ValueError):
        raise ValueError(f"shape must be three whole numbers (nx, ny, nz), got {shape!r}") from None
    if min(nx, ny, nz) < 1:
        raise ValueError(f"shape must have positive sides, got {shape!r}")
    return nx, ny, nz


def _text(shape: Shape) -> str:
    return "x".join(map(str, shape))


def _digits_of_string(text: str, shape: Shape) -> tuple[bytes, Shape]:
    sites = prod(shape)
    if len(text) != sites:
        raise ValueError(
            f"design {text!r} has {len(text)} digits, but a {_text(shape)} lattice has {sites} "
            "sites; give shape=(nx, ny, nz) for another lattice"
        )
    if set(text) - set("012"):
        raise ValueError(f"design {text!r} may have the digits 0, 1 and 2 only")
    return text.encode("ascii").translate(_CHARACTER_TO_DIGIT), shape


def _digits_of_index(number: int, shape: Shape) -> tuple[bytes, Shape]:
    sites = prod(shape)
    if not 0 <= number < 3**sites:
        last = 3**sites - 1 if sites <= 40 else f"3^{sites} - 1"
        raise ValueError(
            f"design index {number} is outside 0 ... {last}, "
            f"the designs of a {_text(shape)} lattice"
        )
    digits = bytearray(sites)
    for site in range(sites):
        number, digits[site] = divmod(number, 3)
    return bytes(digits), shape


def _digits_of_array(values: ArrayLike, shape: Shape | None) -> tuple[bytes, Shape]:
    if isinstance(values, np.ndarray) and values.ndim == 0 and values.dtype.kind in "iu":
        return _digits_of_index(int(values), shape or DEFAULT_SHAPE)
    array = checked_digits(values)
    if array.ndim == 3:
        return array.tobytes(order="F"), checked_shape(array.shape)
    if array.ndim != 1:
        raise ValueError(
            f"design must be a number, a row of digits or an (nx, ny, nz) array, "
            f"got an array of shape {array.shape}"
        )
    lattice = shape or DEFAULT_SHAPE
    if array.size != prod(lattice):
        raise ValueError(
            f"design has {array.size} digits, but a {_text(lattice)} lattice has {prod(lattice)} "
            "sites; give shape=(nx, ny, nz) for another lattice"
        )
    return array.tobytes(), lattice


def checked_digits(values: ArrayLike) -> NDArray[np.uint8]:
    """Return an array of digits as uint8.

    Raises
    ------
    TypeError
        Where the values are not whole numbers.
    ValueError
        Where one is not 0, 1 or 2.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise ValueError("designs must be an even array of digits, got ragged rows") from None
    if array.dtype.kind not in "iu" and array.size:
        raise TypeError(
            f"designs must be whole numbers, got {array.dtype} values; "
            "use an integer dtype, a number, or a string of digits"
        )
    if array.size and (array.min() < ABSENT or array.max() > ACTIVE):
        bad = array[(array < ABSENT) | (array > ACTIVE)].flat[0]
        raise ValueError(f"designs may have the digits 0, 1 and 2 only, got {bad}")
    return array.astype(np.uint8)


def _of_array(array: NDArray[np.uint8]) -> Design:
    nx, ny, nz = array.shape
    return Design._of(array.tobytes(order="F"), (nx, ny, nz))


@lru_cache(maxsize=65536)
def _components(occupied: bytes, shape: Shape) -> tuple[tuple[int, ...], ...]:
    waiting = {site for site, present in enumerate(occupied) if present}
    pieces = []
    while waiting:
        piece = [min(waiting)]
        waiting.discard(piece[0])
        for site in piece:
            for neighbour in _neighbours(site, shape):
                if neighbour in waiting:
                    waiting.discard(neighbour)
                    piece.append(neighbour)
        pieces.append(tuple(sorted(piece)))
    return tuple(pieces)


def _neighbours(site: int, shape: Shape) -> Iterable[int]:
    nx, ny, nz = shape
    x, y, z = site % nx, site // nx % ny, site // nx // ny
    for step in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)):
        i, j, k = x + step[0], y + step[1], z + step[2]
        if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz:
            yield i + nx * (j + ny * k)


def indices_of(rows: ArrayLike) -> NDArray[np.int64]:
    """Return the numbers, shape (...), of 2x2x2 designs given as digits, shape (..., 8)."""
    numbers: NDArray[np.int64] = np.asarray(rows, dtype=np.int64) @ POWERS
    return numbers


def digits_of(indices: ArrayLike) -> NDArray[np.int64]:
    """Return the digits, shape (..., 8), of 2x2x2 designs given as numbers, shape (...)."""
    return np.asarray(indices, dtype=np.int64)[..., np.newaxis] // POWERS % 3


def stack_of(designs: Any) -> NDArray[np.uint8]:
    """Bring a batch of designs into one array.

    Parameters
    ----------
    designs : Design, int, str, sequence of these, or ndarray
        One design or many. A 1-D array or a list of ints holds design numbers of the 2x2x2 lattice,
        an (n, 8) array rows of digits, an (n, nx, ny, nz) array digits indexed [x, y, z].

    Returns
    -------
    ndarray of uint8, shape (n, nx, ny, nz)

    Raises
    ------
    TypeError, ValueError
        As `Design` does, or where the designs do not share one lattice.
    """
    if isinstance(designs, (Design, str, int, np.integer)):
        return Design(designs).array[np.newaxis]
    if isinstance(designs, np.ndarray) and designs.dtype != object:
        return _stack_of_array(designs)
    try:
        rows = list(designs)
    except TypeError:
        raise TypeError(
            f"designs must be a design or a batch of designs, got {designs!r}"
        ) from None
    if not rows:
        return np.zeros((0, *DEFAULT_SHAPE), dtype=np.uint8)
    if all(isinstance(row, (int, np.integer)) for row in rows):
        return _stack_of_array(_index_array(rows))
    arrays = [Design(row).array for row in rows]
    shapes = {array.shape for array in arrays}
    if len(shapes) > 1:
        raise ValueError(f"the designs of a batch must share one lattice, got {sorted(shapes)}")
    return np.stack(arrays)


def _index_array(rows: list[Any]) -> NDArray[np.int64]:
    for row in rows:
        if isinstance(row, (bool, np.bool_)):
            raise TypeError("designs must be whole numbers, got a bool")
        _checked_index(as_index(row))
    return np.array(rows, dtype=np.int64)


def _checked_index(number: int) -> None:
    _digits_of_index(number, DEFAULT_SHAPE)


def _stack_of_array(array: NDArray[Any]) -> NDArray[np.uint8]:
    if array.ndim == 0:
        return Design(array[()]).array[np.newaxis]
    if array.ndim == 1 and array.dtype.kind in "iu":
        for extreme in (array.min(), array.max()) if array.size else ():
            _checked_index(int(extreme))
        return _rows_to_lattice(digits_of(array))
    if array.ndim == 1:
        return stack_of(list(array))
    digits = checked_digits(array)
    if digits.ndim == 2 and digits.shape[1] == N_SITES:
        return _rows_to_lattice(digits)
    if digits.ndim == 4:
        checked_shape(digits.shape[1:])
        return digits
    raise ValueError(
        "designs must be an array of shape (n,) of design numbers, (n, 8) of digits or "
        f"(n, nx, ny, nz) of digits, got shape {array.shape}"
    )


def _rows_to_lattice(rows: NDArray[Any]) -> NDArray[np.uint8]:
    """Turn rows of the 2x2x2 lattice's digits into arrays indexed [x, y, z]."""
    nx, ny, nz = DEFAULT_SHAPE
    return rows.astype(np.uint8).reshape(len(rows), nz, ny, nx).transpose(0, 3, 2, 1)
