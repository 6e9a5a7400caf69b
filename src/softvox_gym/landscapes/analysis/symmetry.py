"""Symmetry classes: designs that are one robot seen from other headings, and their spread."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.landscapes.analysis.graph import N_SITES, all_digits, read_only
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import LATTICE, bodies

#: Voxel widths; differences between turned and mirrored robots above these are counted.
SPREADS = (0.001, 0.01, 0.1, 1.0)

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

_ABOVE = tuple(Column(f"above_{limit:g}", f"> {limit:g}") for limit in SPREADS)


@lru_cache(maxsize=2)
def symmetry_classes(*, reflections: bool = True) -> NDArray[np.int64]:
    """Return for every design the representative of its symmetry class, shape (6561,).

    A class holds the designs that a quarter turn about the vertical (the group C4), or a turn or a
    mirror in a vertical plane (C4 with reflections, the eight symmetries of a square), makes of one
    another.

    Parameters
    ----------
    reflections : bool
        Whether mirror images count as the same.

    Notes
    -----
    The smallest number in the class represents it, as in `Design.canonical`. Read-only.

    There are 1665 classes without reflections and 1035 with them, by Burnside's lemma: a symmetry
    that moves the eight sites in c cycles leaves 3^c designs unchanged. So the numbers are
    (3^8 + 2 * 3^2 + 3^4) / 4, and (3^8 + 2 * 3^2 + 3^4 + 2 * 3^4 + 2 * 3^6) / 8.

    Source: W. Burnside, Theory of Groups of Finite Order, 2nd ed., 1911, section 145.
    """
    images = [image(sites) for sites in symmetries(reflections=reflections)]
    return read_only(np.min(images, axis=0))


def symmetries(*, reflections: bool = True) -> list[NDArray[np.int64]]:
    """Return the symmetries as orders of the sites: digits[order] is the design turned.

    The four turns come first, then, with reflections, the four mirrors.
    """
    sites = LATTICE.to_stack(np.arange(N_SITES))
    poses = [np.rot90(sites, k) for k in range(4)]
    if reflections:
        poses += [pose[::-1] for pose in poses]
    return [LATTICE.to_rows(pose) for pose in poses]


def image(sites: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of every design after a symmetry, one of `symmetries`, shape (6561,)."""
    return LATTICE.numbers(all_digits()[:, sites])


def members(representative: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the classes of `symmetry_classes` as arrays of design numbers, the smallest first."""
    order = np.argsort(representative, kind="stable")
    starts = np.flatnonzero(np.diff(representative[order])) + 1
    return list(np.split(order, starts))


def symmetry(fitness: NDArray[np.float64]) -> Section:
    """Return how equally the members of each symmetry class travel.

    Gravity, floor and voxels are the same for every heading; the engine's beams are not quite. So
    members differ if the difference is amplified, as when a robot falls over.

    Parameters
    ----------
    fitness : ndarray, shape (6561,)
        Finite.
    """
    return Section(
        title="Symmetry",
        note="A class holds the designs that turns about the vertical (and mirrors in vertical "
        "planes) make of one another. Were the model symmetric, all members would travel equally "
        "far; the spread is their largest less their smallest fitness. The columns count the "
        "classes with a larger spread, then give the largest spread, the class that has it (its "
        "smallest design), and the share of all variance of fitness that lies within classes.",
        columns=(
            Column("symmetry", "same but for"),
            Column("classes", "classes"),
            *_ABOVE,
            Column("largest_spread", "spread", ".4f"),
            Column("largest_in", "in class"),
            Column("within", "within", ".1%"),
            Column("sizes"),
        ),
        rows=[
            _alike("turns", fitness, members(symmetry_classes(reflections=False))),
            _alike("turns and mirrors", fitness, members(symmetry_classes())),
        ],
    )


def _alike(
    name: str, fitness: NDArray[np.float64], classes: list[NDArray[np.int64]]
) -> tuple[Any, ...]:
    spreads = np.array([np.ptp(fitness[group]) for group in classes])
    sizes, counts = np.unique([len(group) for group in classes], return_counts=True)
    widest = int(spreads.argmax())
    within = sum(float(((fitness[group] - fitness[group].mean()) ** 2).sum()) for group in classes)
    total = float(((fitness - fitness.mean()) ** 2).sum())
    return (
        name,
        len(classes),
        *_counts(spreads),
        float(spreads[widest]),
        int(classes[widest][0]),
        within / total if np.ptp(fitness) else None,
        dict(zip(sizes.tolist(), counts.tolist(), strict=True)),
    )


def broken(fitness: NDArray[np.float64]) -> Section:
    """Return how much each of the seven symmetries, turns first, changes fitness, shape (6561,)."""
    rows = []
    for name, sites in list(zip(NAMES, symmetries(), strict=True))[1:]:
        change = np.abs(fitness[image(sites)] - fitness)
        rows.append((name, *_counts(change), float(change.max()), int(change.argmax())))
    return Section(
        title="Symmetries one by one",
        note="How many designs the symmetry makes travel further or less far by more than so many "
        "voxel widths, the largest difference, and a design that shows it.",
        columns=(
            Column("symmetry", "symmetry"),
            *_ABOVE,
            Column("largest", "largest", ".3g"),
            Column("largest_in", "design"),
        ),
        rows=rows,
        screen=0,
    )


def classes(fitness: NDArray[np.float64]) -> Section:
    """Return the classes under turns and mirrors, the most unequal first; fitness as above."""
    rows: list[tuple[Any, ...]] = []
    for group in members(symmetry_classes()):
        own = fitness[group]
        rows.append(
            (
                int(group[0]),
                Design(int(group[0])).digits,
                len(group),
                *map(float, (own.max(), own.mean(), own.min(), np.ptp(own))),
                int(group[own.argmax()]),
                *(facts[group[0]].item() for facts in bodies()),
            )
        )
    rows.sort(key=lambda row: -row[6])
    return Section(
        title="Classes whose members travel most unequally",
        note="Under turns and mirrors. The file classes.csv has all of them.",
        columns=(
            Column("class", "class"),
            Column("digits", "digits"),
            Column("size", "size"),
            *(Column(key, key, ".4f") for key in ("best", "mean", "worst", "spread")),
            *map(Column, ("fittest", "n_voxels", "n_active", "is_connected")),
        ),
        rows=rows,
        file="classes.csv",
        screen=0,
        document=20,
    )


def _counts(values: NDArray[np.float64]) -> list[int]:
    return [int((values > limit).sum()) for limit in SPREADS]
