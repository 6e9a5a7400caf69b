"""The figures of the report on transfer methods: regret against tests."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING

import pandas as pd

from softvox_search.report import style
from softvox_search.report.curves import groups
from softvox_search.report.style import COLOURS, LINES, line, scaled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(tables: Mapping[str, pd.DataFrame]) -> dict[str, Figure]:
    """Draw the figures of a report, by task; call it within `style.style`."""
    if "regret" not in tables:
        return {}
    return {str(task): _regret(str(task), own) for (task,), own in groups(tables["regret"], "task")}


def _regret(task: str, table: pd.DataFrame) -> Figure:
    """Draw regret against tests, a panel per reality, with one line per method.

    Of several labels of one method, as eea(choice=both), the first is drawn; the tables have all.
    """
    firsts: dict[str, str] = {}
    for label in dict.fromkeys(table["method"]):
        firsts.setdefault(label.partition("(")[0].partition(" ")[0], label)
    shown = table[table["method"].isin(firsts.values())]
    dashes = [dash for dash in LINES for _ in COLOURS]
    looks = dict(zip(firsts.values(), zip(cycle(COLOURS), dashes, strict=False), strict=False))
    panels = list(groups(shown, "reality"))
    made, axes = style.grid(len(panels))
    for axis, ((reality,), own) in zip(axes, panels, strict=True):
        for (method,), curve in groups(own, "method"):
            colour, dash = looks[method]
            axis.plot(curve["tests"], curve["regret"], color=colour, ls=dash, lw=scaled(1.1))
            if curve["low"].notna().all():
                axis.fill_between(
                    curve["tests"], curve["low"], curve["high"], color=colour, alpha=0.15, lw=0
                )
        axis.set_title(str(reality))
    axes[0].set_xscale("log")
    ticks = [n for n in (1, 2, 5, 10, 20, 50, 100) if n <= shown["tests"].max()]
    axes[0].set_xticks(ticks, [str(n) for n in ticks])
    axes[0].minorticks_off()
    axes[0].set_ylim(-0.03, 1.25)
    made.supxlabel("tests in reality")
    made.supylabel("regret, share of the best")
    handles = [line(name, color=colour, ls=dash) for name, (colour, dash) in looks.items()]
    style.legend(made, f"Regret against tests, task {task}", handles)
    return made
