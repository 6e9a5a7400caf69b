"""Everything about one landscape: `analyse`, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.landscapes.analysis.optima import climbs, local_optima, optima
from softvox_gym.landscapes.analysis.robustness import after_error, every_design, robustness
from softvox_gym.landscapes.analysis.ruggedness import neutrality, ruggedness
from softvox_gym.landscapes.analysis.symmetry import broken, classes, symmetry
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import N_DESIGNS, bodies

QUANTILES = (0.1, 0.5, 0.9, 0.99)


@dataclass(frozen=True, eq=False)
class Analysis:
    """A landscape, analysed exactly. Lengths are in voxel widths.

    Parameters
    ----------
    fitness : ndarray, shape (6561,)
        As analysed: 0 if a design diverged.
    n_diverged : int
    sections : dict of str to Section
        The findings, by subject: tables with the meaning of their numbers.
    """

    fitness: NDArray[np.float64]
    n_diverged: int
    sections: dict[str, Section]

    @property
    def title(self) -> str:
        """What was analysed, in a line."""
        diverged = f", {self.n_diverged} diverged count as 0" if self.n_diverged else ""
        return f"Analysis of all {len(self.fitness)} designs (lengths in voxel widths{diverged})"

    def text(self) -> str:
        """Return the analysis as aligned text for a screen."""
        shown = [section.text() for section in self.sections.values() if section.screen != 0]
        return "\n\n".join([self.title, *shown])

    def markdown(self) -> str:
        """Return the analysis with more rows and explanations, as a Markdown document."""
        shown = [section.markdown() for section in self.sections.values() if section.document != 0]
        return "\n".join([f"# {self.title}\n", *shown])

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the tables per design, optimum and class, ready for JSON."""
        return {
            "n_designs": len(self.fitness),
            "n_diverged": self.n_diverged,
            **{key: section.to_dict() for key, section in self.sections.items() if section.note},
        }

    def tables(self) -> dict[str, str]:
        """Return the tables per optimum, class and design as CSV, by file name."""
        return {s.file: s.csv() for s in self.sections.values() if s.file}


def analyse(fitness: ArrayLike) -> Analysis:
    """Analyse the landscape of all designs of the 2x2x2 lattice, exactly.

    Nothing is sampled; it takes a fraction of a second.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        Entry i belongs to design i, such as `softvox_gym.landscape()["fitness"]`. NaN, a design
        that diverged, counts as 0, the reward that the environment gives for it.

    Raises
    ------
    TypeError, ValueError
        If the shape is another, a value is infinite, or values are not real numbers.

    Examples
    --------
    >>> import softvox_gym
    >>> from softvox_gym.landscapes.analysis import analyse
    >>> len(analyse(softvox_gym.landscape()["fitness"]).sections["local_optima"].rows)
    113
    """
    values = checked_fitness(fitness)
    tops, after = local_optima(values), after_error(values)
    return Analysis(
        fitness=values,
        n_diverged=int(np.isnan(np.asarray(fitness)).sum()),
        sections={
            "kinds": kinds(values),
            "symmetry": symmetry(values),
            "local_optima": optima(tops),
            "climbs": climbs(tops),
            "ruggedness": ruggedness(values),
            "neutrality": neutrality(values),
            "robustness": robustness(values, after),
            "symmetries": broken(values),
            "classes": classes(values),
            "neighbours": every_design(values, after),
        },
    )


def kinds(fitness: NDArray[np.float64]) -> Section:
    """Return statistics of the fitness, shape (6561,), of all designs and of each kind."""
    is_empty, is_connected = bodies().n_voxels == 0, bodies().is_connected
    kinds = {
        "all designs": np.full(N_DESIGNS, True),
        "in one piece": is_connected,
        "in several pieces": ~is_connected & ~is_empty,
        "empty": is_empty,
        "without active voxel": bodies().n_active == 0,
    }
    rows = []
    for name, kind in kinds.items():
        designs = np.flatnonzero(kind)
        own = fitness[designs]
        numbers = [own.max(), own.mean(), *np.quantile(own, QUANTILES)]
        rows.append((name, len(own), *map(float, numbers), int(designs[own.argmax()])))
    return Section(
        title="Kinds of designs",
        note="A design is in one piece if its voxels are joined by faces. The empty design is "
        "also without active voxels. The last columns are quantiles of fitness.",
        columns=(
            Column("kind", "fitness of"),
            Column("designs", "designs"),
            Column("best", "best", ".4f"),
            Column("mean", "mean", ".4f"),
            *(Column(f"q{100 * q:g}", f"{100 * q:g} %", ".4f") for q in QUANTILES),
            Column("fittest"),
        ),
        rows=rows,
    )


def checked_fitness(fitness: ArrayLike) -> NDArray[np.float64]:
    """Return the fitness of every design as finite numbers, a fresh array; see `analyse`."""
    values = np.asarray(fitness)
    if values.dtype.kind not in "iuf":
        raise TypeError(f"fitness must be real numbers, got {values.dtype}")
    if values.shape != (N_DESIGNS,):
        raise ValueError(
            f"fitness must have shape ({N_DESIGNS},), entry i for design i; got {values.shape}"
        )
    values = np.where(np.isnan(values), 0.0, values.astype(np.float64))
    if np.isinf(values).any():
        raise ValueError(
            f"fitness must be finite, but design {int(np.isinf(values).argmax())} has "
            f"{values[np.isinf(values)][0]}; mark a design that diverged with NaN"
        )
    return values
