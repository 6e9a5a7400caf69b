"""The report on transfer methods: tables and page from their runs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
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

#: Numbers of tests after which the page shows the regret, as far as runs have so many.
AFTER = (1, 9, 10, 20, 50)

#: A design counts as found if its regret is at most this.
FOUND = 0.1

#: The methods with which others are compared.
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
    """Return the set of a sampled reality; a named reality is its own."""
    name, _, number = reality.rpartition("-")
    return name if name in SETS and number.isdecimal() else reality


def _curve(results: Results, run: str) -> Array:
    """Return regret and class regret, means over headings, shape (2, tests)."""
    log = results.evaluations(run)
    headings = int((log["test"] == 1).sum())
    both = np.stack([log["regret"], log["class_regret"]])
    return np.asarray(both.reshape(2, headings, -1).mean(axis=1))


def _overview(runs: pd.DataFrame) -> pd.DataFrame:
    ok = runs["status"] == "ok"
    used = {name: runs[name].where(ok) for name in ("tests", "simulations")}
    grouped = runs.assign(ok=ok, failed=~ok, **used).groupby("method", sort=False)
    table: pd.DataFrame = grouped.agg(
        runs=("ok", "sum"),
        failed=("failed", "sum"),
        realities=("reality", "nunique"),
        seeds=("seed", "nunique"),
        tests=("tests", "max"),
        simulations=("simulations", "median"),
    )
    return table.reset_index()


def _units(own: pd.DataFrame) -> Array:
    """Return curves, shape (n, 2, tests): of a single reality by seed, of a set by reality.

    If realities of a set have different numbers of tests, the curves end at the least of these.
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
    parts = []
    for (task, group, method), own in groups(runs, "task", "group", "method"):
        units = _units(own)
        low, high = band(units[:, 0], statistic=mean)
        regret, of_class = units.mean(axis=0)
        names = {"task": task, "reality": group, "method": method}
        counts = {"tests": np.arange(1, 1 + len(regret)), "runs": len(own)}
        means = {"regret": regret, "low": low, "high": high, "class_regret": of_class}
        parts.append(pd.DataFrame({**names, **counts, **means}))
    return pd.concat(parts, ignore_index=True)


def _tests_needed(regret: pd.DataFrame) -> pd.DataFrame:
    names = ["regret", "class_regret"]
    reached = {name: regret["tests"].where(regret[name] <= FOUND) for name in names}
    cells = regret.assign(**reached).groupby(["task", "reality", "method"], sort=False)
    table: pd.DataFrame = cells[names].min().reset_index()
    return table


def _foresight(runs: pd.DataFrame) -> pd.DataFrame:
    cells = runs.astype(dict.fromkeys(FORESIGHT, float)).groupby(
        ["task", "group", "method"], sort=False
    )
    table: pd.DataFrame = cells[list(FORESIGHT)].mean().reset_index()
    return table.rename(columns={"group": "reality"})


def _against(runs: pd.DataFrame) -> pd.DataFrame:
    """Compare every method with the references, reality by reality of every set."""
    rows = []
    for (task, group), own in groups(runs[runs["group"].isin(SETS)], "task", "group"):
        curves = {
            method: {
                name: np.mean(r["curve"].to_list(), axis=0)[0]
                for (name,), r in groups(of, "reality")
            }
            for (method,), of in groups(own, "method")
        }
        for method, reference, tests in product(curves, REFERENCES, AFTER):
            its, theirs = curves[method], curves.get(reference, {})
            shared = sorted(its.keys() & theirs.keys())
            pairs = [(its[name], theirs[name]) for name in shared]
            if (
                reference == method
                or len(pairs) < 2
                or tests > min(len(one) for pair in pairs for one in pair)
            ):
                continue
            off = np.array([a[tests - 1] - b[tests - 1] for a, b in pairs])
            names = {"task": task, "reality": group, "method": method, "against": reference}
            p = 1.0 if not off.any() else float(stats.wilcoxon(off).pvalue)
            found = {"realities": len(pairs), "difference": off.mean(), "p": p}
            rows.append({**names, "tests": tests, **found})
    table = pd.DataFrame(rows)
    if rows:
        families = table.groupby(["task", "reality", "against", "tests"])
        table["p_holm"] = families["p"].transform(holm)
    return table


def page(results: Results, made: Tables, pictures: list[str]) -> str:
    """Return the page, in Markdown, from the tables by name and the pictures by file name."""
    failed = int((results.runs["status"] == "failed").sum())
    said = f"{len(results.runs) - failed} finished runs. "
    said += f"**{failed} failed and left out.**" if failed else "No run failed."
    blocks = [f"# {escaped(results.title)}", text.fenced(results.command), said, "## Runs"]
    blocks.append(_used(made["runs"]))
    blocks += ["## Terms", TERMS] if "regret" in made else []
    for (task,), regret in groups(made["regret"], "task") if "regret" in made else ():
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


def _used(table: pd.DataFrame) -> str:
    return text.markdown(
        {"method": escaped(row.pop("method")), **{n: text.number(v, 0) for n, v in row.items()}}
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
    columns = dict.fromkeys((f"after {tests}" for tests in sorted(set(table["tests"]))), "")
    return text.markdown(
        {
            "method": escaped(method),
            **columns,
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
