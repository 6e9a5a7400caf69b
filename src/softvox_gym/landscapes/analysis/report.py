"""An analysis for people: a screen of text, and the same with more rows and words as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from softvox_gym.design import N_DESIGNS, Design
from softvox_gym.landscapes.analysis.groups import Group
from softvox_gym.landscapes.analysis.optima import LocalOptima
from softvox_gym.landscapes.analysis.robustness import Kept
from softvox_gym.landscapes.analysis.summary import Analysis
from softvox_gym.landscapes.analysis.symmetry import Symmetry, members, symmetry_classes

#: Optima and classes shown on the screen, and in Markdown.
FEW, MORE = 4, 20

LAGS = 8

Cells = Sequence[str]


@dataclass(frozen=True)
class Section:
    """A table, and what it means.

    Parameters
    ----------
    title : str
    note : str
        A definition, for who has more than a screen.
    header : sequence of str
        The first names what the rows are.
    rows : sequence of sequence of str
    facts : sequence of str
        Lines after the table.
    """

    title: str
    note: str
    header: Cells
    rows: Sequence[Cells]
    facts: Sequence[str] = ()


def text(analysis: Analysis) -> str:
    """Return the analysis as a screen of aligned text."""
    blocks = [[_title(analysis)]]
    for section in sections(analysis, rows=FEW):
        blocks.append([*_aligned([section.header, *section.rows]), *section.facts])
    return "\n\n".join("\n".join(block) for block in blocks)


def markdown(analysis: Analysis) -> str:
    """Return the analysis as a Markdown document, each table under what it means."""
    lines = [f"# {_title(analysis)}", ""]
    for section in (*sections(analysis, rows=MORE), _broken(analysis), _unequal(analysis)):
        lines += [f"## {section.title}", "", section.note, ""]
        rule = ["---", *["---:"] * (len(section.header) - 1)]
        lines += [f"| {' | '.join(cells)} |" for cells in (section.header, rule, *section.rows)]
        lines += [""]
        for fact in section.facts:
            lines += [fact[:1].upper() + fact[1:] + ".", ""]
    return "\n".join(lines)


def sections(analysis: Analysis, *, rows: int) -> tuple[Section, ...]:
    """Return what the screen shows.

    Parameters
    ----------
    analysis : Analysis
    rows : int
        How many local optima to list.
    """
    return (
        _designs(analysis),
        _symmetry(analysis),
        _optima(analysis, rows),
        _climbs(analysis),
        _walk(analysis),
        _neutrality(analysis),
        _robustness(analysis),
    )


def _title(analysis: Analysis) -> str:
    diverged = f", {analysis.n_diverged} diverged count as 0" if analysis.n_diverged else ""
    return f"Analysis of all {len(analysis.fitness)} designs (lengths in voxel widths{diverged})"


def _designs(analysis: Analysis) -> Section:
    names = {
        "all": "all designs",
        "one_piece": "in one piece",
        "several_pieces": "in several pieces",
        "empty": "empty",
        "no_actuator": "without active voxel",
    }
    return Section(
        "Kinds of designs",
        "A design is in one piece where its voxels are joined by faces. The empty design is "
        "without active voxel too. The last columns are quantiles of fitness.",
        ("fitness of", "designs", "best", "mean", "10 %", "50 %", "90 %", "99 %"),
        [(name, *_group(analysis.groups[key])) for key, name in names.items()],
    )


def _group(group: Group) -> Cells:
    quantiles = (group.quantiles[q] for q in (0.1, 0.5, 0.9, 0.99))
    return str(group.designs), *map(_length, (group.best, group.mean, *quantiles))


def _symmetry(analysis: Analysis) -> Section:
    def row(name: str, found: Symmetry) -> Cells:
        above = [str(count) for count in found.above.values()]
        return (
            name,
            str(found.n_classes),
            *above,
            _length(found.largest_spread),
            str(found.largest_in),
            _percent(found.within),
        )

    limits = [f"> {limit:g}" for limit in analysis.turns.above]
    return Section(
        "Symmetry",
        "A class holds the designs that turns about the vertical (and mirrors in vertical planes) "
        "make of one another. Were the model symmetric, all members would travel equally far; the "
        "spread is their largest less their smallest fitness. The columns count the classes with a "
        "larger spread, then give the largest spread, the class that has it (its smallest design), "
        "and the share of all variance of fitness that lies within classes.",
        ("same but for", "classes", *limits, "spread", "in class", "within"),
        [row("turns", analysis.turns), row("turns and mirrors", analysis.reflections)],
    )


def _optima(analysis: Analysis, rows: int) -> Section:
    optima = analysis.optima
    table = _optimum_rows(optima, rows)
    level = int((optima.plateau > 1).sum())
    fact = (
        f"{len(optima.design)} local optima in {analysis.optima_classes()} symmetry classes, "
        f"{level} of them plateaus; the lowest is {_length(optima.fitness[-1])}"
    )
    return Section(
        "Local optima",
        "Designs, or plateaus of equally fit designs, that no single mutation (one site given "
        "another digit, 16 ways) improves. A basin holds the starts from which a climb ends there: "
        "under steepest ascent (the fittest neighbour, the smallest number where several are "
        "equal), and, as an expected number, under random ascent (any fitter neighbour, each with "
        "the same probability; first improvement in random order). All basins together hold "
        f"{N_DESIGNS}. The file local_optima.csv has all of them.",
        ("local optimum", "digits", "fitness", "steepest basin", "random basin"),
        table,
        (fact,),
    )


def _optimum_rows(optima: LocalOptima, rows: int) -> list[Cells]:
    steepest, random = optima.basins(optima.steepest), optima.basins(optima.random)
    return [
        (
            str(number),
            Design(number).digits,
            _length(optima.fitness[row]),
            f"{steepest[row]:.0f}",
            f"{random[row]:.1f}",
        )
        for row, number in enumerate(optima.design[:rows].tolist())
    ]


def _climbs(analysis: Analysis) -> Section:
    names = {"steepest": "steepest ascent", "random": "random ascent"}
    rows = [
        (
            name,
            f"{100 * found.finds_best:.2f} %",
            f"{found.climbs_to_best:.1f}",
            f"{100 * found.finds_nearly_best:.2f} %",
            f"{found.steps:.2f}",
            _length(found.mean_end),
        )
        for name, found in ((name, analysis.climbs[key]) for key, name in names.items())
    ]
    return Section(
        "Climbs from a random start",
        "How often a climb from a design drawn with equal probability ends in the fittest design, "
        "how many climbs it takes on average until one does, how often one ends within 1 % of the "
        "best fitness, the mean number of moves and the mean fitness at the end.",
        ("climb", "finds best", "climbs to it", "within 1 %", "moves", "mean end"),
        rows,
    )


def _walk(analysis: Analysis) -> Section:
    rho, shares = analysis.autocorrelation, analysis.variance_by_order
    distance, none = analysis.distance, ("-",) * LAGS
    rows = [
        ("correlation", *(none if rho is None else map(_ratio, rho[1 : LAGS + 1]))),
        (
            "variance in %",
            *(none if shares is None else (f"{100 * share:.1f}" for share in shares)),
        ),
        ("mean fitness", *map(_ratio, distance.mean_by_distance[1:])),
    ]
    length = analysis.correlation_length
    known = "-" if length is None else f"{length:.2f}"
    return Section(
        "Ruggedness",
        "Column k: the correlation of fitness now and after k steps of a random walk of mutations; "
        "the share of the variance of fitness that k sites acting together explain, beyond what "
        "fewer do; and the mean fitness of the designs k mutations away from the fittest. The "
        "correlation length is the number of steps in which correlation falls by a factor e. The "
        "fitness-distance correlation is Pearson's r of fitness and the mutations to the fittest "
        "design (in brackets, to its nearest turned or mirrored image), -1 where distance tells "
        "all.",
        ("k steps, sites or mutations", *map(str, range(1, LAGS + 1))),
        rows,
        (
            f"correlation length {known} steps; fitness-distance correlation "
            f"{_ratio(distance.to_best)} ({_ratio(distance.to_class)})",
        ),
    )


def _neutrality(analysis: Analysis) -> Section:
    rows = [
        (
            "nothing" if found.threshold == 0 else f"at most {found.threshold:g}",
            _percent(found.share),
            f"{found.degree:.2f}",
            str(found.largest_network),
            str(found.networks),
        )
        for found in analysis.neutrality
    ]
    return Section(
        "Neutrality",
        "Mutations that change fitness by nothing or little: their share of all, how many of its "
        "16 a design has on average, the designs in the largest network that they join, and how "
        "many networks of two designs or more there are.",
        ("a mutation changes", "share", "of 16", "largest network", "networks"),
        rows,
    )


def _robustness(analysis: Analysis) -> Section:
    def pair(found: Kept) -> Cells:
        return _percent(found.mean_share), _percent(found.worst_share)

    kinds = ("mutation", "dead_actuator", "missing_voxel")
    errors = ("mutation", "worst", "dead", "worst", "missing", "worst")
    rows = []
    for rank, found in analysis.kept["mutation"].items():
        name = {1: "the fittest", N_DESIGNS: "all designs"}.get(rank, f"the fittest {rank}")
        shares = [cell for kind in kinds for cell in pair(analysis.kept[kind][rank])]
        rows.append((name, _length(found.own), *shares))
    worst, mean = analysis.after["mutation"].worst, analysis.after["mutation"].mean
    return Section(
        "Robustness to one error",
        "What is left of fitness, on average over the places where the error can happen and at the "
        "worst place: after one mutation, after an active voxel that stays passive (a dead "
        "actuator), and after a missing voxel. Averages over the group, as shares of its own. "
        "For all designs a mutation leaves 100 % on average by construction: every design is as "
        "often a neighbour as any other. The file neighbours.csv has every design.",
        ("what one error leaves", "fitness", *errors),
        rows,
        (
            f"most is left of {int(worst.argmax())} after its worst mutation "
            f"({_length(worst.max())}), of {int(mean.argmax())} on average ({_length(mean.max())})",
        ),
    )


def _broken(analysis: Analysis) -> Section:
    rows = [
        (
            found.symmetry,
            *(str(count) for count in found.above.values()),
            f"{found.largest:.3g}",
            str(found.largest_in),
        )
        for found in analysis.broken
    ]
    return Section(
        "Symmetries one by one",
        "How many designs the symmetry makes travel further or less far by more than so many "
        "voxel widths, the largest difference, and a design that shows it.",
        ("symmetry", *(f"> {limit:g}" for limit in analysis.turns.above), "largest", "design"),
        rows,
    )


def _unequal(analysis: Analysis) -> Section:
    classes = [(group, analysis.fitness[group]) for group in members(symmetry_classes())]
    classes.sort(key=lambda each: -float(np.ptp(each[1])))
    rows = [
        (
            str(group[0]),
            Design(int(group[0])).digits,
            str(len(group)),
            *map(_length, (values.max(), values.mean(), values.min(), np.ptp(values))),
        )
        for group, values in classes[:MORE]
    ]
    return Section(
        "Classes whose members travel most unequally",
        "Under turns and mirrors. The file classes.csv has all of them.",
        ("class", "digits", "size", "best", "mean", "worst", "spread"),
        rows,
    )


def _aligned(rows: Iterable[Cells]) -> list[str]:
    """Return lines with columns of equal width, the first to the left, numbers to the right."""
    table = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  ".join(
            [row[0].ljust(widths[0])]
            + [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        )
        for row in table
    ]


def _length(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f} %"
