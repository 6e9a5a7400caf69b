"""What a report is made of: the runs of an experiment, and when each came upon something better."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

RUN_COLUMNS = (
    "run",
    "searcher",
    "level",
    "policy",
    "seed",
    "status",
    "unique",
    "evaluations",
    "steps",
    "recommended",
    "believed",
    "digest",
)

IMPROVEMENT_COLUMNS = ("run", "terms", "sequence", "unique_sequence", "design", "fitness")


@dataclass(frozen=True, eq=False)
class Results:
    """The results of an experiment.

    Parameters
    ----------
    title : str
    command : str
        What to type to make these results again.
    budget : dict
        The budget of every run: "unique", "evaluations", "steps", each a number or None or left
        out; and where some searchers have budgets of their own, "searchers": {label: such a dict}
        with what differs.
    runs : DataFrame
        One row per run.

        =========== ======================================================================
        run         its number
        searcher    label of the searcher
        level       of the noise; NaN where the experiment has no such axis
        policy      against luck; "" where there is none
        seed        index of the seed
        status      "ok" or "failed"
        unique      evaluations used that no cache answered; under noise each is one
        evaluations evaluations used
        steps       simulated time steps
        recommended number of the design that the searcher recommends in the end
        believed    what the searcher believes that design to be worth, voxel widths
        digest      of the run's log
        =========== ======================================================================
    improvements : DataFrame
        One row whenever the best value of a run so far improved: run, terms ("raw" or "class"),
        sequence, unique_sequence, design, fitness (voxel widths); see
        `softvox_search.report.improvements`.

    Raises
    ------
    ValueError
        Where a column is missing, or a run has a status other than "ok" and "failed".
    """

    title: str
    command: str
    budget: dict[str, Any]
    runs: pd.DataFrame
    improvements: pd.DataFrame

    def __post_init__(self) -> None:
        for name, frame, expected in (
            ("runs", self.runs, RUN_COLUMNS),
            ("improvements", self.improvements, IMPROVEMENT_COLUMNS),
        ):
            missing = [column for column in expected if column not in frame.columns]
            if missing:
                raise ValueError(
                    f"{name} lacks the columns {', '.join(missing)}; it must have "
                    f"{', '.join(expected)}"
                )
        unknown = sorted(set(self.runs["status"]) - {"ok", "failed"})
        if unknown:
            raise ValueError(f"a run's status must be 'ok' or 'failed', got {unknown[0]!r}")
