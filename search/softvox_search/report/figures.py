"""The figures of a report: ranking, regret over time, targets, fixed budgets, noise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from softvox_search.report import style
from softvox_search.report.curves import PROBLEM, groups, on, records
from softvox_search.report.noise import MEASURES
from softvox_search.report.style import line, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The searcher that every panel shows for comparison, if the experiment has it.
BASELINE = "random"

_OWN, _BASE = "#00436B", "#C75B00"

#: A curve keeps its value between two sampled positions, as a best value changes in jumps.
_STEPS = "steps-post"

_AXIS = {"regret": "regret", "best": "best fitness", "hypervolume": "hypervolume"}

#: The columns that are ranked, which become "value" with its band.
_RANKED = dict.fromkeys(("iqm", "ert", "true_regret"), "value")
_RANKED |= {f"true_regret_{end}": end for end in ("low", "high")}

#: For both measures under noise: title of the figure, and label of its axis.
_NOISE = {
    "true_regret": ("True regret by level of noise (IQM)", "true regret, voxel widths"),
    "optimism": (
        "Optimism by level of noise (mean)",
        "optimism: believed less true, voxel widths",
    ),
}


def draw(tables: Mapping[str, pd.DataFrame]) -> dict[str, Figure]:
    """Draw the figures of a report from its `tables.make`; call it within `style.style`.

    Returns them by file name without suffix, in the order in which the report shows them.
    """
    made: dict[str, Figure] = {}
    if "problems" not in tables:
        return made
    problems = tables["problems"]
    for problem in records(problems):
        runs, curves, budgets = (
            on(problem, tables[table]) for table in ("runs", "anytime", "fixed_budget")
        )
        runs = runs[(runs["policy"] == problem["policy"]) & (runs["runs"] > 0)]
        ends = dict(zip(runs["searcher"], runs["unique"], strict=True))
        place = "".join(f", {part}" for part in where(problems, problem))
        at = place + (f", policy {problem['policy']}" if problem["policy"] else "")
        what = "Regret" if problem["known"] else "Best fitness"
        if len(budgets):
            target = on(problem, tables["fixed_target"])
            noisy = on(problem, tables["noise_searchers"]) if "noise_searchers" in tables else None
            made[f"ranking{problem['name']}"] = ranking(budgets, target, noisy, at=place)
        for terms in dict.fromkeys(curves["terms"]):
            here = curves[curves["terms"] == terms]
            kinds = {"anytime": ("iqm", what)} if len(budgets) else {}
            for kind, (column, shown) in {**kinds, "ecdf": ("ecdf", "Targets reached")}.items():
                title = f"{shown} in {terms} terms{at}"
                file = f"{kind}_{terms}{problem['name']}"
                made[file] = over_time(here, column, title=title, ends=ends)
        if "hypervolume" in tables and len(volumes := on(problem, tables["hypervolume"])):
            title = f"Hypervolume of fitness and voxels{at}"
            file = f"hypervolume{problem['name']}"
            made[file] = over_time(volumes, "iqm", title=title, ends=ends)
        if len(budgets):
            title = f"{what} at fixed budgets{at}"
            made[f"fixed_budget{problem['name']}"] = fixed_budget(budgets, title=title)
    if "noise_policies" not in tables:
        return made
    for _, group in groups(problems, "physics", "shape"):
        problem = records(group)[0]
        by_searcher, by_policy = (
            pd.concat([on(each, table[table["known"] > 0]) for each in records(group)])
            for table in (tables["noise_searchers"], tables["noise_policies"])
        )
        at = "".join(f", {part}" for part in where(problems, problem)[:-1])
        for measure in MEASURES if len(by_policy) else ():
            file = measure + problem["name"].rpartition("_level_")[0]
            made[file] = noise(by_searcher, by_policy, measure, at)
    return made


def where(problems: pd.DataFrame, problem: Mapping[str, Any]) -> list[str]:
    """Describe in words which of several problems this is."""
    physics, shape, level = (problem[name] for name in PROBLEM)
    parts = []
    if problems["physics"].nunique() > 1:
        parts.append(f"physics {physics}" if physics else "all physics")
    if problems["shape"].nunique() > 1:
        parts.append(f"lattice {shape}")
    return parts + ([] if np.isnan(level) else [f"noise level {level:g}"])


def _measure(table: pd.DataFrame) -> str:
    return _AXIS[str(table["measure"].iat[0])]


def _top(table: pd.DataFrame) -> float:
    """Return the upper end of an axis that has room for all values of a table and their bands."""
    return 1.03 * max(float(np.nanmax(table[["iqm", "high"]].to_numpy())), 0.2)


def ranking(
    budgets: pd.DataFrame, target: pd.DataFrame, noisy: pd.DataFrame | None, *, at: str
) -> Figure:
    """Draw the searchers of a problem, best first, ranked by what they found in the end.

    They are ranked by `tables.fixed_budget` at the end of each budget, in raw terms. A second panel
    breaks ties by the evaluations of `tables.fixed_target` per best design; fewer are better. Under
    noise, if the truth is known, they are ranked by the true regret of what they recommend, each
    under the policy that is best for it.
    """
    last = budgets.dropna(subset="iqm").groupby(["terms", "searcher"], sort=False).tail(1)
    cost, measure, by = target[target["target"] == 1], _measure(budgets), "terms"
    shown = {f"{measure} at the end, voxel widths": last, "evaluations per best design found": cost}
    if noisy is not None and noisy["known"].gt(0).all():
        by, shown = "policy", {"true regret of what is recommended, voxel widths": noisy}
    shown = {
        label: table.rename(columns={by: "series", **_RANKED}) for label, table in shown.items()
    }
    series = list(dict.fromkeys(next(iter(shown.values()))["series"]))
    counted = series[:1] if by == "terms" else series
    ranked = (table[table["series"].isin(counted)] for table in shown.values())
    names = _ranked(ranked, is_best_largest=by == "terms" and measure == _AXIS["best"])
    row = max(0.32, 0.14 * len(series))
    made = style.figure(3.2 + 3.6 * len(shown), scaled(1.6 + row * len(names)))
    axes = made.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for axis, (label, table) in zip(axes, shown.items(), strict=True):
        if label.startswith("evaluations"):
            style.log_axis(axis)
        _rows(axis, table, names, series)
        axis.set_xlabel(f"{label} (95 % band)")
    ends = dict(zip(last["searcher"], last["budget"], strict=True))
    cut = {name: f" (after {end})" for name, end in ends.items() if end < last["budget"].max()}
    words = [f"{i}. {name}{cut.get(name, '')}" for i, name in enumerate(names, start=1)]
    axes[0].set_yticks(range(len(names)), words)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    words = [f"{name} terms" if by == "terms" else name or "no policy" for name in series]
    handles = [line(word, **_dots(i)) for i, word in enumerate(words)]
    style.legend(made, f"The searchers ranked{at}", handles)
    return made


def _ranked(tables: Iterable[pd.DataFrame], *, is_best_largest: bool) -> list[str]:
    """Return the searchers by their lowest values of the first table, ties by the next."""
    worth = [table.groupby("searcher")["value"].min() for table in tables]
    if is_best_largest:
        worth[0] = -worth[0]
    keys = ["first", "second"][: len(worth)]
    return list(pd.concat(worth, axis=1, keys=keys).sort_values(keys, kind="stable").index)


def _rows(axis: Axes, table: pd.DataFrame, names: list[str], series: list[str]) -> None:
    """Draw value, low and high of a table, a row per name; infinite values go to the edge."""
    finite = table[["value", "low", "high"]].replace(np.inf, np.nan)
    edge = 1.1 * float(np.nanmax(finite.to_numpy(), initial=0.2))
    for i, kind in enumerate(series):
        here = table[table["series"] == kind]
        shift = (i - (len(series) - 1) / 2) * 0.7 / len(series)
        rows = np.array([names.index(name) for name in here["searcher"]]) + shift
        color, ends = _look(i)["color"], here["high"].clip(upper=edge)
        axis.hlines(rows, here["low"], ends, color=color, lw=scaled(1.4))
        axis.plot(here["value"].replace(np.inf, edge), rows, clip_on=False, **_dots(i))
        for row in rows[np.isinf(here["value"])]:
            axis.text(0.97 * edge, row, "none found it ", ha="right", va="center")
    axis.set_xlim(0 if axis.get_xscale() == "linear" else None, edge)


def over_time(table: pd.DataFrame, column: str, *, title: str, ends: Mapping[str, float]) -> Figure:
    """Draw a column of `tables.anytime` in one kind of terms: "iqm" with its band, or "ecdf".

    There is a panel per searcher, with all others in grey; ends is where its median run ends.
    """
    is_banded = column == "iqm"
    names = list(dict.fromkeys(table["searcher"]))
    curves = {name: table[table["searcher"] == name] for name in names}
    made, axes = style.grid(len(names))
    for axis, name in zip(axes, names, strict=True):
        for other in names:
            if other not in (name, BASELINE):
                grey: dict[str, Any] = {"color": style.GREY, "lw": scaled(0.7), "ds": _STEPS}
                axis.plot(curves[other]["unique"], curves[other][column], **grey)
        if BASELINE in curves and name != BASELINE:
            base = curves[BASELINE]
            axis.plot(base["unique"], base[column], color=_BASE, lw=scaled(1.3), ls="--", ds=_STEPS)
        end = ends.get(name, curves[name]["unique"].max())
        _own(axis, curves[name], column, end=end, is_banded=is_banded)
        axis.set_title(name)
    axes[0].set_ylim(0, _top(table) if is_banded else 1.02)
    axes[0].set_xlim(1, max(float(table["unique"].max()), 2.0))
    axes[0].set_xscale("log")
    axes[0].xaxis.set_major_formatter("{x:g}")
    axes[0].minorticks_off()
    made.supxlabel("unique evaluations")
    what = f"{_measure(table)}, voxel widths (IQM)" if is_banded else "share of runs and targets"
    made.supylabel(what)
    handles = [line("the searcher named above", color=_OWN, lw=scaled(1.8))]
    if is_banded:
        handles.append(line("its 95 % band", color=_OWN, lw=scaled(7), alpha=0.25))
    if BASELINE in names:
        handles.append(line(BASELINE, color=_BASE, lw=scaled(1.3), ls="--"))
    if len(names) > 1:
        handles.append(line("the others", color=style.GREY, lw=scaled(0.9)))
    style.legend(made, title, handles)
    return made


def _own(axis: Axes, curve: pd.DataFrame, column: str, *, end: float, is_banded: bool) -> None:
    """Draw a panel's own curve, dotted from where half of its runs have ended."""
    at, values = curve["unique"].to_numpy(float), curve[column].to_numpy(float)
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


def fixed_budget(table: pd.DataFrame, *, title: str) -> Figure:
    """Draw `tables.fixed_budget` in all terms: a row per searcher, a panel per budget."""
    names = list(dict.fromkeys(table["searcher"]))
    budgets = sorted(set(table["budget"]))
    made = style.figure(1.4 + 1.5 * max(len(budgets), 3), scaled(1.5 + 0.32 * len(names)))
    axes = made.subplots(1, len(budgets), sharex=True, sharey=True, squeeze=False)[0]
    styles = {"raw": ("o", _OWN, _OWN, -0.14), "class": ("D", "white", _BASE, 0.14)}
    styles = {terms: styles[terms] for terms in dict.fromkeys(table["terms"])}
    for axis, budget in zip(axes, budgets, strict=True):
        for terms, (marker, face, edge, shift) in styles.items():
            here = table[(table["terms"] == terms) & (table["budget"] == budget)]
            rows = np.array([names.index(name) for name in here["searcher"]]) + shift
            axis.hlines(rows, here["low"], here["high"], color=edge, lw=scaled(1.2))
            look: dict[str, Any] = {"mfc": face, "mec": edge, "ms": scaled(4.5), "ls": "none"}
            axis.plot(here["iqm"], rows, marker, **look)
        axis.set_title(f"{budget}")
        axis.set_xlim(-0.06 * _top(table), 1.06 * _top(table))  # room for half a marker
    axes[0].set_yticks(range(len(names)), names)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    made.supxlabel(f"{_measure(table)} after so many unique evaluations, voxel widths (IQM)")
    handles = [
        line(f"{terms} terms", marker=marker, mfc=face, mec=edge, color=edge, lw=scaled(1.2))
        for terms, (marker, face, edge, _) in styles.items()
    ]
    style.legend(made, title, handles)
    return made


def noise(by_searcher: pd.DataFrame, by_policy: pd.DataFrame, measure: str, at: str) -> Figure:
    """Draw one of `MEASURES` by level and policy, over all searchers and for each."""
    names = list(dict.fromkeys(by_searcher["searcher"]))
    levels = sorted(set(by_searcher["level"]))
    apart = float(np.min(np.diff(levels), initial=1))
    policies = list(dict.fromkeys(by_searcher["policy"]))
    panels = [(name, by_searcher[by_searcher["searcher"] == name], "normal") for name in names]
    if len(names) > 1:
        panels.insert(0, ("all together", by_policy, "bold"))
    made, axes = style.grid(len(panels), height=2.3 / 2.1)
    for axis, (name, here, weight) in zip(axes, panels, strict=True):
        for i, policy in enumerate(policies):
            chosen = here[here["policy"] == policy]
            # Policies of a level are closer together than levels are.
            shift = (i - (len(policies) - 1) / 2) * 0.4 * apart / len(policies)
            places = chosen["level"].to_numpy() + shift
            low, high = chosen[f"{measure}_low"], chosen[f"{measure}_high"]
            axis.vlines(places, low, high, color=_look(i)["color"], lw=scaled(1.4))
            axis.plot(places, chosen[measure], **_look(i))
        axis.set_title(name, fontweight=weight)
        axis.axhline(0, color=style.INK, lw=scaled(0.8))
    axes[0].set_xticks(levels, [f"{level:g}" for level in levels])
    axes[0].set_xlim(levels[0] - 0.4 * apart, levels[-1] + 0.4 * apart)
    made.supxlabel("level of noise")
    title, label = _NOISE[measure]
    made.supylabel(label)
    handles = [line(policy or "no policy", **_look(i)) for i, policy in enumerate(policies)]
    style.legend(made, f"{title}{at}", handles)
    return made


def _dots(i: int) -> dict[str, Any]:
    return _look(i) | {"ls": "none"}


def _look(i: int) -> dict[str, Any]:
    kinds = {"color": style.COLOURS, "marker": style.MARKERS, "ls": style.LINES}
    return {
        **{name: kind[i % len(kind)] for name, kind in kinds.items()},
        "lw": scaled(1.0),
        "ms": scaled(4.5),
        "mec": style.INK,
        "mew": scaled(0.5),
    }
