"""Designs that are the same robot seen from another heading, and how equally they travel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import DEFAULT_SHAPE, N_SITES, indices_of
from softvox_gym.landscapes.analysis.graph import all_digits, checked_fitness

#: Voxel widths. Differences of fitness between turned and mirrored robots are counted above these.
SPREADS = (0.001, 0.01, 0.1, 1.0)


@dataclass(frozen=True)
class Symmetry:
    """How alike the members of the symmetry classes travel.

    Parameters
    ----------
    n_classes : int
    sizes : dict of int to int
        How many classes have that many members.
    above : dict of float to int
        How many classes have a spread (largest less smallest fitness) above that many voxel
        widths.
    largest_spread : float
        Voxel widths.
    largest_in : int
        The design that stands for the class with that spread.
    within : float or None
        Share of the landscape's variance that lies within the classes: 0 were the model symmetric.
        None where all fitness is equal.
    """

    n_classes: int
    sizes: dict[int, int]
    above: dict[float, int]
    largest_spread: float
    largest_in: int
    within: float | None


@dataclass(frozen=True)
class Broken:
    """How much one symmetry changes fitness: by nothing, were the model symmetric.

    Parameters
    ----------
    symmetry : str
    above : dict of float to int
        How many designs travel differently by more than that many voxel widths.
    largest : float
        The largest difference, voxel widths.
    largest_in : int
        The smallest design for which it is that large.
    """

    symmetry: str
    above: dict[float, int]
    largest: float
    largest_in: int


#: The symmetries of a square in the order of `symmetries`; turns are seen from above.
NAMES = (
    "none",
    "quarter turn to the left",
    "half turn",
    "quarter turn to the right",
    "mirror across x",
    "mirror that swaps x and y",
    "mirror across y",
    "mirror that swaps x and -y",
)


@lru_cache(maxsize=4)
def symmetry_classes(*, reflections: bool = True) -> NDArray[np.int64]:
    """Return for every design the one that stands for its symmetry class.

    A class holds the designs that a quarter turn about the vertical (the group C4), or a turn or a
    mirror in a vertical plane (C4 with reflections, the eight symmetries of a square), makes of one
    another.

    Parameters
    ----------
    reflections : bool
        Whether mirror images count as the same.

    Returns
    -------
    ndarray of int64, shape (6561,)
        The smallest number in the class of each design, as `Design.canonical` has it. Read-only.

    Notes
    -----
    There are 1665 classes without reflections and 1035 with them, as Burnside's lemma says: a
    symmetry that moves the eight sites in c cycles leaves 3^c designs as they are, so there are
    (3^8 + 2 * 3^2 + 3^4) / 4, and (3^8 + 2 * 3^2 + 3^4 + 2 * 3^4 + 2 * 3^6) / 8.

    Source: W. Burnside, Theory of Groups of Finite Order, 2nd ed., 1911, section 145.
    """
    images = [image(sites) for sites in symmetries(reflections=reflections)]
    smallest: NDArray[np.int64] = np.min(images, axis=0)
    smallest.flags.writeable = False
    return smallest


def symmetries(*, reflections: bool = True) -> list[NDArray[np.int64]]:
    """Return the symmetries as orders of the sites: digits[order] is the design turned.

    Parameters
    ----------
    reflections : bool
        Whether to give the four mirrors after the four turns.
    """
    sites = np.arange(N_SITES).reshape(DEFAULT_SHAPE, order="F")
    poses = [np.rot90(sites, k) for k in range(4)]
    if reflections:
        poses += [pose[::-1] for pose in poses]
    return [pose.ravel(order="F") for pose in poses]


def image(sites: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of every design after a symmetry, one of `symmetries`, shape (6561,)."""
    return indices_of(all_digits()[:, sites])


def members(representative: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the classes as arrays of design numbers, ordered by their smallest number.

    Parameters
    ----------
    representative : ndarray of int64, shape (6561,)
        As `symmetry_classes` returns it.
    """
    order = np.argsort(representative, kind="stable")
    starts = np.flatnonzero(np.diff(representative[order])) + 1
    return list(np.split(order, starts))


def symmetry(fitness: ArrayLike, *, reflections: bool = True) -> Symmetry:
    """Return how alike the members of each symmetry class travel.

    Gravity, floor and voxels look the same from every heading; the engine's beams do not quite,
    so that members differ where the difference is amplified, as when a robot falls over.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.
    reflections : bool
        Whether mirror images count as the same.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.
    """
    values = checked_fitness(fitness)
    representative = symmetry_classes(reflections=reflections)
    classes = members(representative)
    spreads = np.array([np.ptp(values[group]) for group in classes])
    sizes, counts = np.unique([len(group) for group in classes], return_counts=True)
    widest = int(spreads.argmax())
    within = sum(float(((values[group] - values[group].mean()) ** 2).sum()) for group in classes)
    total = float(((values - values.mean()) ** 2).sum())
    return Symmetry(
        n_classes=len(classes),
        sizes={int(size): int(count) for size, count in zip(sizes, counts, strict=True)},
        above={limit: int((spreads > limit).sum()) for limit in SPREADS},
        largest_spread=float(spreads[widest]),
        largest_in=int(classes[widest][0]),
        within=within / total if np.ptp(values) else None,
    )


def broken(fitness: ArrayLike) -> tuple[Broken, ...]:
    """Return how much each of the seven symmetries, turns first, changes fitness.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.
    """
    values = checked_fitness(fitness)
    made = []
    for name, sites in list(zip(NAMES, symmetries(), strict=True))[1:]:
        change = np.abs(values[image(sites)] - values)
        above = {limit: int((change > limit).sum()) for limit in SPREADS}
        made.append(Broken(name, above, float(change.max()), int(change.argmax())))
    return tuple(made)
