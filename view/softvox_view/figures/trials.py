"""Trials held against the simulator: tracks, distances and headings, and a page of all."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from softvox_gym.design import called
from softvox_gym.real_tracks import LITTLE, PER_CYCLE, WITHIN, short, track_at
from softvox_gym.trials.comparison import MEANING, Comparison, Row
from softvox_search.report.style import COLOURS, MARKERS
from softvox_view.figures import labels, style
from softvox_view.figures.tracks import MOST_MORE, NAMES, Panel, half_side, paged

#: Designs whose numbers stand beside their distances, and those in a row of headings.
NAMED, ACROSS = 16, 40

#: Inches: of the square of distances, of a row of headings, of what is around them, and of a
#: condition in a legend.
SIDE, ROW, FRAME, ENTRY = 3.4, 1.45, 0.6, 0.3

#: By so much the tracks' scale may be coarser than the simulated ones need.
MOST_TIMES = 3

#: What a legend says of a condition, characters at most.
WIDE = 60

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
            "headings": draw_headings(comparison),
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
    """Draw the real distance of every design against the simulated one."""
    made = style.figure(SIDE + FRAME, SIDE + FRAME + ENTRY * (1 + len(comparison.conditions)))
    axis = made.subplots()
    records = [row.record() for row in comparison.rows]
    points = np.array([[one["distance_simulated"], one["distance_real"]] for one in records])
    spread = np.array([one["distance_real_spread"] for one in records], dtype=np.float64)
    bars = np.nan_to_num(spread)
    end = 1.08 * max(points[:, 0].max(), (points[:, 1] + bars).max(), LITTLE)
    start = -0.04 * end
    axis.plot((start, end), (start, end), label="as simulated", **_SAME)
    for i, (condition, facts) in enumerate(comparison.summary.items()):
        of = np.array([row.condition == condition for row in comparison.rows])
        found = "no SRCC" if facts["srcc"] is None else _srcc(facts)
        looks: dict[str, Any] = {
            **_BAR,
            "marker": MARKERS[(i + i // len(COLOURS)) % len(MARKERS)],
            "color": COLOURS[i % len(COLOURS)],
        }
        label = f"{_named(comparison, i)}\n{found}"
        axis.errorbar(points[of, 0], points[of, 1], yerr=spread[of], label=label, **looks)
    axis.set(xlim=(start, end), ylim=(start, end), box_aspect=1)
    made.supxlabel("distance simulated, voxel widths")
    made.supylabel("distance real, voxel widths: mean of trials, standard deviation")
    made.legend(loc="outside upper left", alignment="left")
    style.lay_out(made)
    if len(points) <= NAMED:
        places = (points - start) / (end - start)
        boxes = np.hstack([places - 0.02, places + 0.02])
        boxes[:, 1] -= bars / (end - start)
        boxes[:, 3] += bars / (end - start)
        same = np.repeat(np.linspace(0, 1, 100)[:, np.newaxis], 2, axis=1)
        words = [short(str(called(row.design))) for row in comparison.rows]
        labels.put(axis, list(zip(words, places, strict=True)), clear=boxes, lines=same)
    return made


def _srcc(facts: Mapping[str, Any]) -> str:
    return "SRCC {srcc:.2f} (95 % band {srcc_low:.2f} to {srcc_high:.2f})".format_map(facts)


def _named(comparison: Comparison, i: int) -> str:
    """Return a condition as figures name it."""
    mark = f"({i + 1}) " if len(comparison.conditions) > 1 else ""
    return mark + short(str(comparison.conditions[i]), WIDE)


def draw_headings(comparison: Comparison) -> Figure:
    """Draw the error of every design's heading, and by how much its trials differ."""
    parts = [
        (i, own[first : first + ACROSS])
        for i, condition in enumerate(comparison.conditions)
        for own in [[row for row in comparison.rows if row.condition == condition]]
        for first in range(0, len(own), ACROSS)
    ]
    most = max(len(own) for _, own in parts)
    made = style.figure(style.WIDTH, (ROW + FRAME) * len(parts) + FRAME)
    for axis, (i, own) in zip(made.subplots(len(parts), squeeze=False).flat, parts, strict=True):
        records, places = [row.record() for row in own], np.arange(len(own))
        values, spread, usual = (
            np.array([one[f"heading_error{end}"] for one in records], dtype=np.float64)
            for end in ("", "_spread", "_repeatability")
        )
        for limit in (WITHIN, 90):
            axis.axhline(limit, **_LIMIT)
        axis.errorbar(places, values, yerr=spread, **_DOT, **_BAR)
        axis.plot(places, usual, **_USUAL)
        axis.set(xlim=(-0.6, max(most, 6) - 0.4), ylim=(-6, 192), yticks=range(0, 181, 45))
        names = [short(str(called(row.design))) for row in own]
        axis.set_xticks(places, names, rotation=90 if most > 16 else 0)
        axis.set_title(_named(comparison, i), loc="left")
    made.supxlabel("design")
    made.supylabel("heading off, degrees")
    handles = [
        style.line("from the simulated: mean of trials, standard deviation", **_DOT, ls="none"),
        style.line("between two trials of a design, mean of pairs", **_USUAL),
    ]
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
