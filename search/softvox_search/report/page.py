"""The page report.md: every figure and table with a sentence on how to read it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from softvox_search.report import canvas, markdown
from softvox_search.report.cells import Section
from softvox_search.report.curves import (
    FINEST_TARGET,
    FIXED_TARGETS,
    TARGETS,
    budgets,
    hard_targets,
)
from softvox_search.report.drawing import key
from softvox_search.report.recommendations import reference_policy
from softvox_search.report.results import Results
from softvox_search.report.statistics import RESAMPLES
from softvox_search.report.text import HELD
from softvox_search.report.truth import TERMS, optimum

#: The budget at which the page shows all pairs; the tables have the others.
PAIRS_AT = 500

#: A longer table is named on the page, not shown.
MOST_LINES = 40


@dataclass
class Parts:
    """The files of a report by name, and the Markdown tables that the page shows."""

    tables: dict[str, bytes] = field(default_factory=dict)
    figures: dict[str, bytes] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)

    def table(self, name: str, csv: bytes, text: str) -> None:
        """Take a table as CSV and as Markdown."""
        self.tables[f"{name}.csv"] = csv
        self.text(name, text)

    def text(self, name: str, text: str) -> None:
        """Take a table as Markdown."""
        self.tables[f"{name}.md"] = text.encode()
        self.texts[name] = text

    def figure(self, name: str, made: Figure) -> None:
        """Take a figure as PNG."""
        self.figures[f"{name}.png"] = canvas.png(made)


def report(results: Results, sections: list[Section], parts: Parts, notes: list[str]) -> str:
    """Return the page."""
    blocks = [*_head(results), "## Runs", shown("runs", parts)]
    if sections:
        blocks += _definitions(results, sections)
    if "noise_policies" in parts.texts:
        policies = results.runs["policy"][results.runs["status"] == "ok"]
        blocks += _noise(parts, notes, reference_policy(policies))
    for section in sections:
        blocks += _comparison(section, parts)
    return "\n\n".join(block.strip("\n") for block in blocks) + "\n"


def shown(name: str, parts: Parts) -> str:
    """Return a table for the page, or where it is to be found if it is long."""
    text = parts.texts[name]
    if text.count("\n") > MOST_LINES:
        return f"A long table: [tables/{name}.md](tables/{name}.md)."
    return text


def _head(results: Results) -> list[str]:
    runs = results.runs
    failed = runs[runs["status"] == "failed"]
    lines = [f"{len(runs) - len(failed)} finished runs, {_budget(results.budget)} each."]
    for searcher, own in results.budget.get("searchers", {}).items():
        lines.append(f"Except {searcher}: {_budget({**results.budget, **own})} each.")
    if len(failed):
        names = zip(failed["run"], failed["searcher"], strict=True)
        which = ", ".join(f"{run} ({name})" for run, name in names)
        lines.append(f"**{len(failed)} failed and left out:** run {which}.")
    else:
        lines.append("No run failed.")
    return [f"# {results.title}", f"```sh\n{results.command}\n```", " ".join(lines)]


def _budget(budget: dict[str, Any]) -> str:
    names = {
        "unique": "unique evaluations",
        "evaluations": "evaluations",
        "steps": "simulated steps",
    }
    parts = [
        f"at most {budget[name]} {text}"
        for name, text in names.items()
        if budget.get(name) is not None
    ]
    return " and ".join(parts) if parts else "no stated budget"


def _definitions(results: Results, sections: list[Section]) -> list[str]:
    lines = [
        f"- *Regret*: the best fitness of the landscape, {optimum():.4f} voxel widths, less that "
        "of the best design that the run has evaluated so far, both without noise. *Raw terms* "
        "count every design for itself. *Class terms* count a robot turned or mirrored as the same "
        "robot, worth the best of them: the model is not quite symmetric.",
        "- *Unique evaluations*: those that no cache answered; where there is noise, all.",
        "- *IQM*: mean of the middle half of the runs. *Bands*, in brackets and shaded: 95 % by "
        f"the bootstrap over runs ({RESAMPLES} resamples; where searchers are pooled, each is a "
        "stratum).",
    ]
    if not np.isnan(sections[-1].level):
        lines.append(
            "- Under noise, regret says whether the searcher came past a good design, not whether "
            "it knew; for that see *What is recommended*."
        )
        policies = list(dict.fromkeys(results.runs["policy"]))
        if len(policies) > 1:
            lines.append(f"- Searchers are compared under the policy *{sections[0].policy}*.")
    return ["## Terms", "\n".join(lines)]


def _comparison(section: Section, parts: Parts) -> list[str]:
    is_noisy = not np.isnan(section.level)
    blocks = [f"## Noise level {section.level:g}"] if is_noisy else []
    mark = "###" if is_noisy else "##"
    return [
        *blocks,
        f"{mark} Regret over time",
        "Lower is better, earlier is better. In each panel the searcher named above it with its "
        "band; the others in grey. A cross marks where the median run ended; from there on, "
        "dotted, runs that ended keep their value.",
        *(_picture("anytime", section, terms) for terms in TERMS),
        f"{mark} Targets reached",
        f"Of all pairs of a run and one of {TARGETS} targets, the share reached so far; higher is "
        f"better. The targets are regrets log-spaced from {optimum():.2f} (standing still) to "
        f"{FINEST_TARGET} voxel widths (only the optimum); {hard_targets(4)} of them are met by no "
        "more than four designs.",
        *(_picture("ecdf", section, terms) for terms in TERMS),
        *_fixed_budget(section, parts, mark),
        f"{mark} Fixed targets",
        "Expected running time: the unique evaluations of all runs together, each counted until it "
        "reached the share of the best fitness or ended, per run that reached it; in parentheses "
        f"the share of runs that did. ∞: none did. {markdown.target_sizes(FIXED_TARGETS)}",
        parts.texts[key("fixed_target", section.level)],
        *_pairs(section, parts, mark),
    ]


def _fixed_budget(section: Section, parts: Parts, mark: str) -> list[str]:
    blocks = [
        f"{mark} Fixed budgets",
        "IQM of the regret after so many unique evaluations, with its band. "
        f"{HELD} with a share: only that share of the runs used so many; the others keep their "
        "last value. Empty: the searcher's own budget is smaller.",
        _picture("fixed_budget", section),
    ]
    for terms in TERMS:
        blocks += [f"In {terms} terms:", parts.texts[key("fixed_budget", section.level, terms)]]
    return blocks


def _pairs(section: Section, parts: Parts, mark: str) -> list[str]:
    """Show all pairs at one budget, and name the files with the others."""
    names = [key("pairs", section.level, terms) for terms in TERMS]
    if names[0] not in parts.texts:
        return []
    blocks = [
        f"{mark} Pairs",
        f"After {shown_budget(section)} unique evaluations: the chance (Vargha and Delaney's A12) "
        "that a run of the searcher at the left has found a fitter design than one of the searcher "
        "above, ties counted half. Bold: Mann and Whitney's two-sided test, adjusted by Holm for "
        "all pairs of the table, is below 0.05. The other budgets are in "
        f"tables/{names[0]}.md and tables/{names[1]}.md, U and p in tables/pairs.csv.",
    ]
    for terms, name in zip(TERMS, names, strict=True):
        blocks += [f"In {terms} terms:", parts.texts[name]]
    return blocks


def shown_budget(section: Section) -> int:
    """Return the fixed budget at which the page shows all pairs."""
    return max((b for b in budgets(section.length) if b <= PAIRS_AT), default=section.length)


def _noise(parts: Parts, notes: list[str], naive: str) -> list[str]:
    blocks = [
        "## What is recommended",
        "*True value*: the mean fitness of a design at that level of noise, measured over many "
        "draws (exact at level 0). *True regret*: the largest true value of all designs less that "
        "of the one recommended (IQM and mean; lower is better). *Optimism*: what the searcher "
        "believes the recommended design to be worth less its true value (mean; 0 is honest, above "
        "it the searcher was fooled by luck). The bands are about the runs; that the true values "
        "have errors themselves is not in them.",
        "\n".join(f"- {note}" for note in notes),
        *(f"![{name}](figures/{name})" for name in _noise_figures(parts)),
        _policies(naive),
        parts.texts["noise_policies"],
        "Each searcher:",
        shown("noise_searchers", parts),
    ]
    if "known)" in parts.texts["noise_searchers"]:
        blocks.append(
            "Where only some are known, the others recommend designs whose true value was not "
            "measured at that level. They are left out, which may flatter or not."
        )
    return blocks


def _policies(naive: str) -> str:
    text = "All searchers together"
    if not naive:
        return f"{text}:"
    return (
        f"{text}, by policy. A12 is the chance that a run under the policy, of any searcher, has "
        f"the larger true regret (or optimism) than one under *{naive}*, ties counted half: below "
        "0.5 the policy lowers it; differences between the searchers draw it towards 0.5. p by "
        "Mann and Whitney, two-sided, adjusted by Holm for the policies of a level."
    )


def _noise_figures(parts: Parts) -> list[str]:
    return [name for name in ("true_regret.png", "optimism.png") if name in parts.figures]


def _picture(name: str, section: Section, *more: str) -> str:
    file = f"{key(name, section.level, *more)}.png"
    return f"![{file}](figures/{file})"
