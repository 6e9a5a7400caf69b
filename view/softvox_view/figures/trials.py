"""Trials compared with the simulator: tracks, distances and headings, and a page of all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softvox_gym.real_tracks import LITTLE, WITHIN, short
from softvox_gym.trials.comparison import MEANING, Comparison
from softvox_gym.trials.trial import Condition
from softvox_search.report.style import COLOURS, grid
from softvox_view.figures import labels, style
from softvox_view.figures.tracks import MOST_MORE, NAMES, Panel, half_side, paged

#: The columns of a condition's table, and its facts, by name.
Numbers: TypeAlias = Mapping[str, Any]

#: The most designs with numbers in a panel. Heights of panels, as `grid` takes them: of several,
#: and of a single one. Half the size of a mark, as a share of a panel's side.
NAMED, SQUARE, ALONE, MARK = 16, 1.8, 2.6, 0.02

#: The most characters of a condition above a panel: as a rule, and for MANY panels or more, which
#: are small and have no numbers.
WIDE, NARROW, MANY = 36, 22, 4

MEANS = "against the simulated: mean of trials, standard deviation"

_BAR: dict[str, Any] = {"ls": "none", "mec": "white", "elinewidth": 0.7, "capsize": 1.5}
_BAR |= {"ms": 4, "mew": 0.5}
_DOT: dict[str, Any] = {"marker": "o", "color": COLOURS[0]}
_SAME: dict[str, Any] = {"color": style.INK, "lw": 0.6, "zorder": 1}
_USUAL: dict[str, Any] = {"marker": "_", "color": style.INK, "mew": 1.4, "ms": 7, "ls": "none"}
_LIMIT: dict[str, Any] = {"color": style.GREY, "lw": 0.6, "ls": (0, (4, 2)), "zorder": 1}

PAGE = """\
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Trials and simulator</title>
<style>
body {{ font: 16px/1.5 sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }}
svg {{ max-width: 100%; height: auto; }}
.table {{ overflow-x: auto; }}
table {{ border-collapse: collapse; font-size: 14px; font-variant-numeric: tabular-nums; }}
th, td {{ padding: 0.1rem 0.5rem; text-align: right; border-bottom: 1px solid #ddd; }}
</style>
<h1>Trials and simulator</h1>
<p>{head}</p>
{tables}
<p>{meaning}</p>
{pictures}
</html>
"""


def draw_comparison(comparison: Comparison) -> dict[str, Figure]:
    """Draw tracks, distances and headings; return the figures by file name.

    Raises
    ------
    ValueError
        If there are more rows than have room.
    """
    if (rows := len(comparison.rows)) > MOST_MORE:
        raise ValueError(
            f"the comparison has {rows} rows, and at most {MOST_MORE} have room in the figures; "
            "select fewer trials"
        )
    marks = _marks(comparison)
    panels = [
        Panel(
            f"{name} {marks[row.condition]}".strip(),
            row.design,
            fitness="",
            tipped=0,
            simulated=row.tracks[0].position,
            real=list(row.tracks[1:]),
            compared=list(row.compared),
            unit="voxel widths",
        )
        for name, row in zip(NAMES, comparison.rows, strict=False)
    ]
    with style.style():
        return {
            **paged("tracks", panels, half=max(half_side(panel.points) for panel in panels)),
            "distances": draw_distances(comparison),
            "headings": draw_headings(comparison),
        }


def _marks(comparison: Comparison) -> dict[Condition, str]:
    """Return the labels that distinguish conditions, if there are several."""
    conditions = comparison.conditions
    return {one: f"({i})" * (len(conditions) > 1) for i, one in enumerate(conditions, start=1)}


def _panels(
    comparison: Comparison,
    draw: Callable[[Axes, Numbers], str],
    handles: Sequence[Line2D],
    xlabel: str,
    ylabel: str,
) -> tuple[Figure, list[Axes]]:
    """Return a figure with a panel per condition; `draw` returns the rest of a panel's title."""
    conditions, marks = comparison.conditions, _marks(comparison)
    made, axes = grid(
        len(conditions), height=SQUARE if len(conditions) > 1 else ALONE, is_shared=False
    )
    width = NARROW if len(axes) >= MANY else WIDE
    for axis, (condition, section) in zip(axes, conditions.items(), strict=True):
        columns = zip(section.columns, zip(*section.rows, strict=True), strict=True)
        numbers = {column.key: values for column, values in columns} | dict(section.facts)
        title = f"{marks[condition]} {short(str(condition), width)}".strip()
        looks: dict[str, Any] = {"loc": "left", "size": style.SMALL, "parse_math": False}
        axis.set_title(title + draw(axis, numbers), **looks)
    made.legend(handles=handles, loc="outside upper center", ncols=1 + (len(axes) > 2))
    if len(axes) > 1:
        made.supxlabel(xlabel)
        made.supylabel(ylabel)
    else:
        axes[0].set(xlabel=xlabel, ylabel=ylabel)
    return made, axes


def draw_distances(comparison: Comparison) -> Figure:
    """Draw the real distance of every design against the simulated one, a panel per condition."""
    words = []

    def draw(axis: Axes, numbers: Numbers) -> str:
        points = np.transpose([numbers["distance_simulated"], numbers["distance_real"]])
        spread = np.array(numbers["distance_real_spread"], dtype=float)
        bars = np.nan_to_num(spread)
        end = 1.08 * max(points[:, 0].max(), (points[:, 1] + bars).max(), LITTLE)
        start = -0.04 * end
        axis.plot((start, end), (start, end), **_SAME)
        axis.errorbar(points[:, 0], points[:, 1], yerr=spread, **_DOT, **_BAR)
        axis.set(xlim=(start, end), ylim=(start, end), box_aspect=1)
        axis.locator_params(nbins=5)
        places = (points - start) / (end - start)
        high = MARK + np.outer(bars, [0, 1]) / (end - start)
        words.append((_names(numbers), places, np.hstack([places - high, places + high])))
        srcc = "SRCC {srcc:.2f} ({srcc_low:.2f} to {srcc_high:.2f})"
        return "\n" + ("no SRCC" if numbers["srcc"] is None else srcc.format_map(numbers))

    handles = [style.line(MEANS, **_DOT, ls="none"), style.line("as simulated", **_SAME)]
    around = ("simulated distance, voxel widths", "real distance, voxel widths")
    made, axes = _panels(comparison, draw, handles, *around)
    style.lay_out(made)  # the size of the panels decides where the numbers go
    same = np.repeat(np.linspace(0, 1, 100)[:, np.newaxis], 2, axis=1)
    for axis, (names, places, boxes) in zip(axes, words, strict=True):
        axis.apply_aspect()
        if len(names) <= NAMED and len(axes) < MANY:
            labels.put(axis, list(zip(names, places, strict=True)), clear=boxes, lines=same)
    return made


def draw_headings(comparison: Comparison) -> Figure:
    """Draw the error of every design's heading, and the difference between its trials."""

    def draw(axis: Axes, numbers: Numbers) -> str:
        values, spread, usual = (
            np.array(numbers[f"heading_error{end}"], dtype=float)
            for end in ("", "_spread", "_repeatability")
        )
        places = np.arange(len(values))
        for limit in (WITHIN, 90):
            axis.axhline(limit, **_LIMIT)
        axis.errorbar(places, values, yerr=spread, **_DOT, **_BAR)
        axis.plot(places, usual, **_USUAL)
        axis.set(xlim=(-0.6, max(len(places), 6) - 0.4), ylim=(-6, 192), yticks=range(0, 181, 45))
        is_named = len(places) <= NAMED
        axis.set_xticks(places, _names(numbers) if is_named else [""] * len(places), rotation=90)
        return ""

    usual = "between two trials of a design, mean of pairs"
    handles = [style.line(MEANS, **_DOT, ls="none"), style.line(usual, **_USUAL)]
    around = ("design, in the order of the table", "heading off, degrees")
    return _panels(comparison, draw, handles, *around)[0]


def _names(numbers: Numbers) -> list[str]:
    return [short(str(design)) for design in numbers["design"]]


def page(comparison: Comparison, head: str, pictures: Mapping[str, bytes]) -> str:
    """Return the page of a comparison, one HTML file, with pictures as SVG."""
    tables = []
    for section in comparison.conditions.values():
        header, *rows = section.cells()
        lines = "\n".join([_line("th", header), *(_line("td", row) for row in rows)])
        facts = section.facts
        tables.append(
            f"<h2>{escape(section.title)}</h2>\n<p>{escape(facts['cycles'])}</p>\n"
            f'<div class="table"><table>\n{lines}\n</table></div>\n<p>{escape(facts["words"])}</p>'
        )
    drawn = (picture.decode() for picture in pictures.values())
    shown = [f"<figure>{svg[svg.index('<svg') :]}</figure>" for svg in drawn]
    return PAGE.format(
        head=escape(head),
        tables="\n".join(tables),
        meaning=escape(MEANING),
        pictures="\n".join(shown),
    )


def _line(tag: str, cells: list[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"
