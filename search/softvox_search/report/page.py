"""The report as files: its tables, its figures, and the page report.md that shows them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from softvox_gym.files import write_file, write_folder
from softvox_search.report import figures, style, tables, text
from softvox_search.report.curves import TARGETS, groups, on, records, targets
from softvox_search.report.noise import MEASURES, reference_policy
from softvox_search.report.statistics import RESAMPLES
from softvox_search.report.text import HELD, escaped

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Tables = Mapping[str, pd.DataFrame]

#: The budget at which the page shows all pairs; the tables have the others.
PAIRS_AT = 500

#: A longer table is named on the page, not shown.
MOST_LINES = 40


def write_report(folder: Path, results: Results) -> list[str]:
    """Write a report; see `softvox_search.report.write`."""
    made = tables.make(results)
    with style.style():
        pictures = {
            f"{name}.png": style.encoded(figure) for name, figure in figures.draw(made).items()
        }
    files = {f"{name}.csv": text.csv(table) for name, table in made.items()}
    for name, contents in (("tables", files), ("figures", pictures)):
        if contents:
            write_folder(folder / name, contents, force=True)
    page = _report(results, made, list(pictures))
    write_file(folder / "report.md", page.encode(), force=True)
    names = [f"tables/{name}" for name in files] + [f"figures/{name}" for name in pictures]
    return [*names, "report.md"]


def _report(results: Results, made: Tables, pictures: list[str]) -> str:
    """Return the page."""
    blocks = [*_head(results), "## Runs", _shown("runs", text.overview(made["runs"]))]
    if "problems" in made:
        problems = made["problems"]
        if problems["goal"].nunique() > 1 or not problems["known"].all():
            blocks += ["## Problems", _shown("problems", text.problems(problems))]
        blocks += _definitions(results, problems)
        if "noise_policies" in made:
            blocks += _noise(made, pictures)
        for problem in records(problems):
            blocks += _comparison(made, problem, pictures)
    return "\n\n".join(block.strip("\n") for block in blocks) + "\n"


def _shown(name: str, table: str) -> str:
    """Return a table for the page, or where it is to be found if it is long."""
    if table.count("\n") <= MOST_LINES:
        return table
    return f"A long table: [tables/{name}.csv](tables/{name}.csv)."


def _pictures(names: list[str], pictures: list[str]) -> list[str]:
    files = [f"{name}.png" for name in names]
    return [f"![{file}](figures/{file})" for file in files if file in pictures]


def _head(results: Results) -> list[str]:
    runs = results.runs
    failed = runs[runs["status"] == "failed"]
    budgets: dict[str, str] = {name: _budget(own) for name, own in results.budgets.items()}
    common, *others = [budget for budget, _ in Counter(budgets.values()).most_common()]
    lines = [f"{len(runs) - len(failed)} finished runs, {common} each."]
    for other in others:
        names = ", ".join(escaped(name) for name, own in budgets.items() if own == other)
        lines.append(f"Except {names}: {other} each.")
    failures = f"**{len(failed)} failed and left out.**" if len(failed) else "No run failed."
    lines.append(failures)
    return [f"# {escaped(results.title)}", text.fenced(results.command), " ".join(lines)]


def _budget(budget: Mapping[str, Any]) -> str:
    names = {
        "unique": "unique evaluations",
        "evaluations": "evaluations",
        "steps": "simulated steps",
        "cpu_seconds": "CPU seconds",
    }
    parts = [
        f"at most {budget[name]} {what}"
        for name, what in names.items()
        if budget.get(name) is not None
    ]
    return " and ".join(parts) if parts else "no stated budget"


def _definitions(results: Results, problems: pd.DataFrame) -> list[str]:
    problems = problems[problems["physics"] != ""]
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


def _comparison(made: Tables, problem: dict[str, Any], pictures: list[str]) -> list[str]:
    """Return the searchers compared on one problem, or on all physics together."""
    name, physics = problem["name"], problem["physics"]
    budget, target, pairs = (
        on(problem, made.get(table, made["problems"][:0]))
        for table in ("fixed_budget", "fixed_target", "pairs")
    )
    terms = list(dict.fromkeys(target["terms"]))
    title = escaped(", ".join(figures.where(made["problems"], problem)))
    mark = "###" if title else "##"
    blocks = [f"## {title[0].upper()}{title[1:]}"] if title else []
    what, better = ("Regret", "Lower") if problem["known"] else ("Best fitness", "Higher")
    if physics:
        blocks += [
            f"{mark} {what} over time",
            f"{better} is better, earlier is better. In each panel the searcher named above it "
            "with its band; the others in grey. A cross marks where the median run ended; from "
            "there on, dotted, runs that ended keep their value.",
            *_pictures([f"anytime_{kind}{name}" for kind in terms], pictures),
        ]
    else:
        blocks.append(
            "The runs on all physics pooled, each target relative to the best fitness of its own "
            "problem. A searcher that lacks finished runs on any of them is left out."
        )
    blocks += [
        f"{mark} Targets reached",
        _targets(problem),
        *_pictures([f"ecdf_{kind}{name}" for kind in terms], pictures),
    ]
    if physics:
        blocks += [
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
        "Expected running time: the unique evaluations of all runs together, each counted until it "
        "reached the share of the best fitness or ended, per run that reached it; in parentheses "
        f"the share of runs that did. ∞: none did.{_target_sizes(target)}",
        text.fixed_target(target),
    ]
    return blocks + (_pairs(pairs, mark) if len(pairs) else [])


def _targets(problem: dict[str, Any]) -> str:
    line = (
        f"Of all pairs of a run and one of {TARGETS} targets, the share reached so far; higher is "
        "better."
    )
    if not problem["physics"]:
        return line
    goal, finest = problem["goal"], problem["finest"]
    line = (
        f"{line} The targets are log-spaced from {goal:.2f} (standing still) to "
        f"{targets(goal)[-1]:.2g} voxel widths below the best"
    )
    if not problem["known"]:
        return f"{line} that any run found."
    met = "the optimum alone" if finest == 1 else f"{finest:.0f} designs"
    hard = f"{problem['hard']:.0f} of them are met by no more than four designs"
    return f"{line} (met by {met}); {hard}."


def _target_sizes(table: pd.DataFrame) -> str:
    """Return a sentence with how many designs meet each target, where that is known."""
    if table["designs"].isna().any():
        return ""
    parts = []
    for (share,), rows in groups(table, "target"):
        counts = rows.groupby("terms")["designs"].first()
        parts.append(
            f"{counts['raw']:.0f} ({text.percent(share)}; {counts['class']:.0f} in class terms)"
        )
    return f" So many of all designs meet the targets: {', '.join(parts)}."


def _pairs(table: pd.DataFrame, mark: str) -> list[str]:
    """Show all pairs at one budget."""
    shown = max((b for b in table["budget"] if b <= PAIRS_AT), default=table["budget"].min())
    blocks = [
        f"{mark} Pairs",
        f"After {shown} unique evaluations: the chance (Vargha and Delaney's A12) that a run of "
        "the searcher at the left has found a fitter design than one of the searcher above, ties "
        "counted half. Bold: Mann and Whitney's two-sided test, adjusted by Holm for all pairs of "
        "the table, is below 0.05. The other budgets, U and p are in tables/pairs.csv.",
    ]
    for (terms,), here in groups(table[table["budget"] == shown], "terms"):
        blocks += [f"In {terms} terms:", text.pairs(here)]
    return blocks


def _noise(made: Tables, pictures: list[str]) -> list[str]:
    policies, searchers, problems = (
        made[name] for name in ("noise_policies", "noise_searchers", "problems")
    )
    ends = dict.fromkeys(name.rpartition("_level_")[0] for name in problems["name"])
    notes = [
        escaped(f"{', '.join(figures.where(problems, problem))}: {problem['truth']}.")
        for problem in records(problems)
        if problem["physics"]
    ]
    blocks = [
        "## What is recommended",
        "*True value*: the mean fitness of a design at that level of noise, measured over many "
        "draws (exact at level 0). *True regret*: the largest true value of all designs less that "
        "of the one recommended (IQM and mean; lower is better). *Optimism*: what the searcher "
        "believes the recommended design to be worth less its true value (mean; 0 is honest, above "
        "it the searcher was fooled by luck). The bands are about the runs; that the true values "
        "have errors themselves is not in them.",
        "\n".join(f"- {note[0].upper()}{note[1:]}" for note in notes),
        *_pictures([f"{measure}{end}" for end in ends for measure in MEASURES], pictures),
        _policies(reference_policy(made["recommendations"]["policy"])),
        _shown("noise_policies", text.noise(policies)),
        "Each searcher:",
        _shown("noise_searchers", text.noise(searchers)),
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
