"""Local optima of the mutation graph, and the designs from which a climb ends in each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import N_DESIGNS
from softvox_gym.landscapes.analysis.graph import checked_fitness, components, neighbours

#: An optimum counts as good as the best from this share of its fitness on.
NEARLY = 0.99


@dataclass(frozen=True)
class Ascents:
    """Where climbs end from every start.

    Parameters
    ----------
    probability : ndarray, shape (6561, m)
        Of a climb from each design to end in each local optimum.
    steps : ndarray, shape (6561,)
        Expected number of moves of a climb from each design.
    """

    probability: NDArray[np.float64]
    steps: NDArray[np.float64]


@dataclass(frozen=True)
class LocalOptima:
    """Every local optimum, the fittest first, equal ones by number.

    Parameters
    ----------
    design : ndarray of int64, shape (m,)
        The smallest number on the plateau.
    fitness : ndarray, shape (m,)
    plateau : ndarray of int64, shape (m,)
        How many designs the plateau has; 1 for a plain peak.
    steepest, random : Ascents
        Climbs that take the fittest neighbour, and climbs that take any fitter neighbour, each
        with the same probability.
    """

    design: NDArray[np.int64]
    fitness: NDArray[np.float64]
    plateau: NDArray[np.int64]
    steepest: Ascents
    random: Ascents

    def basins(self, ascents: Ascents) -> NDArray[np.float64]:
        """Return how many starts end in each optimum, shape (m,); they sum to 6561.

        For climbs that draw, the expected number: the probabilities of all starts, summed.
        """
        sizes: NDArray[np.float64] = ascents.probability.sum(axis=0)
        return sizes


@dataclass(frozen=True)
class Climb:
    """What to expect of a climb from a design drawn with equal probability.

    Parameters
    ----------
    finds_best : float
        Probability to end in the fittest design, or one of them.
    climbs_to_best : float
        Expected number of independent climbs until one does: 1 / finds_best.
    finds_nearly_best : float
        Probability to end in an optimum with at least 99 % of the best fitness.
    steps : float
        Expected number of moves.
    mean_end : float
        Expected fitness at the end, voxel widths.
    """

    finds_best: float
    climbs_to_best: float
    finds_nearly_best: float
    steps: float
    mean_end: float


def plateaus(fitness: ArrayLike) -> NDArray[np.int64]:
    """Return the plateau of every design: the designs reached by mutations that change nothing.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0. Equal means equal bits, but for the sign of zero.

    Returns
    -------
    ndarray of int64, shape (6561,)
        The smallest number on each design's plateau; its own where no neighbour is as fit.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.
    """
    values = checked_fitness(fitness)
    return components(values[neighbours()] == values[:, np.newaxis])


def upward_moves(fitness: ArrayLike) -> list[NDArray[np.int64]]:
    """Return the designs that a climb may go to from each design, by number.

    These are the fitter neighbours. A design without any, on a plateau with others that have some,
    may go to every fitter neighbour of the plateau: the climb walks the plateau and leaves it, in
    what counts as one move. A design from which no move is possible is, with its plateau, a local
    optimum.

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
    around = np.sort(neighbours(), axis=1)
    fitter = values[around] > values[:, np.newaxis]
    moves = [row[keep] for row, keep in zip(around, fitter, strict=True)]
    plateau = plateaus(values)
    for label in np.unique(plateau[plateau != np.arange(N_DESIGNS)]):
        level = np.flatnonzero(plateau == label)
        exits = np.unique(np.concatenate([moves[design] for design in level]))
        for design in level:
            if not len(moves[design]):
                moves[design] = exits
    return moves


def local_optima(fitness: ArrayLike) -> LocalOptima:
    """Return the local optima and where climbs end, exactly.

    A local optimum is a plateau (of one design, or of equally fit ones that mutations join) no
    neighbour of which is fitter. Steepest ascent goes to the fittest design it may go to, the
    smallest number where several are; random ascent to any of them, each with the same
    probability, which is what a first-improvement climber does that tries mutations in random
    order. Both are absorbing Markov chains whose every step gains fitness, so the probabilities
    follow in one pass over the designs in order of falling fitness.

    Parameters
    ----------
    fitness : array_like, shape (6561,)
        NaN counts as 0.

    Raises
    ------
    TypeError, ValueError
        As `checked_fitness` does.

    Notes
    -----
    Source: G. Ochoa, M. Tomassini, S. Verel, C. Darabos, A study of NK landscapes' basins and
    local optima networks, GECCO 2008 (basins of steepest ascent); J. G. Kemeny, J. L. Snell,
    Finite Markov Chains, 1960, chapter III (absorption).
    """
    values = checked_fitness(fitness)
    plateau, moves = plateaus(values), upward_moves(values)
    is_top = np.array([not len(targets) for targets in moves])
    tops = np.unique(plateau[is_top])
    tops = tops[np.argsort(-values[tops], kind="stable")]
    ends = np.full(N_DESIGNS, -1)
    for column, top in enumerate(tops):
        ends[is_top & (plateau == top)] = column
    steepest = [
        targets[[values[targets].argmax()]] if len(targets) else targets for targets in moves
    ]
    return LocalOptima(
        design=tops,
        fitness=values[tops],
        plateau=np.bincount(ends[is_top], minlength=len(tops)),
        steepest=_absorbed(values, steepest, ends, len(tops)),
        random=_absorbed(values, moves, ends, len(tops)),
    )


def climb(optima: LocalOptima, ascents: Ascents) -> Climb:
    """Return what to expect of a climb from a random start.

    Parameters
    ----------
    optima : LocalOptima
    ascents : Ascents
        `optima.steepest` or `optima.random`.
    """
    share = ascents.probability.mean(axis=0)
    best = float(optima.fitness[0])
    finds_best = float(share[optima.fitness == best].sum())
    nearly = optima.fitness >= min(NEARLY * best, best)
    return Climb(
        finds_best=finds_best,
        climbs_to_best=1 / finds_best,
        finds_nearly_best=float(share[nearly].sum()),
        steps=float(ascents.steps.mean()),
        mean_end=float(share @ optima.fitness),
    )


def _absorbed(
    values: NDArray[np.float64],
    moves: list[NDArray[np.int64]],
    ends: NDArray[np.int64],
    n_ends: int,
) -> Ascents:
    """Return where uniformly drawn moves end, and after how many; every move must gain fitness."""
    probability = np.zeros((N_DESIGNS, n_ends))
    steps = np.zeros(N_DESIGNS)
    for design in np.argsort(-values, kind="stable"):
        targets = moves[design]
        if len(targets):
            probability[design] = probability[targets].mean(axis=0)
            steps[design] = 1 + steps[targets].mean()
        else:
            probability[design, ends[design]] = 1
    return Ascents(probability, steps)
