"""The report as files: its tables, its figures, and the page report.md that shows them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from softvox_gym.files import write_file, write_folder
from softvox_search.report import figures, style, tables, text
from softvox_search.report.curves import PROBLEM, TARGETS, groups, targets
from softvox_search.report.noise import MEASURES, reference_policy
from softvox_search.report.statistics import RESAMPLES
from softvox_search.report.text import HELD, escaped
from softvox_search.report.truth import exact_fitness

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Tables = Mapping[str, pd.DataFrame]

#: The budget at which the page shows all pairs; the tables have the others.
PAIRS_AT = 500

#: A longer table is named on the page, not shown; so many failed runs are named.
MOST_LINES, MOST_FAILED = 40, 20


def write_report(folder: Path, results: Results) -> list[str]:
    """Write a report; see `softvox_search.report.write`."""
    made, notes = tables.make(results)
    with style.style():
        pictures = {
            f"{name}.png": style.encoded(figure) for name, figure in figures.draw(made).items()
        }
    files = {f"{name}.csv": text.csv(table) for name, table in made.items()}
    page = _report(results, made, notes, list(pictures), files)
    for name, contents in (("tables", files), ("figures", pictures)):
        if contents:
            write_folder(folder / name, contents, force=True)
    write_file(folder / "report.md", page.encode(), force=True)
    names = [f"tables/{name}" for name in files] + [f"figures/{name}" for name in pictures]
    return [*names, "report.md"]


def _report(
    results: Results, made: Tables, notes: list[str], pictures: list[str], files: dict[str, bytes]
) -> str:
    """Return the page; Markdown tables too long for it are added to the files."""
    blocks = [*_head(results), "## Runs", _shown("runs", text.overview(made["runs"]), files)]
    if "problems" in made:
        problems = made["problems"]
        several = len(problems[["physics", "shape"]].drop_duplicates()) > 1
        if several or not problems["known"].all():
            blocks += ["## Problems", _shown("problems", text.problems(problems), files)]
        blocks += _definitions(results, problems)
        if "noise_policies" in made:
            blocks += _noise(made, notes, pictures, files)
        blocks += _all_physics(made, pictures)
        for _, problem in groups(problems, "name"):
            blocks += _comparison(results, made, problem, pictures, files)
    return "\n\n".join(block.strip("\n") for block in blocks) + "\n"


def _shown(name: str, table: str, files: dict[str, bytes]) -> str:
    """Return a table for the page, or where it is to be found if it is long."""
    if table.count("\n") <= MOST_LINES:
        return table
    files[f"{name}.md"] = table.encode()
    return f"A long table: [tables/{name}.md](tables/{name}.md)."


def _pictures(names: list[str], pictures: list[str]) -> list[str]:
    files = [f"{name}.png" for name in names]
    return [f"![{file}](figures/{file})" for file in files if file in pictures]


def _head(results: Results) -> list[str]:
    runs = results.runs
    failed = runs[runs["status"] == "failed"]
    budgets: dict[str, str] = {name: _budget(own) for name, own in results.budgets.items()}
    (common, _), *others = Counter(budgets.values()).most_common()
    lines = [f"{len(runs) - len(failed)} finished runs, {common} each."]
    for other, _ in others:
        names = ", ".join(escaped(name) for name, own in budgets.items() if own == other)
        lines.append(f"Except {names}: {other} each.")
    if len(failed):
        columns = zip(failed["run"], failed["searcher"], failed["seed"], strict=True)
        named = [f"{str(run)[:16]} ({escaped(name)}, seed {seed})" for run, name, seed in columns]
        more = f" and {len(named) - MOST_FAILED} more" if len(named) > MOST_FAILED else ""
        which = ", ".join(named[:MOST_FAILED]) + more
        lines.append(f"**{len(failed)} failed and left out:** run {which}.")
    else:
        lines.append("No run failed.")
    return [f"# {escaped(results.title)}", text.fenced(results.command), " ".join(lines)]


def _budget(budget: Any) -> str:
    names = {
        "unique": "unique evaluations",
        "evaluations": "evaluations",
        "steps": "simulated steps",
        "cpu_seconds": "CPU seconds",
    }
    parts = [
        f"at most {getattr(budget, name):g} {what}"
        if name == "cpu_seconds"
        else f"at most {getattr(budget, name)} {what}"
        for name, what in names.items()
        if getattr(budget, name, None) is not None
    ]
    return " and ".join(parts) if parts else "no stated budget"


def _definitions(results: Results, problems: pd.DataFrame) -> list[str]:
    known = problems[problems["known"]]
    lines = []
    if len(known):
        goals = set(known["goal"])
        goal = f", {goals.pop():.4f} voxel widths," if len(goals) == 1 else " (see *Problems*)"
        lines.append(
            f"- *Regret*: the best fitness of the landscape{goal} less that of the best design "
            "that the run has evaluated so far, both without noise. *Raw terms* count every design "
            "for itself. *Class terms* count a robot turned or mirrored as the same robot, worth "
            "the best of them: the model is not quite symmetric."
        )
    if len(known) < len(problems):
        lines.append(
            "- *Best fitness*: where the best of all designs is not known, that of the best design "
            "that the run has evaluated so far, as the searcher was told it. Targets are shares of "
            "the best that any run of this experiment found, and rise when another finds better."
        )
    lines += [
        "- *Unique evaluations*: those that no cache answered; where there is noise, all.",
        "- *IQM*: mean of the middle half of the runs. *Bands*, in brackets and shaded: 95 % by "
        f"the bootstrap over runs ({RESAMPLES} resamples; where searchers or problems are pooled, "
        "each is a stratum).",
    ]
    if problems["level"].notna().any():
        lines.append(
            "- Under noise, regret says whether the searcher came past a good design, not whether "
            "it knew; for that see *What is recommended*."
        )
    if results.runs["policy"].nunique() > 1:
        policy = escaped(problems["policy"].iat[0])
        lines.append(f"- Searchers are compared under the policy *{policy}*.")
    return ["## Terms", "\n".join(lines)]


def _comparison(
    results: Results,
    made: Tables,
    problem: pd.DataFrame,
    pictures: list[str],
    files: dict[str, bytes],
) -> list[str]:
    """Return the searchers compared on one problem."""
    name, known = problem["name"].iat[0], bool(problem["known"].iat[0])
    axes = list(PROBLEM)
    budget, target, pairs = (
        problem[axes].merge(made.get(table, made["problems"][:0]), on=axes)
        for table in ("fixed_budget", "fixed_target", "pairs")
    )
    terms = list(dict.fromkeys(budget["terms"]))
    title = figures.where(made["problems"], problem, "").removeprefix(", ")
    mark = "###" if title else "##"
    blocks = [f"## {title[0].upper()}{escaped(title[1:])}"] if title else []
    what, better = ("Regret", "Lower") if known else ("Best fitness", "Higher")
    blocks += [
        f"{mark} {what} over time",
        f"{better} is better, earlier is better. In each panel the searcher named above it with "
        "its band; the others in grey. A cross marks where the median run ended; from there on, "
        "dotted, runs that ended keep their value.",
        *_pictures([f"anytime_{kind}{name}" for kind in terms], pictures),
        f"{mark} Targets reached",
        _targets(results, problem),
        *_pictures([f"ecdf_{kind}{name}" for kind in terms], pictures),
        f"{mark} Fixed budgets",
        f"IQM of the {what.lower()} after so many unique evaluations, with its band. "
        f"{HELD} with a share: only that share of the runs used so many; the others keep their "
        "last value. Empty: the searcher's own budget is smaller.",
        *_pictures([f"fixed_budget{name}"], pictures),
    ]
    for kind in terms:
        table = text.fixed_budget(budget[budget["terms"] == kind])
        blocks += [f"In {kind} terms:", table]
    blocks += [
        f"{mark} Fixed targets",
        f"{_ERT} {_target_sizes(results, problem)}",
        text.fixed_target(target),
    ]
    return blocks + (_pairs(pairs, name, mark, files) if len(pairs) else [])


_ERT = (
    "Expected running time: the unique evaluations of all runs together, each counted until it "
    "reached the share of the best fitness or ended, per run that reached it; in parentheses the "
    "share of runs that did. ∞: none did."
)


def _fitness(results: Results, problem: pd.DataFrame) -> dict[str, Any]:
    """Return the exact fitness of all designs by terms."""
    physics = problem["physics"].iat[0]
    values = next(known.values for known in results.problems if known.physics == physics)
    return {terms: exact_fitness(terms, values) for terms in ("raw", "class")}


def _targets(results: Results, problem: pd.DataFrame) -> str:
    goal = problem["goal"].iat[0]
    steps = targets(goal)
    line = (
        f"Of all pairs of a run and one of {TARGETS} targets, the share reached so far; higher is "
        f"better. The targets are log-spaced from {goal:.2f} (standing still) to {steps[-1]:.2g} "
        "voxel widths below "
    )
    if not problem["known"].iat[0]:
        return f"{line}the best that any run found."
    fitness = _fitness(results, problem)
    met = np.array([np.sum(goal - own[:, np.newaxis] <= steps, axis=0) for own in fitness.values()])
    hard = int(np.sum(met.max(axis=0) <= 4))
    finest = "the optimum alone" if met[0, -1] == 1 else f"{met[0, -1]} designs"
    return f"{line}the best (met by {finest}); {hard} of them are met by no more than four designs."


def _target_sizes(results: Results, problem: pd.DataFrame) -> str:
    """Return a sentence with how many designs meet each target, where that is known."""
    if not problem["known"].iat[0]:
        return "The best fitness is the best that any run found."
    fitness, goal = _fitness(results, problem), problem["goal"].iat[0]
    parts = []
    for share in tables.FIXED_TARGETS:
        raw, shared = (int(np.sum(own >= share * goal)) for own in fitness.values())
        parts.append(f"{raw} ({text.percent(share)}; {shared} in class terms)")
    return f"So many of the {len(fitness['raw'])} designs meet the targets: {', '.join(parts)}."


def _pairs(table: pd.DataFrame, name: str, mark: str, files: dict[str, bytes]) -> list[str]:
    """Show all pairs at one budget, and write files with the others."""
    shown = max((b for b in table["budget"] if b <= PAIRS_AT), default=table["budget"].min())
    squares = []
    for (terms,), here in groups(table, "terms"):
        by_budget = {budget: text.pairs(rows) for (budget,), rows in groups(here, "budget")}
        files[f"pairs_{terms}{name}.md"] = "\n".join(
            f"After {budget} unique evaluations:\n\n{square}"
            for budget, square in by_budget.items()
        ).encode()
        squares += [f"In {terms} terms:", by_budget[shown]]
    others = " and ".join(
        f"tables/pairs_{terms}{name}.md" for terms in dict.fromkeys(table["terms"])
    )
    return [
        f"{mark} Pairs",
        f"After {shown} unique evaluations: the chance (Vargha and Delaney's A12) that a run of "
        "the searcher at the left has found a fitter design than one of the searcher above, ties "
        "counted half. Bold: Mann and Whitney's two-sided test, adjusted by Holm for all pairs of "
        f"the table, is below 0.05. The other budgets are in {others}, U and p in "
        "tables/pairs.csv.",
        *squares,
    ]


def _all_physics(made: Tables, pictures: list[str]) -> list[str]:
    """Return the searchers compared over all physics of a lattice and level of noise."""
    if "all_ecdf" not in made:
        return []
    blocks = [
        "## All physics together",
        "The runs on all physics of a lattice and level of noise pooled: the share of all pairs of "
        "a run and a target that is reached so far, each target relative to the best fitness of "
        "its own problem. A searcher that lacks finished runs on any of them is left out.",
    ]
    for key, table in groups(made["all_fixed_target"], "shape", "level", "policy"):
        title = figures.where(made["problems"], table, key[2]).removeprefix(", ")
        end = figures.all_name(made["problems"], *key[:2])
        blocks += [f"### {title[0].upper()}{escaped(title[1:])}"] if title else []
        blocks += _pictures([f"all_ecdf_{terms}{end}" for terms in ("raw", "class")], pictures)
        blocks += [_ERT, text.fixed_target(table)]
    return blocks


def _noise(
    made: Tables, notes: list[str], pictures: list[str], files: dict[str, bytes]
) -> list[str]:
    policies, searchers = made["noise_policies"], made["noise_searchers"]
    ends = dict.fromkeys(name.rpartition("_level_")[0] for name in made["problems"]["name"])
    blocks = [
        "## What is recommended",
        "*True value*: the mean fitness of a design at that level of noise, measured over many "
        "draws (exact at level 0). *True regret*: the largest true value of all designs less that "
        "of the one recommended (IQM and mean; lower is better). *Optimism*: what the searcher "
        "believes the recommended design to be worth less its true value (mean; 0 is honest, above "
        "it the searcher was fooled by luck). The bands are about the runs; that the true values "
        "have errors themselves is not in them.",
        "\n".join(f"- {escaped(note)}" for note in notes),
        *_pictures([f"{measure}{end}" for end in ends for measure in MEASURES], pictures),
        _policies(reference_policy(made["recommendations"]["policy"])),
        _shown("noise_policies", text.noise(policies), files),
        "Each searcher:",
        _shown("noise_searchers", text.noise(searchers), files),
    ]
    if (searchers["known"] < searchers["runs"]).any():
        blocks.append(
            "Where only some are known, the others recommend designs whose true value was not "
            "measured at that level. They are left out, which may flatter or not."
        )
    return blocks


def _policies(naive: str) -> str:
    if not naive:
        return "All searchers together:"
    return (
        "All searchers together, by policy. A12 is the chance that a run under the policy, of any "
        f"searcher, has the larger true regret (or optimism) than one under *{escaped(naive)}*, "
        "ties counted half: below 0.5 the policy lowers it; differences between the searchers draw "
        "it towards 0.5. p by Mann and Whitney, two-sided, adjusted by Holm for the policies of a "
        "level."
    )
