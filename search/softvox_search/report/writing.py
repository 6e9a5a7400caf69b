"""From results to the files of a report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from softvox_gym.files import write_file, write_folder
from softvox_search.report import canvas, drawing, markdown, page, recommendations, tables
from softvox_search.report.cells import Cell, Section, cells_of, sections_of
from softvox_search.report.drawing import key
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
    made = _comparison(parts, sections) if cells else {}
    noisy = [cell for cell in cells if not np.isnan(cell.level)]
    notes: list[str] = []
    if noisy:
        noise, notes = _noise(parts, noisy)
        made |= noise
    if cells:
        with canvas.style():
            for name, figure in drawing.drawn(drawing.Tables(results.runs, **made)).items():
                parts.figure(name, figure)
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


def _comparison(parts: Parts, sections: list[Section]) -> dict[str, pd.DataFrame]:
    """Make the tables in which searchers are compared level by level; return what is drawn."""
    made: dict[str, list[pd.DataFrame]] = {}
    for section in sections:
        budget = tables.fixed_budget(section)
        target = tables.fixed_target(section)
        pairs = tables.pairs(section)
        for name, table in (
            ("anytime", tables.anytime(section)),
            ("fixed_budget", budget),
            ("fixed_target", target),
            ("pairs", pairs),
        ):
            made.setdefault(name, []).append(table)
        level = section.level
        parts.text(key("fixed_target", level), markdown.fixed_target(target))
        for terms in TERMS:
            parts.text(key("fixed_budget", level, terms), markdown.fixed_budget(budget, terms))
            if len(pairs):
                parts.text(key("pairs", level, terms), markdown.pairs(pairs, terms))
                parts.texts[key("pairs", level, terms)] = markdown.pairs_at(
                    pairs, terms, page.shown_budget(section)
                )
    whole = {name: pd.concat(frames, ignore_index=True) for name, frames in made.items()}
    for name, table in whole.items():
        parts.tables[f"{name}.csv"] = csv(table)
    return {name: whole[name] for name in ("anytime", "fixed_budget")}


def _noise(parts: Parts, cells: list[Cell]) -> tuple[dict[str, pd.DataFrame], list[str]]:
    """Make the tables of what the searchers recommend; return those drawn, and notes on them."""
    frame, notes = recommendations.recommendations(cells)
    by_searcher = recommendations.by_searcher(frame)
    by_policy = recommendations.by_policy(frame)
    parts.tables["recommendations.csv"] = csv(frame)
    parts.table("noise_searchers", csv(by_searcher), markdown.by_searcher(by_searcher))
    parts.table("noise_policies", csv(by_policy), markdown.by_policy(by_policy))
    return {"by_searcher": by_searcher, "by_policy": by_policy}, notes
