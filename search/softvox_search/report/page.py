"""The page report.md, which shows the tables and the figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import pandas as pd

from softvox_search.report import figures, text
from softvox_search.report.curves import TARGETS, budgets, groups, on, records
from softvox_search.report.noise import MEASURES
from softvox_search.report.statistics import RESAMPLES
from softvox_search.report.text import HELD, escaped

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Tables = Mapping[str, pd.DataFrame]

#: The budget at which the page shows all pairs; the tables have the others.
PAIRS_AT = 500

#: A longer table is linked on the page, not shown.
MOST_LINES = 40

TERMS = f"""\
- *Regret*: the best fitness of the landscape less that of the best design that the run has
  evaluated so far, both without noise, voxel widths; lower is better. Under noise it says whether
  the searcher came past a good design, not whether it knew.
- *Best fitness*: where the best of all designs is not known, that of the best design that the run
  has evaluated so far, as the searcher was told it. Targets are shares of the best that any run of
  this experiment found, and rise when another finds better.
- *Raw terms* count every design for itself, *class terms* a robot turned or mirrored as the same
  robot, worth the best of them: the model is not quite symmetric.
- *Unique evaluations*: those that no cache answered; where there is noise, all.
- *IQM*: mean of the middle half of the runs. *Bands*, in brackets and shaded: 95 % by the bootstrap
  over runs ({RESAMPLES} resamples; where searchers or problems are pooled, each is a stratum).
- *Ranked*: by the regret at the end of each searcher's own budget in raw terms, equal ones by the
  expected running time to the best (see fixed targets); under noise by the true regret of what is
  recommended, under the policy that is best for the searcher.
- *Over time*: in each panel the searcher named above it, the others in grey. A cross marks where
  the median run ended; from there on, dotted, runs that ended keep their value.
- *Targets reached*: of all pairs of a run and one of {TARGETS} targets, the share reached so far.
  The targets are log-spaced, from standing still up to 0.01 voxel widths below the best.
- *Fixed budgets*: IQM after so many unique evaluations. {HELD} with a share: only that share of the
  runs used so many; the others keep their last value. Empty: the searcher's budget is smaller.
- *Fixed targets*: the expected running time, unique evaluations of all runs together, each counted
  until it reached the share of the best fitness or ended, per run that reached it; in parentheses
  the share of runs that did. ∞: none did.
- *Pairs*: the chance (Vargha and Delaney's A12) that a run of the searcher at the left has found a
  fitter design than one of the searcher above, ties counted half. Bold: Mann and Whitney's
  two-sided test, adjusted by Holm for all pairs of the table, is below 0.05.
- *All physics*: the runs on all physics pooled, each target relative to the best of its own. A
  searcher that lacks finished runs on any of them is left out.
"""

NOISE = """\
- *True value*: the mean fitness of a design at that level of noise, measured over many draws (exact
  at level 0); that it has an error itself is not in the bands. Recommended designs of which it is
  not known are left out.
- *True regret*: the largest true value of all designs less that of the one recommended.
- *Optimism*: what the searcher believes the recommended design to be worth less its true value; 0
  is honest, above it the searcher was fooled by luck.
- *A12*: the chance that a run under the policy has the larger true regret (or optimism) than one
  under the policy naive, or the first: below 0.5 the policy lowers it. *p* by Mann and Whitney,
  two-sided, adjusted by Holm for the policies of a level.
"""


HYPERVOLUME = """\
Of two objectives, to travel far and to have few voxels: over all numbers of voxels of the lattice,
the mean of the best fitness of those robots of at most so many that the run has evaluated, voxel
widths (the area up to a robot that stands still and has a voxel more than there are sites, per
site); higher is better.
"""


def page(results: Results, made: Tables, pictures: list[str]) -> str:
    """Return the page, in Markdown, from the tables by name and the pictures by file name."""
    blocks = _head(results)
    compared = records(made["problems"]) if "problems" in made else []
    ranked = _pictures([f"ranking{problem['name']}.png" for problem in compared], pictures)
    blocks += ["## The searchers ranked", *ranked] if ranked else []
    blocks += ["## Runs", _shown("runs", text.overview(made["runs"]))]
    if "problems" in made:
        problems = made["problems"]
        blocks += ["## Problems", _shown("problems", text.problems(problems)), "## Terms", TERMS]
        if "noise_policies" in made and made["noise_policies"]["known"].any():
            ends = dict.fromkeys(name.rpartition("_level_")[0] for name in problems["name"])
            names = [f"{measure}{end}.png" for end in ends for measure in MEASURES]
            blocks += ["## What is recommended", NOISE, *_pictures(names, pictures)]
            for name in ("noise_policies", "noise_searchers"):
                blocks.append(_shown(name, text.noise(made[name])))
        for problem in records(problems):
            blocks += _comparison(made, problem, pictures)
    return "\n\n".join(block.strip("\n") for block in blocks) + "\n"


def _shown(name: str, table: str) -> str:
    """Return a table for the page, or a link to it if it is long."""
    if table.count("\n") <= MOST_LINES:
        return table
    return f"A long table: [tables/{name}.csv](tables/{name}.csv)."


def _pictures(names: list[str], pictures: list[str]) -> list[str]:
    return [f"![{name}](figures/{name})" for name in names if name in pictures]


def _head(results: Results) -> list[str]:
    failed = int((results.runs["status"] == "failed").sum())
    budgets = {name: text.budget(own) for name, own in results.budgets.items()}
    common, *others = [budget for budget, _ in Counter(budgets.values()).most_common()]
    lines = [f"{len(results.runs) - failed} finished runs, the budget of each {common}."]
    for other in others:
        names = ", ".join(escaped(name) for name, own in budgets.items() if own == other)
        lines.append(f"Except {names}: {other}.")
    lines.append(f"**{failed} failed and left out.**" if failed else "No run failed.")
    return [f"# {escaped(results.title)}", text.fenced(results.command), " ".join(lines)]


def _comparison(made: Tables, problem: dict[str, Any], pictures: list[str]) -> list[str]:
    """Compare the searchers on one problem, or on all physics together."""
    budget, target = (on(problem, made[table]) for table in ("fixed_budget", "fixed_target"))
    name, kinds = problem["name"], list(dict.fromkeys(target["terms"]))
    anytime, ecdf = (
        _pictures([f"{what}_{kind}{name}.png" for kind in kinds], pictures)
        for what in ("anytime", "ecdf")
    )
    sections = {
        f"{'Regret' if problem['known'] else 'Best fitness'} over time": anytime,
        "Targets reached": ecdf,
        "Fixed budgets": [
            *_pictures([f"fixed_budget{name}.png"], pictures),
            *_by_terms(budget, text.fixed_budget),
        ],
        "Hypervolume": _volumes(made, problem, pictures),
        "Fixed targets": [text.fixed_target(target)],
    }
    if "pairs" in made and len(pairs := on(problem, made["pairs"])):
        at = max((b for b in pairs["budget"] if b <= PAIRS_AT), default=pairs["budget"].min())
        shown = _by_terms(pairs[pairs["budget"] == at], text.pairs)
        sections["Pairs"] = [f"After {at} unique evaluations; tables/pairs.csv has others.", *shown]
    title = escaped(", ".join(figures.where(made["problems"], problem)))
    blocks = [f"## {title[0].upper()}{title[1:]}"] if title else []
    for name, content in sections.items():
        blocks += [f"{'###' if title else '##'} {name}", *content] if content else []
    return blocks


def _volumes(made: Tables, problem: dict[str, Any], pictures: list[str]) -> list[str]:
    """Return the hypervolume over time and at fixed budgets, where the optimum is not known."""
    if "hypervolume" not in made or not len(table := on(problem, made["hypervolume"])):
        return []
    held = table[table["unique"].isin(budgets(int(table["unique"].max())))]
    shown = text.fixed_budget(held.rename(columns={"unique": "budget"}))
    return [HYPERVOLUME, *_pictures([f"hypervolume{problem['name']}.png"], pictures), shown]


def _by_terms(table: pd.DataFrame, shown: Callable[[pd.DataFrame], str]) -> list[str]:
    parts = [(f"In {terms} terms:", shown(own)) for (terms,), own in groups(table, "terms")]
    return [block for part in parts for block in part]
