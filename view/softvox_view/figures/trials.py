"""Trials held against the simulator: tracks, distances and headings, and a page of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from softvox_gym.design import called
from softvox_gym.real_tracks import LITTLE, PER_CYCLE, WITHIN, short, track_at
from softvox_gym.trials.comparison import MEANING, Comparison, Row
from softvox_search.report.style import COLOURS, grid
from softvox_view.figures import labels, style
from softvox_view.figures.tracks import MOST_MORE, NAMES, Panel, half_side, paged

Array = NDArray[np.float64]

#: Designs whose numbers stand beside their distances; those in a row of headings, those of them
#: whose numbers need not be turned, and rows on a page.
NAMED, ACROSS, MOST_FLAT, DOWN = 16, 40, 12, 4

#: Inches of a row of headings, and of what is around them; heights of a panel of distances, as
#: `grid` takes them, of several and of a single one; half of the share of its side of a mark.
ROW, FRAME, SQUARE, ALONE, MARK = 2.0, 0.6, 1.8, 2.6, 0.02

#: By so much the tracks' scale may be coarser than the simulated ones need.
MOST_TIMES = 3

#: What figures say of a condition, characters at most: across the page, above a panel of
#: distances, and above one of so many that they are small and have no numbers.
WIDE, NARROW, LEAST, MANY = 60, 36, 22, 4

MEANS = "against the simulated: mean of trials, standard deviation"

_SRCC = "SRCC {srcc:.2f} ({srcc_low:.2f} to {srcc_high:.2f})"
_ENDS = ("", "_spread", "_repeatability")

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
    """Draw tracks, distances and headings; returns the figures by file name.

    Raises
    ------
    ValueError
        For more rows than have room.
    """
    if (rows := len(comparison.rows)) > MOST_MORE:
        raise ValueError(
            f"designs under their conditions are {rows}, and at most {MOST_MORE} have room in the "
            "figures; choose some of them"
        )
    panels = [
        _panel(name, row, _mark(comparison, row))
        for name, row in zip(NAMES, comparison.rows, strict=False)
    ]
    # All real tracks have room at one scale, unless some go far beyond the simulated ones.
    half = min(
        max(half_side(panel.points) for panel in panels),
        MOST_TIMES * max(half_side(panel.simulated) for panel in panels),
    )
    with style.style():
        return {
            **paged("tracks", panels, half=half),
            "distances": draw_distances(comparison),
            **draw_headings(comparison),
        }


def _mark(comparison: Comparison, row: Row) -> str:
    """Return which condition a row has, where there are several."""
    conditions = comparison.conditions
    return f" ({1 + conditions.index(row.condition)})" if len(conditions) > 1 else ""


def _panel(name: str, row: Row, mark: str) -> Panel:
    simulated, *real = row.tracks
    times = np.arange(max(1, np.ceil(simulated.cycle[-1] * PER_CYCLE - 1e-6)) + 1) / PER_CYCLE
    walked = track_at(times, simulated.cycle, simulated.position)
    unit = "voxel widths"
    return Panel(name + mark, row.design, "", 0, walked, real, list(row.compared), unit)


def draw_distances(comparison: Comparison) -> Figure:
    """Draw the real distance of every design against the simulated one, a panel per condition."""
    n = len(comparison.conditions)
    made, axes = grid(n, height=SQUARE if n > 1 else ALONE, is_shared=False)
    words, width = [], NARROW if len(axes) < MANY else LEAST
    for i, (axis, (condition, facts)) in enumerate(
        zip(axes, comparison.summary.items(), strict=True)
    ):
        rows = [row for row in comparison.rows if row.condition == condition]
        points, spread = _columns(
            rows, ("distance_simulated", "distance_real"), ("distance_real_spread",)
        )
        bars = np.nan_to_num(spread)
        end = 1.08 * max(points[:, 0].max(), (points[:, 1] + bars[:, 0]).max(), LITTLE)
        start = -0.04 * end
        axis.plot((start, end), (start, end), **_SAME)
        axis.errorbar(points[:, 0], points[:, 1], yerr=spread[:, 0], **_DOT, **_BAR)
        axis.set(xlim=(start, end), ylim=(start, end), box_aspect=1)
        axis.locator_params(nbins=5)
        srcc = "no SRCC" if facts["srcc"] is None else _SRCC.format_map(facts)
        axis.set_title(f"{_named(comparison, i, width)}\n{srcc}", loc="left", size=style.SMALL)
        places = (points - start) / (end - start)
        high = np.hstack([np.zeros_like(bars), bars]) / (end - start)
        words.append((rows, places, np.hstack([places - high - MARK, places + high + MARK])))
    made.supxlabel("distance simulated, voxel widths")
    made.supylabel("distance real, voxel widths")
    handles = [style.line(MEANS, **_DOT, ls="none"), style.line("as simulated", **_SAME)]
    made.legend(handles=handles, loc="outside upper center", ncols=2)
    style.lay_out(made)  # where the numbers go depends on how large the panels are
    same = np.repeat(np.linspace(0, 1, 100)[:, np.newaxis], 2, axis=1)
    for axis, (rows, places, boxes) in zip(axes, words, strict=True):
        axis.apply_aspect()
        if len(rows) <= NAMED and len(axes) < MANY:
            named = [short(str(called(row.design))) for row in rows]
            labels.put(axis, list(zip(named, places, strict=True)), clear=boxes, lines=same)
    return made


def _columns(rows: Sequence[Row], *names: Sequence[str]) -> list[Array]:
    """Return numbers of some rows, shape (n, m) for m names; NaN for what there is not."""
    records = [row.record() for row in rows]
    return [np.array([[one[k] for k in own] for one in records], dtype=float) for own in names]


def _named(comparison: Comparison, i: int, width: int) -> str:
    """Return a condition as figures name it, of so many characters at most."""
    mark = f"({i + 1}) " if len(comparison.conditions) > 1 else ""
    return mark + short(str(comparison.conditions[i]), width)


def draw_headings(comparison: Comparison) -> dict[str, Figure]:
    """Draw the error of every design's heading, and by how much its trials differ.

    Returns the pages by file name.
    """
    parts = [
        (_named(comparison, i, WIDE), own[first : first + ACROSS])
        for i, condition in enumerate(comparison.conditions)
        for own in [[row for row in comparison.rows if row.condition == condition]]
        for first in range(0, len(own), ACROSS)
    ]
    most = max(len(own) for _, own in parts)
    return {
        f"headings_{1 + first // DOWN}" if first else "headings": _headings(
            parts[first : first + DOWN], most
        )
        for first in range(0, len(parts), DOWN)
    }


def _headings(parts: Sequence[tuple[str, Sequence[Row]]], most: int) -> Figure:
    """Draw a page, a row of designs per part, with room for the most designs of all parts."""
    made = style.figure(style.WIDTH, ROW * len(parts) + FRAME)
    for axis, (name, rows) in zip(
        made.subplots(len(parts), squeeze=False).flat, parts, strict=True
    ):
        (numbers,) = _columns(rows, [f"heading_error{end}" for end in _ENDS])
        places = np.arange(len(rows))
        for limit in (WITHIN, 90):
            axis.axhline(limit, **_LIMIT)
        axis.errorbar(places, numbers[:, 0], yerr=numbers[:, 1], **_DOT, **_BAR)
        axis.plot(places, numbers[:, 2], **_USUAL)
        axis.set(xlim=(-0.6, max(most, 6) - 0.4), ylim=(-6, 192), yticks=range(0, 181, 45))
        names = [short(str(called(row.design))) for row in rows]
        axis.set_xticks(places, names, rotation=90 if most > MOST_FLAT else 0)
        axis.set_title(name, loc="left")
    made.supxlabel("design")
    made.supylabel("heading off, degrees")
    usual = "between two trials of a design, mean of pairs"
    handles = [style.line(MEANS, **_DOT, ls="none"), style.line(usual, **_USUAL)]
    made.legend(handles=handles, loc="outside upper center", ncols=2)
    return made


def page(comparison: Comparison, head: str, pictures: Mapping[str, bytes]) -> str:
    """Return the page of a comparison, one file of HTML, with pictures as SVG."""
    tables = []
    for condition in comparison.conditions:
        section = comparison.section(condition)
        header, *rows = section.cells()
        lines = [_line("th", header), *(_line("td", row) for row in rows)]
        tables.append(
            f'<h2>{escape(section.title)}</h2>\n<div class="table"><table>\n'
            + "\n".join(lines)
            + f"\n</table></div>\n<p>{escape(section.facts['words'])}</p>"
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
