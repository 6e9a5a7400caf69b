"""Local optima of the mutation graph, and the designs from which a climb ends in each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.landscapes.analysis.graph import components, neighbours
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import N_DESIGNS

#: An optimum with at least this share of the best fitness counts as good.
NEARLY = 0.99


class Ascents(NamedTuple):
    """Where climbs end from every start.

    probability : ndarray, shape (6561, m)
        Of a climb from each design to end in each local optimum.
    steps : ndarray, shape (6561,)
        Expected number of moves of a climb from each design.
    """

    probability: NDArray[np.float64]
    steps: NDArray[np.float64]


class LocalOptima(NamedTuple):
    """Every local optimum, the fittest first, equal ones by number.

    design : ndarray of int64, shape (m,)
        The smallest number on the plateau.
    fitness : ndarray, shape (m,)
    plateau : ndarray of int64, shape (m,)
        Number of designs on the plateau; 1 for a peak.
    steepest, random : Ascents
        Climbs that take the fittest neighbour, and climbs that take any fitter neighbour, each
        with the same probability.
    """

    design: NDArray[np.int64]
    fitness: NDArray[np.float64]
    plateau: NDArray[np.int64]
    steepest: Ascents
    random: Ascents


def plateaus(fitness: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the plateau of every design: the designs reached by mutations that change nothing.

    The smallest number on a plateau represents it, shape (6561,). Equal means equal bits, apart
    from the sign of zero.
    """
    return components(fitness[neighbours()] == fitness[:, np.newaxis])


def upward_moves(fitness: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """Return the designs that a climb may go to from each design, by number.

    These are the fitter neighbours. A design without any, on a plateau where other designs have
    some, may go to every fitter neighbour of the plateau: the climb crosses and leaves the plateau
    in one move. A design from which no move is possible is, with its plateau, a local optimum.
    """
    around = np.sort(neighbours(), axis=1)
    fitter = fitness[around] > fitness[:, np.newaxis]
    moves = [row[keep] for row, keep in zip(around, fitter, strict=True)]
    plateau = plateaus(fitness)
    for label in np.unique(plateau[plateau != np.arange(N_DESIGNS)]):
        level = np.flatnonzero(plateau == label)
        exits = np.unique(np.concatenate([moves[design] for design in level]))
        for design in level:
            if not len(moves[design]):
                moves[design] = exits
    return moves


def local_optima(fitness: NDArray[np.float64]) -> LocalOptima:
    """Return the local optima and where climbs end, exactly.

    A local optimum is a plateau (of one design, or of equally fit ones that mutations join) no
    neighbour of which is fitter. Steepest ascent goes to the fittest design it may go to, the
    smallest number where several are; random ascent to any of them, each with the same
    probability, which is what a first-improvement climber does that tries mutations in random
    order. Both are absorbing Markov chains whose every step gains fitness, so the probabilities
    follow in one pass over the designs in order of falling fitness, of shape (6561,).

    Source: G. Ochoa, M. Tomassini, S. Verel, C. Darabos, A study of NK landscapes' basins and
    local optima networks, GECCO 2008 (basins of steepest ascent); J. G. Kemeny, J. L. Snell,
    Finite Markov Chains, 1960, chapter III (absorption).
    """
    plateau, moves = plateaus(fitness), upward_moves(fitness)
    is_top = np.array([not len(targets) for targets in moves])
    tops = np.unique(plateau[is_top])
    tops = tops[np.argsort(-fitness[tops], kind="stable")]
    ends = np.full(N_DESIGNS, -1)
    for column, top in enumerate(tops):
        ends[is_top & (plateau == top)] = column
    steepest = [
        targets[[fitness[targets].argmax()]] if len(targets) else targets for targets in moves
    ]
    return LocalOptima(
        design=tops,
        fitness=fitness[tops],
        plateau=np.bincount(ends[is_top], minlength=len(tops)),
        steepest=_absorbed(fitness, steepest, ends, len(tops)),
        random=_absorbed(fitness, moves, ends, len(tops)),
    )


def _absorbed(
    fitness: NDArray[np.float64],
    moves: list[NDArray[np.int64]],
    ends: NDArray[np.int64],
    n_ends: int,
) -> Ascents:
    """Return where uniformly drawn moves end, and after how many; each must gain fitness."""
    probability = np.zeros((N_DESIGNS, n_ends))
    steps = np.zeros(N_DESIGNS)
    for design in np.argsort(-fitness, kind="stable"):
        targets = moves[design]
        if len(targets):
            probability[design] = probability[targets].mean(axis=0)
            steps[design] = 1 + steps[targets].mean()
        else:
            probability[design, ends[design]] = 1
    return Ascents(probability, steps)


def optima(found: LocalOptima) -> Section:
    """Return the list of local optima."""
    return Section(
        title="Local optima",
        note="Designs, or plateaus of equally fit designs, that no single mutation (one site given "
        "another digit, 16 ways) improves. A basin holds the starts from which a climb ends there: "
        "under steepest ascent (the fittest neighbour, the smallest number where several are "
        "equal), and, as an expected number, under random ascent (any fitter neighbour, each with "
        "the same probability; first improvement in random order). All basins together hold "
        f"{N_DESIGNS}. The file local_optima.csv has all of them.",
        columns=(
            Column("design", "local optimum"),
            Column("digits", "digits"),
            Column("fitness", "fitness", ".4f"),
            Column("plateau"),
            Column("steepest_basin", "steepest basin"),
            Column("random_basin", "random basin", ".1f"),
        ),
        rows=list(
            zip(
                found.design.tolist(),
                [Design(number).digits for number in found.design.tolist()],
                found.fitness.tolist(),
                found.plateau.tolist(),
                # A steepest ascent ends in one place, so these are whole numbers.
                found.steepest.probability.sum(axis=0).astype(int).tolist(),
                found.random.probability.sum(axis=0).tolist(),
                strict=True,
            )
        ),
        facts={
            "number": len(found.design),
            "symmetry_classes": len(np.unique(symmetry_classes()[found.design])),
            "plateaus": int((found.plateau > 1).sum()),
            "lowest": float(found.fitness[-1]),
        },
        sentence="{number} local optima in {symmetry_classes} symmetry classes, {plateaus} of them "
        "plateaus; the lowest is {lowest:.4f}",
        file="local_optima.csv",
        screen=4,
        document=20,
    )


def climbs(found: LocalOptima) -> Section:
    """Return the expectations of a climb from a uniformly drawn design."""
    best = float(found.fitness[0])
    nearly = found.fitness >= min(NEARLY * best, best)
    rows = []
    for name, ascents in (("steepest ascent", found.steepest), ("random ascent", found.random)):
        share = ascents.probability.mean(axis=0)
        finds_best = float(share[found.fitness == best].sum())
        finds_nearly = float(share[nearly].sum())
        mean_end = float(share @ found.fitness)
        row = (name, finds_best, 1 / finds_best, finds_nearly, float(ascents.steps.mean()))
        rows.append((*row, mean_end))
    return Section(
        title="Climbs from a random start",
        note="How often a climb from a design drawn with equal probability ends in the fittest "
        "design, how many climbs it takes on average until one does, how often one ends within "
        "1 % of the best fitness, the mean number of moves and the mean fitness at the end.",
        columns=(
            Column("climb", "climb"),
            Column("finds_best", "finds best", ".2%"),
            Column("climbs_to_best", "climbs to it", ".1f"),
            Column("finds_nearly_best", "within 1 %", ".2%"),
            Column("steps", "moves", ".2f"),
            Column("mean_end", "mean end", ".4f"),
        ),
        rows=rows,
    )
