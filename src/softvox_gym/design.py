"""Designs: the voxels of a robot, and which of them are active."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache, reduce
from importlib.metadata import entry_points
from operator import or_
from os import PathLike
from pathlib import Path
from string import digits as digits_ascii
from typing import Any, NamedTuple, TypeAlias, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym import design_files
from softvox_gym.lattice import FACES, Lattice, number_of, whole

#: The remedy for a digit that is too large.
_MORE = "; shape=Lattice.of(shape, phases=P) allows digits up to P + 1"

#: Designs that `buildable` processes together.
_AT_ONCE = 2**14

#: Largest number of sites for which it is cached which bodies are in one piece.
REMEMBERED = 64

DesignLike: TypeAlias = Union[int, str, "Design", ArrayLike]

ABSENT, PASSIVE, ACTIVE = 0, 1, 2

#: How the smaller voxels of an active one expand; see `Design.refined`.
EXPANSIONS = ("spherical", "uniform")


class Design:
    """A robot on a lattice: one digit per site, 0 absent, 1 passive, 2 active (or more, by phase).

    Site (x, y, z) has index i = x + nx (y + ny z), and a design has the number sum of d_i 3^i, so
    the designs of the 2x2x2 lattice are 0 ... 6560. Designs are values: immutable, hashable, and
    equal if their shapes and digits are.

    Parameters
    ----------
    design : int, str, sequence of int, ndarray or Design
        A number, a string or sequence of digits d_0 d_1 d_2 ..., or an array of shape (nx, ny, nz)
        indexed [x, y, z].
    shape : (int, int, int), optional
        The lattice (nx, ny, nz), with at most a million sites. A 3-D array or a Design brings its
        own; otherwise the default is 2x2x2. ``Lattice.of(shape, phases=P)`` allows the digits 2 + p
        of voxels that are active at phase p / P.

    Raises
    ------
    TypeError
        If the design does not consist of whole numbers.
    ValueError
        If the lattice lacks a digit, the number or length does not fit the lattice, or the shape is
        no lattice.

    Examples
    --------
    >>> Design(6453)
    Design('00021222')
    >>> Design("00021222") == Design([0, 0, 0, 2, 1, 2, 2, 2])
    True
    """

    __slots__ = ("_digits", "lattice")

    _digits: bytes
    lattice: Lattice

    def __init__(self, design: DesignLike, *, shape: Sequence[int] | None = None) -> None:
        lattice = None if shape is None else Lattice.of(shape)
        if isinstance(design, Design):
            digits, own = design._digits, design.lattice
        elif isinstance(design, str):
            own = lattice or Lattice()
            digits = _digits_of_string(design, own)
        else:
            digits, own = _digits_of_array(design, lattice)
        if lattice is not None and lattice != own:
            raise ValueError(f"design has shape {own}, but shape={lattice} was given")
        object.__setattr__(self, "_digits", digits)
        object.__setattr__(self, "lattice", own)

    @classmethod
    def _of(cls, digits: bytes, lattice: Lattice) -> Design:
        """Make a design from digits that are known to be valid."""
        design = object.__new__(cls)
        object.__setattr__(design, "_digits", digits)
        object.__setattr__(design, "lattice", lattice)
        return design

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Design can't be changed: cannot set {name}")

    def __reduce__(self) -> tuple[Any, ...]:
        return Design._of, (self._digits, self.lattice)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Design):
            return NotImplemented
        return self._digits == other._digits and self.lattice == other.lattice

    def __hash__(self) -> int:
        return hash((self._digits, self.lattice))

    def __repr__(self) -> str:
        shape: Any = self.shape if self.lattice.phases == 1 else self.lattice
        return f"Design('{self.digits}'{'' if self.lattice == Lattice() else f', {shape=}'})"

    def _repr_html_(self) -> str | None:
        """Return what a notebook shows: the robot as built, with its facts."""
        return as_html(self)

    @classmethod
    def load(
        cls, path: str | PathLike[str], *, materials: Mapping[int, int] | None = None
    ) -> Design:
        """Read a design from a file.

        Parameters
        ----------
        path : path
            A .json file, as `save` writes it, or VoxCad's .vxa, of which only the body is read.
        materials : dict of int to int, optional
            The digits for the material numbers of a .vxa. They override its palette, in which a
            material with a coefficient of thermal expansion (CTE) other than 0 is active.

        Raises
        ------
        ValueError
            If the file holds no design; the message begins with its name.
        OSError
            If the file can't be read.
        """
        array, lattice = design_files.load(Path(path), materials=materials)
        return cls(array, shape=lattice)

    def save(self, path: str | PathLike[str], *, force: bool = False) -> None:
        """Write the design into a file, whole or not at all.

        Parameters
        ----------
        path : path
            A .json file, or a .vxa file for VoxCad: that has the body and two materials, one of
            which expands with temperature, but no mechanics.
        force : bool
            Whether to replace an existing file.

        Raises
        ------
        ValueError
            If the ending is another, or the design has several phases, which a .vxa can't express.
        softvox_gym.files.OutputError
            If the file can't be written, or exists.
        """
        design_files.save(Path(path), self.digits, self.lattice, force=force)

    @property
    def shape(self) -> tuple[int, int, int]:
        """The lattice's sides (nx, ny, nz)."""
        return self.lattice[:]

    @property
    def digits(self) -> str:
        """The digits d_0 d_1 d_2 ... as a string."""
        return self._digits.translate(_DIGIT_TO_CHARACTER).decode("ascii")

    @property
    def index(self) -> int:
        """The design's number, sum of d_i 3^i."""
        return number_of(self._digits, self.lattice.states)

    @property
    def array(self) -> NDArray[np.uint8]:
        """The digits as an array of shape (nx, ny, nz), indexed [x, y, z]; read-only."""
        return np.frombuffer(self._digits, dtype=np.uint8).reshape(self.lattice, order="F")

    @property
    def n_voxels(self) -> int:
        """How many voxels are present."""
        return len(self._digits) - self._digits.count(ABSENT)

    @property
    def n_active(self) -> int:
        """How many voxels are active."""
        return self.n_voxels - self._digits.count(PASSIVE)

    @property
    def kinds(self) -> NDArray[np.uint8]:
        """The digits 0 absent, 1 passive, 2 active at any phase, shape (nx, ny, nz)."""
        return self.lattice.pumped(self.array)[0]

    @property
    def phase(self) -> NDArray[np.float64]:
        """The phase of every voxel's actuation in cycles, shape (nx, ny, nz); 0 if passive."""
        phase = self.lattice.pumped(self.array)[1]
        return np.zeros(self.shape) if phase is None else phase

    @property
    def components(self) -> tuple[tuple[int, ...], ...]:
        """The sites of each piece (voxels connected by faces), ordered by first site."""
        return _components(bytes(digit != ABSENT for digit in self._digits), self.lattice)

    @property
    def is_connected(self) -> bool:
        """Whether the robot is in one piece. The empty design is not."""
        return len(self.components) == 1

    def rotated(self, k: int = 1) -> Design:
        """Turn the robot about the vertical.

        Parameters
        ----------
        k : int
            Quarter turns, counter-clockwise seen from above (+x goes to +y). If k is odd, the
            lattice's shape becomes (ny, nx, nz).
        """
        return self._like(np.rot90(self.array, whole("k", k)))

    def mirrored(self) -> Design:
        """Mirror the robot in a plane across x (x becomes nx - 1 - x)."""
        return self._like(self.array[::-1])

    def refined(self, factor: int, *, expansion: str = "spherical") -> Design:
        """Build every voxel from factor^3 smaller ones.

        Parameters
        ----------
        factor : int
            The number of smaller voxels along an edge.
        expansion : {"spherical", "uniform"}
            Which smaller voxels of an active one are active: the middle one, whose links to the six
            in the middle of the faces then grow and shrink (needs an odd factor), or all.

        Raises
        ------
        TypeError, ValueError
            If the factor is not a positive whole number, or is even with spherical expansion, the
            expansion is unknown, or the lattice would have too many sites.
        """
        return self._like(refined(self.array, factor, expansion=expansion))

    def _like(self, array: NDArray[np.uint8]) -> Design:
        """Return a design with the same number of phases."""
        return Design(array, shape=Lattice.of(array.shape, phases=self.lattice.phases))

    def canonical(self, *, reflections: bool = True) -> Design:
        """Return the representative of all designs equal to this when turned (and mirrored).

        It has the smallest shape and then the smallest index. Gravity and the floor are the same
        for every heading, so these designs travel equally far, apart from the asymmetry of the
        beams' frames (a few thousandths of the distance; more if a robot falls over).

        Parameters
        ----------
        reflections : bool
            Whether mirror images count as the same.
        """
        poses = [self.rotated(k) for k in range(4)]
        if reflections:
            poses += [pose.mirrored() for pose in poses]
        return min(poses, key=lambda pose: (pose.shape, pose.index))


_DIGIT_TO_CHARACTER = bytes.maketrans(bytes(range(10)), digits_ascii.encode())
_CHARACTER_TO_DIGIT = bytes.maketrans(digits_ascii.encode(), bytes(range(10)))


def refined(
    stack: NDArray[np.uint8], factor: int, *, expansion: str = "spherical"
) -> NDArray[np.uint8]:
    """Return designs as `Design.refined` does, digits of shape (..., nx, ny, nz)."""
    factor = whole("factor", factor)
    if factor < 1:
        raise ValueError(f"factor must be a positive whole number, got {factor}")
    if expansion not in EXPANSIONS:
        raise ValueError(f"expansion must be one of {', '.join(EXPANSIONS)}, got {expansion!r}")
    Lattice.of([factor * side for side in stack.shape[-3:]])
    fine: NDArray[np.uint8] = repeated(stack, factor)
    if expansion == "uniform":
        return fine
    if factor % 2 == 0:
        raise ValueError(
            f"factor must be odd if expansion is spherical, to have a middle; got {factor}"
        )
    middle = slice(factor // 2, None, factor)
    made: NDArray[np.uint8] = np.minimum(fine, PASSIVE).astype(np.uint8)
    made[..., middle, middle, middle] = stack
    return made


def called(design: Design) -> int | str:
    """Return the usual name of a design: its number, or on other lattices its digits."""
    return design.index if design.lattice == Lattice() else design.digits


def written(text: str, lattice: Lattice) -> Design:
    """Return the design that a text stands for: a number, or the digits of all sites.

    A text with one character per site holds digits.

    Raises
    ------
    ValueError
        If it is neither.
    """
    is_number = len(text) != lattice.sites and re.fullmatch("0|[1-9][0-9]*", text)
    try:
        return Design(int(text) if is_number else text, shape=lattice)
    except ValueError:
        few = lattice.sites <= 40
        last = lattice.n_designs - 1 if few else f"{lattice.states}^{lattice.sites} - 1"
        shown = text if len(text) <= 40 else f"{text[:37]}..."
        raise ValueError(
            f"design {shown!r} is neither a number from 0 to {last} nor {lattice.sites} digits "
            f"{', '.join(map(str, range(lattice.states)))}"
        ) from None


def repeated(values: NDArray[Any], factor: int) -> NDArray[Any]:
    """Repeat values of voxels, shape (..., nx, ny, nz), for their factor^3 smaller ones."""
    for axis in (-3, -2, -1):
        values = np.repeat(values, factor, axis=axis)
    return values


def as_html(value: Any) -> str | None:
    """Return a design or a result as HTML; None if the package that draws it is missing."""
    for entry in entry_points(group="softvox_gym.notebook"):
        html: str | None = entry.load()(value)
        return html
    return None


def _digits_of_string(text: str, lattice: Lattice) -> bytes:
    _check_length(f"design {text[:80]!r}", len(text), lattice)
    if set(text) - set(digits_ascii[: lattice.states]):
        raise ValueError(f"design {text[:80]!r} may have the digits {_known(lattice)} only{_MORE}")
    return text.encode("ascii").translate(_CHARACTER_TO_DIGIT)


def _check_length(what: str, length: int, lattice: Lattice) -> None:
    if length != lattice.sites:
        raise ValueError(
            f"{what} has {length} digits, but a {lattice} lattice has {lattice.sites} sites; "
            "Design(..., shape=(nx, ny, nz)) uses another lattice"
        )


def _digits_of_array(values: ArrayLike, lattice: Lattice | None) -> tuple[bytes, Lattice]:
    array = _as_array(values)
    own = lattice or Lattice()
    if array.ndim == 0 and array.dtype.kind in "iuO":
        return own.digits(_whole_numbers(array)).tobytes(), own
    digits = checked_digits(array, own)
    if digits.ndim == 3:
        return digits.tobytes(order="F"), Lattice.of(digits.shape, phases=own.phases)
    if digits.ndim != 1:
        raise ValueError(
            "design must be a number, a row of digits or an (nx, ny, nz) array, "
            f"got an array of shape {digits.shape}"
        )
    _check_length("design", digits.size, own)
    return digits.tobytes(), own


def _as_array(values: Any) -> NDArray[Any]:
    """Return an array-like as an array; refuse bytes, text and ragged rows."""
    if isinstance(values, (bytes, bytearray, memoryview, str)):
        raise TypeError(
            f"designs must be whole numbers, got {type(values).__name__}; "
            "give a str of digits, or a list of them"
        )
    try:
        return np.asarray(values)
    except ValueError:
        raise ValueError("designs must have rows of equal length, got ragged rows") from None


def _whole_numbers(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array of design numbers; refuse objects that are not whole numbers."""
    if array.dtype == object:
        for value in array.ravel().tolist():
            if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
                raise TypeError(f"designs must be whole numbers, got {value!r}")
    return array


def _known(lattice: Lattice) -> str:
    """Return the digits that a site can have, in words."""
    *first, last = map(str, range(lattice.states))
    return f"{', '.join(first)} and {last}"


def checked_digits(
    values: ArrayLike, lattice: Lattice | None = None, *, what: str = "designs"
) -> NDArray[np.uint8]:
    """Return digits as uint8, checked for a lattice, by default for one phase.

    TypeError if they are not whole numbers, ValueError if the lattice lacks one.
    """
    lattice = lattice or Lattice()
    array = _as_array(values)
    if array.dtype.kind not in "iu" and array.size:
        raise TypeError(
            f"designs must be whole numbers, got {array.dtype} values; "
            "use an integer dtype, a number, or a string of digits"
        )
    if array.size and (array.min() < ABSENT or array.max() >= lattice.states):
        bad = array[(array < ABSENT) | (array >= lattice.states)].flat[0]
        more = _MORE if what == "designs" else ""
        raise ValueError(f"{what} may have the digits {_known(lattice)} only, got {bad}{more}")
    return array.astype(np.uint8)


def _components(occupied: bytes, lattice: Lattice) -> tuple[tuple[int, ...], ...]:
    waiting = {site for site, present in enumerate(occupied) if present}
    pieces = []
    for first in range(len(occupied)):
        if first in waiting:
            waiting.discard(first)
            piece = [first]
            for site in piece:
                near = waiting.intersection(lattice.neighbours(site))
                waiting -= near
                piece += near
            pieces.append(tuple(sorted(piece)))
    return tuple(pieces)


def _is_one(occupied: bytes, lattice: Lattice) -> bool:
    """Return whether a body is in one piece; an empty one is not."""
    return len(_components(occupied, lattice)) == 1


_is_known_as_one = lru_cache(maxsize=65536)(_is_one)


class BodyFacts(NamedTuple):
    """Facts about the bodies of a batch of designs, each of shape (n,)."""

    n_voxels: NDArray[np.int64]
    n_active: NDArray[np.int64]
    is_connected: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: NDArray[Any], lattice: Lattice) -> BodyFacts:
        """Return the facts of designs given by their digits, shape (n, sites)."""
        occupied = rows != ABSENT
        # Many designs share a body, whatever the phases, so results for small bodies are cached.
        sites = Lattice(*lattice)
        is_one: Any = _is_known_as_one if lattice.sites <= REMEMBERED else _is_one
        bodies = np.ascontiguousarray(occupied).view(np.dtype((np.void, lattice.sites)))
        return cls(
            n_voxels=np.count_nonzero(occupied, axis=1).astype(np.int64),
            n_active=np.count_nonzero(rows >= ACTIVE, axis=1).astype(np.int64),
            is_connected=np.array(
                [is_one(one, sites) for one in bodies.ravel().tolist()], np.bool_
            ),
        )


def actuators(design: Design) -> tuple[tuple[int, ...], ...]:
    """Return the sites of each actuator, ordered by first site.

    An actuator is a group of active voxels of one slice (of equal z) that are connected by faces
    and share a phase: in robots built from the paper's kit holes connect them, so they share their
    air. Slices are bonded without holes.

    Source: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft
    2020, the protocol of building.

    Examples
    --------
    >>> actuators(Design("22021222"))
    ((0, 1, 3), (5, 6, 7))
    """
    array, (nx, ny, nz) = design.array, design.lattice
    groups = [
        tuple(nx * ny * z + site for site in piece)
        for z in range(nz)
        for digit in range(ACTIVE, design.lattice.states)
        for piece in _components((array[:, :, z] == digit).tobytes("F"), Lattice(nx, ny, 1))
    ]
    return tuple(sorted(groups))


def buildable(rows: NDArray[Any], lattice: Lattice) -> NDArray[np.bool_]:
    """Return which designs the paper's kit can build, shape (n,).

    A buildable design is in one piece. Active voxels that share a face within a slice (of equal z)
    are joined through holes, so they must share a phase, as one actuator (`actuators`). Each
    actuator must have a voxel on the surface, for its inlet; a closed hollow is not surface.
    `softvox_gym.build.plan` reports why a design can't be built.

    Parameters
    ----------
    rows : ndarray, shape (n, sites)
        Digits.
    lattice : Lattice
        With one or several phases.

    Source: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft
    2020, the protocol of building.

    Examples
    --------
    >>> two = Lattice.of((2, 2, 2), phases=2)
    >>> buildable(np.array([[2, 3, 0, 0, 0, 0, 0, 0], [2, 0, 0, 0, 3, 0, 0, 0]]), two)
    array([False,  True])
    """
    blocks = np.split(rows, range(_AT_ONCE, len(rows), _AT_ONCE))
    # Designs are the last axis: numpy is slow over axes of length two or three.
    stacks = (np.moveaxis(lattice.to_stack(one), 0, -1).copy() for one in blocks)
    has_actuators = [_has_actuators(stack) for stack in stacks]
    return BodyFacts.of(rows, lattice).is_connected & np.concatenate(has_actuators)


def closed_hollows(present: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the absent sites without a path from outside, both of shape (nx, ny, nz, n)."""
    absent = ~present
    if min(present.shape[:3]) < 3:  # the usual case: every site is on the rim
        return np.zeros_like(absent)
    rim = absent.copy()
    rim[1:-1, 1:-1, 1:-1] = False
    return np.asarray(absent & ~_spread(rim, absent, FACES))


def _has_actuators(stack: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which designs of a stack, (nx, ny, nz, n), have actuators that the kit can build."""
    if (closed := closed_hollows(stack != ABSENT)).any():
        stack = np.where(closed, PASSIVE, stack)
    active, around = stack >= ACTIVE, [_beside(stack, face) for face in FACES]
    torn = reduce(or_, ((one >= ACTIVE) & (one != stack) for one in around[:4])) & active
    has_inlet = reduce(or_, (one == ABSENT for one in around)) & active
    is_sound: NDArray[np.bool_] = ~torn & (_spread(has_inlet, active, FACES[:4]) | ~active)
    return np.asarray(is_sound.all(axis=(0, 1, 2)))


def _spread(
    begin: NDArray[np.bool_], within: NDArray[np.bool_], faces: Sequence[tuple[int, int, int]]
) -> NDArray[np.bool_]:
    """Return which sites of a mask can be reached from given ones, all (nx, ny, nz, n)."""
    made, reached = begin.copy(), 0
    while (count := int(made.sum())) > reached:
        reached = count
        made |= reduce(or_, (_beside(made, face) for face in faces)) & within
    return made


def _beside(stack: NDArray[Any], face: tuple[int, int, int]) -> NDArray[Any]:
    """Return the neighbour at a face of every site, shape (nx, ny, nz, n); 0 if outside."""
    padded = np.pad(stack, [(1, 1), (1, 1), (1, 1), (0, 0)])
    x, y, z = (slice(1 + d, 1 + d + n) for d, n in zip(face, stack.shape, strict=False))
    return padded[x, y, z]


def stack_of(designs: Any, *, shape: Sequence[int] | None = None) -> NDArray[np.uint8]:
    """Return a batch of designs as one array.

    Parameters
    ----------
    designs : Design, int, str, sequence of these, or array_like
        One design or many. A 1-D array or a list of ints holds design numbers, an (n, sites) array
        rows of digits, and an (n, nx, ny, nz) array digits indexed [x, y, z]. Anything that NumPy
        can turn into an array is accepted.
    shape : (int, int, int), optional
        The lattice of numbers and rows of digits; by default 2x2x2.

    Returns
    -------
    ndarray of uint8, shape (n, nx, ny, nz)

    Raises
    ------
    TypeError, ValueError
        As `Design` does, if the designs do not share one lattice, or for a flat row with as many
        digits as the lattice has sites, which could be one design or many numbers.
    """
    return batch_of(designs, shape=shape)[0]


def batch_of(
    designs: Any, *, shape: Sequence[int] | None = None
) -> tuple[NDArray[np.uint8], Lattice]:
    """Return a batch as `stack_of` does, and its lattice."""
    lattice = None if shape is None else Lattice.of(shape)
    own = lattice or Lattice()
    if isinstance(designs, (Design, str, int, np.integer)):
        return _joined([Design(designs, shape=lattice)])
    array = _batch_array(designs)
    if array.ndim == 0:
        return _joined([Design(array, shape=lattice)])
    is_row = array.ndim == 1 and array.dtype.kind in "OU"
    if is_row and not all(isinstance(design, (int, np.integer)) for design in array):
        return _joined([Design(design, shape=lattice) for design in array])
    if array.ndim == 1 and array.size == 0:
        return np.zeros((0, *own), dtype=np.uint8), own
    if array.ndim == 1 and array.dtype.kind in "iuO":
        numbers = _whole_numbers(array)
        _check_unambiguous(numbers, own)
        return own.to_stack(own.digits(numbers)), own
    digits = checked_digits(array, own)
    if digits.ndim == 2 and digits.shape[1] == own.sites:
        return own.to_stack(digits), own
    if digits.ndim == 4 and (lattice is None or lattice[:] == digits.shape[1:]):
        return digits, Lattice.of(digits.shape[1:], phases=own.phases)
    raise ValueError(
        f"designs must be an array of shape (n,) of design numbers, (n, {own.sites}) of digits or "
        f"(n, {', '.join(map(str, lattice)) if lattice else 'nx, ny, nz'}) of digits, "
        f"got shape {array.shape}; Design(..., shape=(nx, ny, nz)) uses another lattice"
    )


def _joined(designs: Sequence[Design]) -> tuple[NDArray[np.uint8], Lattice]:
    """Return the stack and the lattice of designs; ValueError if they share none."""
    first, *others = dict.fromkeys(design.lattice for design in designs)
    if others:
        given = ", ".join(map(str, [first, *others]))
        raise ValueError(f"designs must share one lattice, got {given}")
    return np.stack([design.array for design in designs]), first


def _batch_array(designs: Any) -> NDArray[Any]:
    """Return a batch as an array, or as a row of objects."""
    if hasattr(designs, "__array__") or isinstance(designs, (bytes, bytearray, memoryview)):
        return _as_array(designs)
    try:
        return np.fromiter(designs, dtype=object)
    except TypeError:
        raise TypeError(
            f"designs must be a design or a batch of designs, got {designs!r}"
        ) from None


def _check_unambiguous(numbers: NDArray[Any], lattice: Lattice) -> None:
    """Refuse a row that could be the digits of one design."""
    if numbers.size == lattice.sites > 1 and 0 <= numbers.min() <= numbers.max() < lattice.states:
        row = numbers.tolist()
        shown = row if len(row) <= 16 else f"a row of {len(row)} digits"
        raise ValueError(
            f"designs {shown} may be the digits of one design or {len(row)} design numbers; give "
            "Design(row) or [row] for one design, [Design(i) for i in row] for numbers"
        )
