"""The figures of a comparison: regret over time, targets reached, regret at fixed budgets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from softvox_search.report import canvas
from softvox_search.report.canvas import scaled
from softvox_search.report.truth import TERMS, optimum

#: The searcher that every panel shows for comparison, where the experiment has it.
BASELINE = "random"

_OWN, _BASE = "#00436B", "#C75B00"

#: Between two sampled places a curve keeps its value: a best value jumps, it does not glide.
_STEPS = "steps-post"


def anytime(table: pd.DataFrame, *, title: str, ends: dict[str, float]) -> Figure:
    """Draw the regret over time of one kind of terms: a panel per searcher, all others in grey.

    Parameters
    ----------
    table : DataFrame
        Of `tables.anytime`, in one kind of terms.
    title : str
    ends : dict
        By searcher: where the median of its runs ends.
    """
    made = _multiples(table, "iqm", title=title, ends=ends, is_banded=True)
    made.supylabel("regret, voxel widths (IQM)")
    made.axes[0].set_ylim(0, _top(table))
    return made


def ecdf(table: pd.DataFrame, *, title: str, ends: dict[str, float]) -> Figure:
    """Draw the share of targets reached over time; parameters as `anytime`."""
    made = _multiples(table, "ecdf", title=title, ends=ends, is_banded=False)
    made.supylabel("share of runs and targets")
    made.axes[0].set_ylim(0, 1.02)
    return made


def _top(table: pd.DataFrame) -> float:
    """Return the upper end of an axis for all regrets of a table and their bands."""
    return 1.03 * max(float(np.nanmax(table[["iqm", "high"]].to_numpy())), 0.05 * optimum())


def _multiples(
    table: pd.DataFrame, column: str, *, title: str, ends: dict[str, float], is_banded: bool
) -> Figure:
    names = list(dict.fromkeys(table["searcher"]))
    curves = {name: table[table["searcher"] == name] for name in names}
    made, axes = canvas.grid(len(names))
    for axis, name in zip(axes, names, strict=True):
        for other in names:
            if other not in (name, BASELINE):
                axis.plot(
                    curves[other]["unique"],
                    curves[other][column],
                    color=canvas.GREY,
                    lw=scaled(0.7),
                    ds=_STEPS,
                )
        if BASELINE in curves and name != BASELINE:
            base = curves[BASELINE]
            axis.plot(base["unique"], base[column], color=_BASE, lw=scaled(1.3), ls="--", ds=_STEPS)
        _own(axis, curves[name], column, end=ends[name], is_banded=is_banded)
        axis.set_title(name)
        axis.set_xscale("log")
    longest = float(table["unique"].max())
    axes[0].set_xlim(1, max(longest, 2.0))
    axes[0].xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes[0].xaxis.set_minor_formatter(NullFormatter())
    made.supxlabel("unique evaluations")
    canvas.legend(made, title, _multiples_legend(names, is_banded=is_banded))
    return made


def _own(axis: Axes, curve: pd.DataFrame, column: str, *, end: float, is_banded: bool) -> None:
    """Draw a panel's own curve, dotted from where half of its runs have ended."""
    at = curve["unique"].to_numpy(float)
    values = curve[column].to_numpy(float)
    if is_banded:
        axis.fill_between(
            at, curve["low"], curve["high"], color=_OWN, alpha=0.25, lw=0, step="post"
        )
    done = int(np.sum(at <= end))
    look: dict[str, Any] = {"color": _OWN, "lw": scaled(1.8), "ds": _STEPS}
    axis.plot([*at[:done], end], [*values[:done], values[done - 1]], **look)
    if end < at[-1]:
        axis.plot([end, *at[done:]], [values[done - 1], *values[done:]], ls=(0, (1, 1)), **look)
        axis.plot(
            end, values[done - 1], marker="X", color=_OWN, ms=scaled(6), clip_on=False, zorder=5
        )


def _multiples_legend(names: list[str], *, is_banded: bool) -> list[Line2D]:
    handles = [Line2D([], [], color=_OWN, lw=scaled(1.8), label="the searcher named above")]
    if is_banded:
        handles.append(Line2D([], [], color=_OWN, lw=scaled(7), alpha=0.25, label="its 95 % band"))
    if BASELINE in names:
        handles.append(Line2D([], [], color=_BASE, lw=scaled(1.3), ls="--", label=BASELINE))
    if len(names) > 1:
        handles.append(Line2D([], [], color=canvas.GREY, lw=scaled(0.9), label="the others"))
    return handles


#: Of a panel's width, beside the least and the greatest regret: room for half a marker.
_SIDE = 0.06


def fixed_budget(table: pd.DataFrame, *, title: str) -> Figure:
    """Draw the regret at fixed budgets: a row per searcher, a panel per budget.

    Parameters
    ----------
    table : DataFrame
        Of `tables.fixed_budget`, in both terms.
    title : str
    """
    names = list(dict.fromkeys(table["searcher"]))
    budgets = sorted(set(table["budget"]))
    made = canvas.figure(1.4 + 1.5 * max(len(budgets), 3), scaled(1.5 + 0.32 * len(names)))
    axes = made.subplots(1, len(budgets), sharex=True, sharey=True, squeeze=False)[0]
    styles = {"raw": ("o", _OWN, _OWN, -0.14), "class": ("D", "white", _BASE, 0.14)}
    for axis, budget in zip(axes, budgets, strict=True):
        for terms in TERMS:
            here = table[(table["terms"] == terms) & (table["budget"] == budget)]
            marker, face, edge, shift = styles[terms]
            rows = np.array([names.index(name) for name in here["searcher"]]) + shift
            axis.hlines(rows, here["low"], here["high"], color=edge, lw=scaled(1.2))
            look: dict[str, Any] = {"mfc": face, "mec": edge, "ms": scaled(4.5), "ls": "none"}
            axis.plot(here["iqm"], rows, marker, **look)
        axis.set_title(f"{budget}")
        axis.set_xlim(-_SIDE * _top(table), (1 + _SIDE) * _top(table))
    axes[0].set_yticks(range(len(names)), names)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    made.supxlabel("regret after so many unique evaluations, voxel widths (IQM)")
    handles = [
        Line2D(
            [],
            [],
            marker=marker,
            mfc=face,
            mec=edge,
            color=edge,
            lw=scaled(1.2),
            label=f"{terms} terms",
        )
        for terms, (marker, face, edge, _) in styles.items()
    ]
    canvas.legend(made, title, handles)
    return made


#: The whole of a measure's name, for the axis.
_MEASURES = {
    "true_regret": "true regret, voxel widths",
    "optimism": "optimism: believed less true, voxel widths",
}


#: Height of a panel that shows many policies, relative to others.
_TALLER = 2.3 / 2.1


def noise(
    by_searcher: pd.DataFrame, by_policy: pd.DataFrame, measure: str, *, title: str
) -> Figure:
    """Draw true regret or optimism by level and policy, for all searchers together and each.

    Parameters
    ----------
    by_searcher, by_policy : DataFrame
        Of `recommendations.by_searcher` and `recommendations.by_policy`.
    measure : "true_regret" or "optimism"
    title : str
    """
    by_searcher, by_policy = (table[table["known"] > 0] for table in (by_searcher, by_policy))
    names = list(dict.fromkeys(by_searcher["searcher"]))
    levels = sorted(set(by_searcher["level"]))
    policies = list(dict.fromkeys(by_searcher["policy"]))
    panels = {"all together": by_policy} if len(names) > 1 else {}
    panels |= {name: by_searcher[by_searcher["searcher"] == name] for name in names}
    made, axes = canvas.grid(len(panels), height=_TALLER)
    for axis, (name, here) in zip(axes, panels.items(), strict=True):
        for i, policy in enumerate(policies):
            chosen = here[here["policy"] == policy]
            shift = (i - (len(policies) - 1) / 2) * 0.6 / max(len(policies), 1)
            _points(axis, chosen, measure, [levels.index(v) + shift for v in chosen["level"]], i)
        axis.set_title(name, fontweight="bold" if name == "all together" else "normal")
        axis.axhline(0, color=canvas.INK, lw=scaled(0.8))
    axes[0].set_xticks(range(len(levels)), [f"{level:g}" for level in levels])
    axes[0].set_xlim(-0.5, len(levels) - 0.5)
    made.supxlabel("level of noise")
    made.supylabel(_MEASURES[measure])
    handles = [
        Line2D([], [], **_look(i), label=policy or "no policy") for i, policy in enumerate(policies)
    ]
    canvas.legend(made, title, handles)
    return made


def _look(i: int) -> dict[str, Any]:
    colour = canvas.COLOURS[i % len(canvas.COLOURS)]
    return {
        "color": colour,
        "marker": canvas.MARKERS[i % len(canvas.MARKERS)],
        "ls": canvas.LINES[i % len(canvas.LINES)],
        "lw": scaled(1.0),
        "ms": scaled(4.5),
        "mec": canvas.INK,
        "mew": scaled(0.5),
    }


def _points(
    axis: Axes, table: pd.DataFrame, measure: str, places: list[float], policy: int
) -> None:
    look = _look(policy)
    low, high = table[f"{measure}_low"], table[f"{measure}_high"]
    axis.vlines(places, low, high, color=look["color"], lw=scaled(1.4))
    axis.plot(places, table[measure], **look)
