"""From results to the files of a report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from softvox_gym.files import write_file, write_folder
from softvox_search.report import canvas, figures, markdown, page, recommendations, tables
from softvox_search.report.cells import Cell, Section, cells_of, sections_of
from softvox_search.report.page import Parts
from softvox_search.report.results import Results
from softvox_search.report.text import csv
from softvox_search.report.truth import TERMS


def write_report(folder: Path, results: Results) -> list[str]:
    """Write a report; see `softvox_search.report.write`."""
    parts = Parts()
    overview = tables.overview(results)
    parts.table("runs", csv(overview), markdown.overview(overview))
    cells = cells_of(results)
    sections = sections_of(cells)
    with canvas.style():
        if cells:
            _comparison(parts, sections)
        noisy = [cell for cell in cells if not np.isnan(cell.level)]
        notes = _noise(parts, noisy) if noisy else []
    text = page.report(results, sections, parts, notes)
    for name, contents in (("tables", parts.tables), ("figures", parts.figures)):
        if contents:
            write_folder(folder / name, contents, force=True)
    write_file(folder / "report.md", text.encode(), force=True)
    return [
        *(f"tables/{name}" for name in parts.tables),
        *(f"figures/{name}" for name in parts.figures),
        "report.md",
    ]


def _comparison(parts: Parts, sections: list[Section]) -> None:
    """Make the tables and figures in which searchers are compared level by level."""
    made: dict[str, list[pd.DataFrame]] = {}
    for section in sections:
        anytime = tables.anytime(section)
        budget = tables.fixed_budget(section)
        target = tables.fixed_target(section)
        pairs = tables.pairs(section)
        for name, table in (
            ("anytime", anytime),
            ("fixed_budget", budget),
            ("fixed_target", target),
            ("pairs", pairs),
        ):
            made.setdefault(name, []).append(table)
        parts.text(page.key("fixed_target", section), markdown.fixed_target(target))
        for terms in TERMS:
            parts.text(
                page.key("fixed_budget", section, terms), markdown.fixed_budget(budget, terms)
            )
            if len(pairs):
                parts.text(page.key("pairs", section, terms), markdown.pairs(pairs, terms))
                parts.texts[page.key("pairs", section, terms)] = markdown.pairs_at(
                    pairs, terms, page.shown_budget(section)
                )
        _comparison_figures(parts, section, anytime, budget)
    for name, frames in made.items():
        parts.tables[f"{name}.csv"] = csv(pd.concat(frames, ignore_index=True))


def _comparison_figures(
    parts: Parts, section: Section, anytime: pd.DataFrame, budget: pd.DataFrame
) -> None:
    at = "" if np.isnan(section.level) else f", noise level {section.level:g}"
    ends = {cell.searcher: float(np.median(cell.unique)) for cell in section.cells}
    for terms in TERMS:
        here = anytime[anytime["terms"] == terms]
        title = f"Regret in {terms} terms{at}"
        parts.figure(
            page.key("anytime", section, terms), figures.anytime(here, title=title, ends=ends)
        )
        title = f"Targets reached in {terms} terms{at}"
        parts.figure(page.key("ecdf", section, terms), figures.ecdf(here, title=title, ends=ends))
    parts.figure(
        page.key("fixed_budget", section),
        figures.fixed_budget(budget, title=f"Regret at fixed budgets{at}"),
    )


def _noise(parts: Parts, cells: list[Cell]) -> list[str]:
    """Make the tables and figures of what the searchers recommend; return notes on the truth."""
    frame, notes = recommendations.recommendations(cells)
    by_searcher = recommendations.by_searcher(frame)
    by_policy = recommendations.by_policy(frame)
    parts.tables["recommendations.csv"] = csv(frame)
    parts.table("noise_searchers", csv(by_searcher), markdown.by_searcher(by_searcher))
    parts.table("noise_policies", csv(by_policy), markdown.by_policy(by_policy))
    if frame["true_value"].notna().any():
        for measure, title in (
            ("true_regret", "True regret by level of noise (IQM)"),
            ("optimism", "Optimism by level of noise (mean)"),
        ):
            made = figures.noise(by_searcher, by_policy, measure, title=title)
            parts.figure(measure, made)
    return notes
