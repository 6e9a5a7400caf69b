"""What the searchers recommend under noise: its true value, and the value they believe it has."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from softvox_gym import Lattice
from softvox_gym.noise import AMOUNTS, Jakobi
from softvox_search.experiment.schema import NOISE
from softvox_search.report.curves import AXES, PROBLEM, groups
from softvox_search.report.statistics import band, compare, holm, iqm, mean
from softvox_search.report.truth import truth_at

#: The policy that others are compared with; if the experiment lacks it, its first.
NAIVE = "naive"

MEASURES = ("true_regret", "optimism")


def recommendations(runs: pd.DataFrame, problems: Iterable[Any]) -> pd.DataFrame:
    """Return the recommendation of every run compared with the truth of its problem.

    One row per run: physics, shape, level, policy, searcher, run, recommended; believed, the
    searcher's own estimate of the design's fitness; true_value, its mean fitness at that level;
    true_regret, the largest true value of all designs minus this one's; optimism, believed minus
    true_value. All in voxel widths; empty where the truth was not measured.

    The runs are those of `curves.finished`.
    """
    parts = []
    for key, group in groups(runs, *PROBLEM):
        truth, _ = truth_of(dict(zip(PROBLEM, key, strict=True)), problems)
        part = group[[*AXES, "run", "recommended", "believed"]].assign(true_value=np.nan)
        if truth is not None:
            part["true_value"] = truth[group["recommended"].to_numpy(np.int64)]
        optimum = np.nan if truth is None else np.nanmax(truth)
        part["true_regret"] = optimum - part["true_value"]
        part["optimism"] = part["believed"] - part["true_value"]
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def truth_of(problem: Mapping[str, Any], problems: Iterable[Any]) -> tuple[Any, str]:
    """Return the true values of designs in a problem, a row of a table; see `truth.truth_at`."""
    known = next(one for one in problems if one.physics == problem["physics"])
    for wrapper in known.wrappers if problem["level"] > 0 else ():
        amounts = {name: value for name, value in wrapper.items() if name in AMOUNTS}
        if wrapper["name"] == NOISE and Jakobi(**amounts) != Jakobi():
            return None, "no true values (noise was measured with its usual amounts)"
    return truth_at(problem["level"], known.values, Lattice.named(problem["shape"]))


def reference_policy(policies: Iterable[str]) -> str:
    """Return the policy that others are compared with: the naive one, or the first."""
    known = list(policies)
    return NAIVE if NAIVE in known else known[0]


def by_searcher(frame: pd.DataFrame) -> pd.DataFrame:
    """Return true regret and optimism for every problem, policy and searcher, voxel widths.

    One row each: runs; known, how many recommended a design with a true value (the others are left
    out of all that follows); the interquartile mean over runs of the true regret and the mean of
    the optimism, a bias, each with its bootstrap band; and the mean true regret, which shows the
    few bad runs.
    """
    return pd.DataFrame(
        {**dict(zip(AXES, key, strict=True)), **_summary(group)}
        for key, group in groups(frame, *AXES)
    )


def by_policy(frame: pd.DataFrame) -> pd.DataFrame:
    """Return true regret and optimism for every problem and policy, over all searchers.

    Columns as in `by_searcher`; searchers are the strata of the bootstrap. Each policy is also
    compared with the naive one on its problem: p (Mann and Whitney, two-sided); p_holm, adjusted
    for all policies of that problem; and a12, the probability that a run under this policy has the
    larger true regret (or optimism) than one under the naive policy: below 0.5 the policy helps.
    """
    naive = reference_policy(frame["policy"])
    parts = []
    for key, here in groups(frame, *PROBLEM):
        against = here[here["policy"] == naive]
        rows = [
            {
                **dict(zip(PROBLEM, key, strict=True)),
                "policy": policy,
                **_summary(group),
                **_against(group, against[:0] if policy == naive else against),
            }
            for (policy,), group in groups(here, "policy")
        ]
        table = pd.DataFrame(rows)
        for measure in MEASURES:
            p = table[f"{measure}_p"].dropna()
            table[f"{measure}_p_holm"] = pd.Series(holm(p), index=p.index)
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def _summary(group: pd.DataFrame) -> dict[str, Any]:
    known = group[group["true_value"].notna()]
    row: dict[str, Any] = {"runs": len(group), "known": len(known)}
    for measure, statistic in zip(MEASURES, (iqm, mean), strict=True):
        found: Any = np.full(3, np.nan)
        if len(known):
            values, strata = known[measure].to_numpy(), known["searcher"].to_numpy(str)
            found = statistic(values), *band(values, statistic=statistic, strata=strata)
        for end, value in zip(("", "_low", "_high"), found, strict=True):
            row[f"{measure}{end}"] = float(value)
    row["true_regret_mean"] = float(group["true_regret"].mean())
    return row


def _against(group: pd.DataFrame, naive: pd.DataFrame) -> dict[str, float]:
    row: dict[str, float] = {}
    for measure in MEASURES:
        ours, theirs = group[measure].dropna(), naive[measure].dropna()
        found = compare(ours, theirs) if len(ours) and len(theirs) else None
        row[f"{measure}_p"] = found.p if found else np.nan
        row[f"{measure}_a12"] = found.a12 if found else np.nan
    return row
