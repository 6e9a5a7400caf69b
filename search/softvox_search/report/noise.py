"""What the searchers recommend under noise: what it is worth, and what they believe it is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_search.report.curves import PROBLEM, groups
from softvox_search.report.statistics import band, compare, fixed_generator, holm, iqm, mean
from softvox_search.report.truth import Truth, truth_at

#: The policy that others are held against, where the experiment has it; else its first.
NAIVE = "naive"

MEASURES = ("true_regret", "optimism")


def recommendations(runs: pd.DataFrame, problems: Iterable[Any]) -> tuple[pd.DataFrame, list[str]]:
    """Return the recommendation of every run held against the truth of its problem.

    Parameters
    ----------
    runs : DataFrame
        Finished runs, as `curves.finished` returns them.
    problems : iterable of Problem
        Of which the labels and the values of the physics are used.

    Returns
    -------
    frame : DataFrame
        One row per run: physics, shape, level, policy, searcher, run, recommended; believed, what
        the searcher believes the design to be worth; true_value, its mean fitness at that level;
        true_regret, how far that is below the largest true value of all designs; optimism,
        believed less true_value. All in voxel widths; empty where the truth was not measured.
    notes : list of str
        A line for each problem: which design is best there, or that nothing is known.
    """
    values = {problem.physics: problem.values for problem in problems}
    columns = [*PROBLEM, "policy", "searcher", "run", "recommended", "believed"]
    parts, notes = [], []
    for (physics, shape, level), group in groups(runs, *PROBLEM):
        truth = truth_at(level, values[physics], [int(side) for side in shape.split("x")])
        where = [] if runs["physics"].nunique() == 1 else [f"physics {physics}"]
        where += [] if runs["shape"].nunique() == 1 else [f"lattice {shape}"]
        notes.append(_note(", ".join([*where, f"level {level:g}"]), truth))
        value = np.full(len(group), np.nan)
        if len(truth.value):
            value = truth.value[group["recommended"].to_numpy(np.int64)]
        parts.append(
            group[columns].assign(
                true_value=value,
                true_regret=truth.optimum - value,
                optimism=group["believed"] - value,
            )
        )
    return pd.concat(parts, ignore_index=True), notes


def _note(where: str, truth: Truth) -> str:
    where = where[0].upper() + where[1:]
    if truth.note:
        return f"{where}: no true values ({truth.note})."
    exactly = f" ± {truth.error:.4f} (standard error)" if truth.error else " (exact)"
    return f"{where}: the best is design {truth.best}, {truth.optimum:.4f}{exactly}."


def reference_policy(policies: Iterable[str]) -> str:
    """Return the policy that others are held against: the naive one, or the first."""
    known = list(policies)
    return NAIVE if NAIVE in known else known[0]


def by_searcher(frame: pd.DataFrame) -> pd.DataFrame:
    """Return true regret and optimism for every problem, policy and searcher.

    One row each: runs; known, those whose recommended design has a true value (the others are left
    out of what follows); then for each measure the interquartile mean over runs (true regret) or
    the mean (optimism: a bias) with low and high, its bootstrap band; and the mean true regret, to
    which the few bad runs contribute. In voxel widths.
    """
    axes = (*PROBLEM, "policy", "searcher")
    return pd.DataFrame(
        {**dict(zip(axes, key, strict=True)), **_summary(group)}
        for key, group in groups(frame, *axes)
    )


def by_policy(frame: pd.DataFrame) -> pd.DataFrame:
    """Return true regret and optimism for every problem and policy, over all searchers.

    As `by_searcher`, with the searchers as strata of the bootstrap; and each policy compared with
    the naive one on its problem: p (Mann and Whitney, two-sided), p_holm, adjusted for all policies
    of that problem, and a12, the chance that a run under this policy has the larger true regret (or
    optimism) than one under the naive policy: below 0.5 the policy helps.
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
                **({} if policy == naive else _against(group, against)),
            }
            for (policy,), group in groups(here, "policy")
        ]
        parts.append(_adjusted(pd.DataFrame(rows)))
    return pd.concat(parts, ignore_index=True)


def _summary(group: pd.DataFrame) -> dict[str, Any]:
    row: dict[str, Any] = {"runs": len(group), "known": int(group["true_value"].notna().sum())}
    for measure, statistic in zip(MEASURES, (iqm, mean), strict=True):
        known = group[group[measure].notna()]
        values = known[measure].to_numpy()
        centre, low, high = np.full(3, np.nan)
        if len(values):
            centre = statistic(values)
            strata = known["searcher"].to_numpy(str)
            low, high = band(values, rng=fixed_generator(), statistic=statistic, strata=strata)
        for name, value in (("", centre), ("_low", low), ("_high", high)):
            row[f"{measure}{name}"] = float(value)
    row["true_regret_mean"] = float(group["true_regret"].mean())
    return row


def _against(group: pd.DataFrame, naive: pd.DataFrame) -> dict[str, float]:
    row: dict[str, float] = {}
    for measure in MEASURES:
        ours, theirs = _known(group[measure]), _known(naive[measure])
        if len(ours) and len(theirs):
            found = compare(ours, theirs)
            row |= {f"{measure}_p": found.p, f"{measure}_a12": found.a12}
    return row


def _known(values: pd.Series[float]) -> NDArray[np.float64]:
    return np.asarray(values.dropna(), dtype=np.float64)


def _adjusted(frame: pd.DataFrame) -> pd.DataFrame:
    """Add p_holm for each measure, over the policies of a problem."""
    for measure in MEASURES:
        for name in (f"{measure}_p", f"{measure}_a12"):
            if name not in frame:
                frame[name] = np.nan
        p = frame[f"{measure}_p"].to_numpy(np.float64)
        adjusted = np.full(len(p), np.nan)
        adjusted[~np.isnan(p)] = holm(p[~np.isnan(p)])
        frame[f"{measure}_p_holm"] = adjusted
    return frame
