"""What the searchers recommend under noise: what it is worth, and what they believe it is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from softvox_search.report.cells import Cell
from softvox_search.report.frames import groups
from softvox_search.report.statistics import band, compare, fixed_generator, holm, iqm, mean
from softvox_search.report.truth import Truth, truth_at

#: The policy that others are held against, where the experiment has it; else its first.
NAIVE = "naive"

MEASURES = ("true_regret", "optimism")


def recommendations(cells: list[Cell]) -> tuple[pd.DataFrame, list[str]]:
    """Return the recommendation of every run held against the truth at its level of noise.

    Returns
    -------
    frame : DataFrame
        One row per run: level, policy, searcher, run, recommended; believed, what the searcher
        believes the design to be worth; true_value, its mean fitness at that level; true_regret,
        how far that is below the largest true value of all designs; optimism, believed less
        true_value. All in voxel widths; empty where the truth was not measured.
    notes : list of str
        A line for each level: which design is best there, or that nothing is known.
    """
    parts, notes = [], {}
    for cell in cells:
        truth = truth_at(cell.level)
        notes[cell.level] = _note(cell.level, truth)
        value = truth.value[cell.recommended]
        parts.append(
            pd.DataFrame(
                {
                    "level": cell.level,
                    "policy": cell.policy,
                    "searcher": cell.searcher,
                    "run": cell.run,
                    "recommended": cell.recommended,
                    "believed": cell.believed,
                    "true_value": value,
                    "true_regret": truth.optimum - value,
                    "optimism": cell.believed - value,
                }
            )
        )
    return pd.concat(parts, ignore_index=True), list(notes.values())


def _note(level: float, truth: Truth) -> str:
    if truth.note:
        return f"Level {level:g}: no true values ({truth.note})."
    exactly = f" ± {truth.error:.4f} (standard error)" if truth.error else " (exact)"
    return f"Level {level:g}: the best is design {truth.best}, {truth.optimum:.4f}{exactly}."


def reference_policy(policies: Iterable[str]) -> str:
    """Return the policy that others are held against: the naive one, or the first."""
    known = list(policies)
    return NAIVE if NAIVE in known else known[0]


def by_searcher(frame: pd.DataFrame) -> pd.DataFrame:
    """Return true regret and optimism for every level, policy and searcher.

    One row each: runs; known, those whose recommended design has a true value (the others are left
    out of what follows); then for each measure the interquartile mean over runs (true regret) or
    the mean (optimism: a bias) with low and high, its bootstrap band; and the mean true regret, to
    which the few bad runs contribute. In voxel widths.
    """
    rows = []
    for (level, policy, searcher), group in groups(frame, "level", "policy", "searcher"):
        names = {"level": level, "policy": policy, "searcher": searcher}
        rows.append({**names, **_summary(group)})
    return pd.DataFrame(rows)


def by_policy(frame: pd.DataFrame) -> pd.DataFrame:
    """Return true regret and optimism for every level and policy, over all searchers.

    As `by_searcher`, with the searchers as strata of the bootstrap; and each policy compared with
    the naive one at its level: p (Mann and Whitney, two-sided), p_holm, adjusted for all policies
    of that level, and a12, the chance that a run under this policy has the larger true regret (or
    optimism) than one under the naive policy: below 0.5 the policy helps.
    """
    naive = reference_policy(frame["policy"])
    parts = []
    for (level,), here in groups(frame, "level"):
        rows = []
        for (policy,), group in groups(here, "policy"):
            against = here[here["policy"] == naive]
            rows.append(
                {
                    "level": level,
                    "policy": policy,
                    **_summary(group),
                    **({} if policy == naive else _against(group, against)),
                }
            )
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
    """Add p_holm for each measure, over the policies of a level."""
    for measure in MEASURES:
        for name in (f"{measure}_p", f"{measure}_a12"):
            if name not in frame:
                frame[name] = np.nan
        p = frame[f"{measure}_p"].to_numpy(np.float64)
        adjusted = np.full(len(p), np.nan)
        adjusted[~np.isnan(p)] = holm(p[~np.isnan(p)])
        frame[f"{measure}_p_holm"] = adjusted
    return frame
