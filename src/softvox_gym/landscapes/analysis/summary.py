"""Everything about one landscape: `analyse`, and what it returns."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import N_DESIGNS
from softvox_gym.landscapes.analysis.graph import checked_fitness
from softvox_gym.landscapes.analysis.groups import Group, groups
from softvox_gym.landscapes.analysis.optima import Climb, LocalOptima, climb, local_optima
from softvox_gym.landscapes.analysis.robustness import (
    AfterError,
    Kept,
    after_dead_actuator,
    after_missing_voxel,
    after_mutation,
    kept,
)
from softvox_gym.landscapes.analysis.ruggedness import (
    FitnessDistance,
    Neutrality,
    autocorrelation,
    correlation_length,
    fitness_distance,
    neutrality,
    variance_by_order,
)
from softvox_gym.landscapes.analysis.symmetry import (
    Broken,
    Symmetry,
    broken,
    symmetry,
    symmetry_classes,
)

#: Voxel widths: mutations that change fitness by no more are neutral.
THRESHOLDS = (0.0, 0.01, 0.1)

#: How many of the fittest designs are put to the test of one error, together.
RANKS = (1, 10, 100, N_DESIGNS)


@dataclass(frozen=True)
class Analysis:
    """A landscape, analysed exactly. Lengths are in voxel widths.

    Parameters
    ----------
    fitness : ndarray, shape (6561,)
        As analysed: 0 where a design diverged.
    n_diverged : int
    groups : dict of str to Group
    turns, reflections : Symmetry
        Of the classes under quarter turns, and under these and mirrors.
    broken : tuple of Broken
        One per symmetry.
    optima : LocalOptima
    climbs : dict of str to Climb
        "steepest" and "random" ascent.
    distance : FitnessDistance
    autocorrelation : tuple of float or None
        After 0, 1, ... 10 steps of a random walk. None where all fitness is equal, like what
        follows.
    correlation_length : float or None
        Steps.
    variance_by_order : tuple of float or None
        Of orders 1 to 8.
    neutrality : tuple of Neutrality
        One per threshold.
    after : dict of str to AfterError
        By kind of error: "mutation", "dead_actuator", "missing_voxel".
    kept : dict of str to dict of int to Kept
        By kind of error, then for the so many fittest designs (equal ones by number).
    """

    fitness: NDArray[np.float64]
    n_diverged: int
    groups: dict[str, Group]
    turns: Symmetry
    reflections: Symmetry
    broken: tuple[Broken, ...]
    optima: LocalOptima
    climbs: dict[str, Climb]
    distance: FitnessDistance
    autocorrelation: tuple[float, ...] | None
    correlation_length: float | None
    variance_by_order: tuple[float, ...] | None
    neutrality: tuple[Neutrality, ...]
    after: dict[str, AfterError]
    kept: dict[str, dict[int, Kept]]

    def to_dict(self) -> dict[str, Any]:
        """Return all but what has a row per design or optimum, ready for JSON."""
        return {
            "n_designs": len(self.fitness),
            "n_diverged": self.n_diverged,
            "groups": {name: asdict(group) for name, group in self.groups.items()},
            "symmetry": {
                "turns": asdict(self.turns),
                "turns_and_reflections": asdict(self.reflections),
                "broken": [asdict(each) for each in self.broken],
            },
            "local_optima": {
                "number": len(self.optima.design),
                "symmetry_classes": self.optima_classes(),
                "plateaus": int((self.optima.plateau > 1).sum()),
                "climbs": {name: asdict(each) for name, each in self.climbs.items()},
            },
            "fitness_distance": asdict(self.distance),
            "random_walk": {
                "autocorrelation": self.autocorrelation,
                "correlation_length": self.correlation_length,
                "variance_by_order": self.variance_by_order,
            },
            "neutrality": [asdict(each) for each in self.neutrality],
            "robustness": {
                "fittest_by_worst_neighbour": int(self.after["mutation"].worst.argmax()),
                "fittest_by_mean_of_neighbours": int(self.after["mutation"].mean.argmax()),
                **{
                    kind: [{"fittest": rank, **asdict(each)} for rank, each in ranks.items()]
                    for kind, ranks in self.kept.items()
                },
            },
        }

    def optima_classes(self) -> int:
        """Return in how many classes under turns and reflections there is a local optimum."""
        return len(np.unique(symmetry_classes()[self.optima.design]))


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
        For another shape, an infinite value, or values that are not real numbers.

    Examples
    --------
    >>> import softvox_gym
    >>> from softvox_gym.landscapes.analysis import analyse
    >>> len(analyse(softvox_gym.landscape()["fitness"]).optima.design)
    113
    """
    values = checked_fitness(fitness)
    optima = local_optima(values)
    walk, shares = autocorrelation(values), variance_by_order(values)
    after = {
        "mutation": after_mutation(values),
        "dead_actuator": after_dead_actuator(values),
        "missing_voxel": after_missing_voxel(values),
    }
    return Analysis(
        fitness=values,
        n_diverged=int(np.isnan(np.asarray(fitness)).sum()),
        groups=groups(values),
        turns=symmetry(values, reflections=False),
        reflections=symmetry(values),
        broken=broken(values),
        optima=optima,
        climbs={
            "steepest": climb(optima, optima.steepest),
            "random": climb(optima, optima.random),
        },
        distance=fitness_distance(values),
        autocorrelation=None if walk is None else tuple(walk.tolist()),
        correlation_length=None if walk is None else correlation_length(float(walk[1])),
        variance_by_order=None if shares is None else tuple(shares.tolist()),
        neutrality=tuple(neutrality(values, threshold=limit) for limit in THRESHOLDS),
        after=after,
        kept=_kept(values, after),
    )


def _kept(values: NDArray[np.float64], after: dict[str, AfterError]) -> dict[str, dict[int, Kept]]:
    """Return what the fittest designs keep, by kind of error and number of designs."""
    order = np.argsort(-values, kind="stable")
    return {
        kind: {rank: kept(values, error, order[:rank]) for rank in RANKS}
        for kind, error in after.items()
    }
