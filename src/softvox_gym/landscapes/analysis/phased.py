"""Analysis of landscapes of several phases, with millions of designs, in seconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import BodyFacts, Design, buildable
from softvox_gym.landscapes.analysis.summary import QUANTILES, Analysis
from softvox_gym.landscapes.analysis.symmetry import SPREADS, symmetries
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import all_digits, landscape
from softvox_gym.lattice import Lattice

#: Voxel widths; designs that travel further than each are counted.
THRESHOLDS = (1.0, 2.0, 3.0, 4.0)

#: Number of listed designs, the fittest of all and the fittest buildable ones.
LISTED = 20

Array = NDArray[np.float64]


def analyse_phased(fitness: ArrayLike, lattice: Lattice) -> Analysis:
    """Analyse a landscape of one or several phases, exactly; seconds even for millions of designs.

    Parameters
    ----------
    fitness : array_like, shape (n,)
        Entry i belongs to design i of the lattice, 2x2x2 with any number of phases. NaN, a design
        that diverged, counts as 0.
    lattice : Lattice

    Raises
    ------
    ValueError
        If the length is not the number of designs of the lattice.
    """
    values = np.asarray(fitness, dtype=np.float64)
    if values.shape != (lattice.n_designs,):
        raise ValueError(
            f"fitness must have shape ({lattice.n_designs},), entry i for design i of the "
            f"{lattice} lattice; got {values.shape}"
        )
    lost = np.isnan(values)
    values = np.where(lost, 0.0, values)
    digits = all_digits(lattice)
    can_be_built = buildable(digits, lattice)
    groups = {
        "all designs": np.full(len(values), True),
        "in one piece": BodyFacts.of(digits, lattice).is_connected,
        "buildable": can_be_built,
    }
    return Analysis(
        fitness=values,
        n_diverged=int(lost.sum()),
        sections={
            "kinds": _kinds(values, groups),
            "symmetry": _symmetry(values, lattice, can_be_built),
            "local_optima": _local_optima(values, lattice, can_be_built),
            "best": _best(values, lattice, can_be_built),
        },
    )


def _grid(values: NDArray[np.generic], lattice: Lattice) -> NDArray[np.generic]:
    """Return values of all designs with an axis per site, the last site's first."""
    return values.reshape((lattice.states,) * lattice.sites)


def images(values: NDArray[np.generic], lattice: Lattice) -> list[NDArray[np.generic]]:
    """Return the values of the images of every design under the eight symmetries, each (n,).

    For a lattice of 2x2x2 sites with any phases; the symmetries are those of `symmetries`.
    """
    last = lattice.sites - 1
    made = []
    for order in symmetries():
        axes = np.empty(lattice.sites, dtype=np.int64)
        axes[last - order] = last - np.arange(lattice.sites)
        made.append(_grid(values, lattice).transpose(axes).ravel())
    return made


def best_of_class(fitness: Array, lattice: Lattice) -> Array:
    """Return for every design the best fitness in its symmetry class, shape (n,)."""
    best: Array = np.max(images(fitness, lattice), axis=0)
    return best


def is_peak(fitness: Array, lattice: Lattice) -> NDArray[np.bool_]:
    """Return which designs are fitter than all their neighbours in one site, shape (n,)."""
    grid = _grid(fitness, lattice)
    peak = np.full(grid.shape, True)
    for axis in range(grid.ndim):
        best = grid.max(axis=axis, keepdims=True)
        alone = (grid == best).sum(axis=axis, keepdims=True) == 1
        peak &= (grid == best) & alone
    return peak.ravel()


def _kinds(fitness: Array, groups: dict[str, NDArray[np.bool_]]) -> Section:
    published = float(landscape()["fitness"].max())
    rows = []
    for name, group in groups.items():
        own, designs = fitness[group], np.flatnonzero(group)
        best = int(own.argmax())
        rows.append(
            (
                name,
                len(own),
                float(own[best]),
                int(designs[best]),
                int((own == own[best]).sum()),
                int((own > published).sum()),
                float(own.mean()),
                *map(float, np.quantile(own, QUANTILES)),
                *(float((own > limit).mean()) for limit in THRESHOLDS),
            )
        )
    return Section(
        title="Kinds of designs",
        note="The best fitness, the design that has it (the smallest number), how many have it to "
        "the bit, how many designs travel further than the best of one phase, the mean, quantiles "
        "of fitness, and the share of designs that travel further than so many voxel widths. "
        "Buildable are those that the paper's kit can make: in one piece, and active voxels that "
        "touch within a slice share a phase.",
        columns=(
            Column("kind", "fitness of"),
            Column("designs", "designs"),
            Column("best", "best", ".4f"),
            Column("fittest", "fittest"),
            Column("ties", "ties"),
            Column("beat_one_phase", f"> {published:.4f}"),
            Column("mean", "mean", ".4f"),
            *(Column(f"q{100 * q:g}", f"{100 * q:g} %", ".4f") for q in QUANTILES),
            *(Column(f"above_{limit:g}", f"> {limit:g}", ".4%") for limit in THRESHOLDS),
        ),
        rows=rows,
        is_transposed=True,
    )


def _symmetry(fitness: Array, lattice: Lattice, can_be_built: NDArray[np.bool_]) -> Section:
    numbers = np.arange(lattice.n_designs)
    is_first = np.min(images(numbers, lattice), axis=0) == numbers
    turned = images(fitness, lattice)
    spread = np.max(turned, axis=0) - np.min(turned, axis=0)
    rows = []
    for name, group in (("all designs", is_first), ("buildable", is_first & can_be_built)):
        own = spread[group]
        widest = int(own.argmax())
        rows.append(
            (
                name,
                len(own),
                *(int((own > limit).sum()) for limit in SPREADS),
                float(own[widest]),
                int(numbers[group][widest]),
            )
        )
    return Section(
        title="Symmetry",
        note="Classes of designs that turns about the vertical and mirrors in vertical planes make "
        "of one another. The columns count the classes in which fitness differs by more than so "
        "many voxel widths, then give the largest difference and the smallest design of its class.",
        columns=(
            Column("group", "classes of"),
            Column("classes", "classes"),
            *(Column(f"above_{limit:g}", f"> {limit:g}") for limit in SPREADS),
            Column("largest_spread", "spread", ".4f"),
            Column("largest_in", "in class"),
        ),
        rows=rows,
    )


def _local_optima(fitness: Array, lattice: Lattice, can_be_built: NDArray[np.bool_]) -> Section:
    peaks = np.flatnonzero(is_peak(fitness, lattice))
    rows = []
    for name, own in (("all designs", peaks), ("buildable", peaks[can_be_built[peaks]])):
        heights = fitness[own] if len(own) else np.zeros(1)
        counts = ((heights > limit).sum() for limit in THRESHOLDS)
        rows.append(
            (name, len(own), float(heights.min()), float(np.median(heights)), *map(int, counts))
        )
    return Section(
        title="Local optima",
        note="Designs that are fitter than every design that differs from them at one site "
        f"({lattice.sites * (lattice.states - 1)} of them): how many there are, the lowest and the "
        "median fitness, and how many travel further than so many voxel widths. Of the buildable, "
        "those among them that can be built.",
        columns=(
            Column("group", "local optima of"),
            Column("number", "number"),
            Column("lowest", "lowest", ".4f"),
            Column("median", "median", ".4f"),
            *(Column(f"above_{limit:g}", f"> {limit:g}") for limit in THRESHOLDS),
        ),
        rows=rows,
    )


def _best(fitness: Array, lattice: Lattice, can_be_built: NDArray[np.bool_]) -> Section:
    order = np.argsort(-fitness, kind="stable")
    lists = (order[:LISTED], order[can_be_built[order]][:LISTED])
    rows = []
    for name, designs in zip(("all designs", "buildable"), lists, strict=True):
        for rank, number in enumerate(designs.tolist(), start=1):
            design = Design(number, shape=lattice)
            facts = (design.n_voxels, design.n_active, bool(can_be_built[number]))
            rows.append((name, rank, number, design.digits, float(fitness[number]), *facts))
    return Section(
        title="The fittest",
        note="Of all designs, and of those that the kit can build.",
        columns=(
            Column("group", "of"),
            Column("rank", "rank"),
            Column("design", "design"),
            Column("digits", "digits"),
            Column("fitness", "fitness", ".4f"),
            Column("n_voxels", "voxels"),
            Column("n_active", "active"),
            Column("is_buildable", "buildable"),
        ),
        rows=rows,
        screen=0,
    )
