"""The report on transfer methods: tables and page from their runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from softvox_gym.realities import SETS
from softvox_search.report import text
from softvox_search.report.curves import groups, records
from softvox_search.report.statistics import RESAMPLES, band, holm, mean
from softvox_search.report.text import escaped

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

Array = NDArray[np.float64]
Tables = Mapping[str, pd.DataFrame]

#: As many tests the page tells of, where there are so many.
AFTER = (1, 9, 10, 20, 50)

#: A design is found where no more than this share is lost.
FOUND = 0.1

#: What methods are held against.
REFERENCES = ("random", "gp_ucb", "simulator_top")

FORESIGHT = (
    *("srcc_before", "srcc_after", "kendall_before", "kendall_after"),
    *("heading_error_before", "heading_error", "distance", "is_specified", "simulations"),
)

TERMS = f"""\
- *Regret*: what is lost in reality by building the design that the method recommends, as a share
  of what the best design is worth there; 0 is the best, and above 1 the robot goes the wrong way.
  Of the directed task it is the mean over four headings. *In class terms* a robot may be turned or
  mirrored before it is let go.
- *Bands*, in brackets and shaded: 95 % by the bootstrap over seeds ({RESAMPLES} resamples). Of a
  set of sampled realities: over the realities, each the mean of its seeds.
- *Tests needed*: after so many the mean regret is {FOUND:g} or less; empty where that is never so.
- *Against*: the mean difference in regret to another method over the realities of a set, and the p
  of Wilcoxon's two-sided signed-rank test of the pairs, adjusted by Holm for all in its column.
  Negative: the method loses less.
- *Foresight*: Pearson's correlation of the reward expected and the real one over the best hundred
  expected (SRCC), Kendall's correlation over all designs, and the mean angle between the heading
  expected and the real one in degrees; of the nominal simulator, and of the method in the end.
  *Distance*: of the truth to the nearest model that the method holds, root mean square over all
  designs as a share of the displacement itself. *Specified*: the share of realities in which its
  models vary all that differs from the simulator.
"""


def make(results: Results) -> dict[str, pd.DataFrame]:
    """Return the tables of a report by name."""
    runs = results.runs[results.runs["status"] == "ok"].copy()
    if not len(runs):
        return {"runs": _overview(results.runs)}
    runs["group"] = [group_of(name) for name in runs["reality"]]
    runs["curve"] = pd.Series([_curve(results, run) for run in runs["run"]], index=runs.index)
    regret = _regret(runs)
    tables = {
        "runs": _overview(results.runs),
        "regret": regret,
        "tests_needed": _tests_needed(regret),
        "foresight": _foresight(runs),
    }
    against = _against(runs)
    return {**tables, "against": against} if len(against) else tables


def group_of(reality: str) -> str:
    """Return the set that a sampled reality is of; a named one is for itself."""
    name, _, number = reality.rpartition("-")
    return name if name in SETS and number.isdecimal() else reality


def _curve(results: Results, run: str) -> Array:
    """Return regret and class regret, means over headings, shape (2, tests)."""
    log = results.evaluations(run)
    headings = int((log["test"] == 1).sum())
    both = np.stack([log["regret"], log["class_regret"]])
    return np.asarray(both.reshape(2, headings, -1).mean(axis=1))


def _overview(runs: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for (method,), own in groups(runs, "method"):
        ok = own[own["status"] == "ok"]
        rows.append(
            {
                "method": method,
                "runs": len(ok),
                "failed": len(own) - len(ok),
                "realities": own["reality"].nunique(),
                "seeds": own["seed"].nunique(),
                "tests": ok["tests"].max(),
                "simulations": ok["simulations"].median(),
            }
        )
    return pd.DataFrame(rows)


def _units(own: pd.DataFrame) -> Array:
    """Return curves, shape (n, 2, tests): of a reality by seed, of a set by reality.

    Where realities of a set have different numbers of tests, up to the least of these.
    """
    tests = min(curve.shape[1] for curve in own["curve"])
    units = "seed" if own["reality"].nunique() == 1 else "reality"
    return np.stack(
        [
            np.mean([curve[:, :tests] for curve in one["curve"]], axis=0)
            for _, one in groups(own, units)
        ]
    )


def _regret(runs: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for (task, group, method), own in groups(runs, "task", "group", "method"):
        units = _units(own)
        low, high = band(units[:, 0], statistic=mean)
        for i, (raw, of_class) in enumerate(units.mean(axis=0).T):
            rows.append(
                {
                    "task": task,
                    "reality": group,
                    "method": method,
                    "tests": i + 1,
                    "runs": len(own),
                    "regret": raw,
                    "low": low[i],
                    "high": high[i],
                    "class_regret": of_class,
                }
            )
    return pd.DataFrame(rows)


def _tests_needed(regret: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for (task, group, method), own in groups(regret, "task", "reality", "method"):
        row = {"task": task, "reality": group, "method": method}
        for name in ("regret", "class_regret"):
            reached = own["tests"][own[name] <= FOUND]
            row[name] = reached.min() if len(reached) else np.nan
        rows.append(row)
    return pd.DataFrame(rows)


def _foresight(runs: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for (task, group, method), own in groups(runs, "task", "group", "method"):
        means = {name: own[name].astype(float).mean() for name in FORESIGHT}
        rows.append({"task": task, "reality": group, "method": method, **means})
    return pd.DataFrame(rows)


def _against(runs: pd.DataFrame) -> pd.DataFrame:
    """Hold every method against the references, reality by reality of every set."""
    rows = []
    for (task, group), own in groups(runs[runs["group"].isin(SETS)], "task", "group"):
        curves = {
            method: {
                name: np.mean(r["curve"].to_list(), axis=0)[0]
                for (name,), r in groups(of, "reality")
            }
            for (method,), of in groups(own, "method")
        }
        for method, its in curves.items():
            for reference in REFERENCES:
                shared = sorted(its.keys() & curves.get(reference, {}).keys())
                if reference == method or len(shared) < 2:
                    continue
                for tests in AFTER:
                    pairs = [(its[name], curves[reference][name]) for name in shared]
                    if any(tests > min(map(len, pair)) for pair in pairs):
                        continue
                    off = np.array([a[tests - 1] - b[tests - 1] for a, b in pairs])
                    p = 1.0 if not off.any() else float(stats.wilcoxon(off).pvalue)
                    rows.append(
                        {
                            "task": task,
                            "reality": group,
                            "method": method,
                            "against": reference,
                            "tests": tests,
                            "realities": len(shared),
                            "difference": off.mean(),
                            "p": p,
                        }
                    )
    table = pd.DataFrame(rows)
    if len(table):
        table["p_holm"] = np.nan
        for _, family in groups(table, "task", "reality", "against", "tests"):
            table.loc[family.index, "p_holm"] = holm(family["p"].to_numpy())
    return table


def page(results: Results, made: Tables, pictures: list[str]) -> str:
    """Return the page, in Markdown, of the tables by name and the pictures by file name."""
    failed = int((results.runs["status"] == "failed").sum())
    said = f"{len(results.runs) - failed} finished runs. "
    said += f"**{failed} failed and left out.**" if failed else "No run failed."
    blocks = [f"# {escaped(results.title)}", text.fenced(results.command), said, "## Runs"]
    blocks.append(_shown(made["runs"], {"method": escaped}))
    if "regret" not in made:
        return "\n\n".join(block.strip("\n") for block in blocks) + "\n"
    blocks += ["## Terms", TERMS]
    for (task,), regret in groups(made["regret"], "task"):
        blocks.append(f"## {str(task).capitalize()}")
        blocks += [f"![regret](figures/{name})" for name in pictures if name == f"{task}.png"]
        last = regret.groupby("method")["tests"].max()
        for tests in sorted({*AFTER, *last} & {*regret["tests"]}):
            blocks += [f"### Regret after {tests} {'test' if tests == 1 else 'tests'}"]
            blocks.append(_by_reality(regret[regret["tests"] == tests], _with_band))
        needed = made["tests_needed"]
        blocks += ["### Tests needed", _by_reality(needed[needed["task"] == task], _needed)]
        if "against" in made:
            own = made["against"]
            for (group, reference), rows in groups(own[own["task"] == task], "reality", "against"):
                blocks += [f"### Against {escaped(reference)}, {escaped(group)}", _held(rows)]
        own = made["foresight"]
        for (group,), rows in groups(own[own["task"] == task], "reality"):
            if group in SETS or len(set(own["reality"])) < 3:
                blocks += [f"### Foresight, {escaped(group)}", _foreseen(rows)]
    return "\n\n".join(block.strip("\n") for block in blocks) + "\n"


def _shown(table: pd.DataFrame, texts: Mapping[str, Any]) -> str:
    return text.markdown(
        {
            name: texts.get(name, lambda value: text.number(value, 0))(value)
            for name, value in row.items()
        }
        for row in records(table)
    )


def _by_reality(table: pd.DataFrame, cell: Any) -> str:
    """Return a table with a line per method and a column per reality."""
    names = list(dict.fromkeys(table["reality"]))
    return text.markdown(
        {
            "method": escaped(method),
            **{escaped(name): "" for name in names},
            **{escaped(row["reality"]): cell(row) for row in records(own)},
        }
        for (method,), own in groups(table, "method")
    )


def _with_band(row: Mapping[str, Any]) -> str:
    return text.with_band(row["regret"], row["low"], row["high"])


def _needed(row: Mapping[str, Any]) -> str:
    return text.number(row["regret"], 0)


def _held(table: pd.DataFrame) -> str:
    cells = dict.fromkeys(f"after {tests}" for tests in sorted(set(table["tests"])))
    return text.markdown(
        {
            "method": escaped(method),
            **dict.fromkeys(cells, ""),
            **{
                f"after {row['tests']}": (
                    f"{row['difference']:+.2f} (p {text.probability(row['p_holm'])})"
                )
                for row in records(own)
            },
        }
        for (method,), own in groups(table, "method")
    )


def _foreseen(table: pd.DataFrame) -> str:
    return text.markdown(
        {
            "method": escaped(row["method"]),
            "SRCC before": text.number(row["srcc_before"]),
            "after": text.number(row["srcc_after"]),
            "Kendall before": text.number(row["kendall_before"]),
            "after ": text.number(row["kendall_after"]),
            "heading off before": text.number(row["heading_error_before"], 0),
            "after  ": text.number(row["heading_error"], 0),
            "distance": text.number(row["distance"]),
            "specified": text.percent(row["is_specified"]),
        }
        for row in records(table)
    )
