"""What the report is made of, read from a folder of results."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from softvox_search.experiment.config import Experiment
from softvox_search.experiment.folder import IMPROVEMENTS, RUNS

if TYPE_CHECKING:
    from softvox_search.oracle import Budget

_TEXT = ("searcher", "policy", "status", "digest", "terms")


def write_report(folder: Path, experiment: Experiment, command: str) -> list[str]:
    """Write the report on the results in a folder, from its tables; return what was written.

    Raises
    ------
    OutputError, OSError
        Where it can't be written.
    """
    from softvox_search import report
    from softvox_search.report.results import Results

    return report.write(
        folder,
        Results(
            title=experiment.name,
            command=command,
            budget=budgets(experiment),
            runs=_table(folder / RUNS),
            improvements=_table(folder / IMPROVEMENTS),
        ),
    )


def budgets(experiment: Experiment) -> dict[str, Any]:
    """Return the budget of every run, and what differs for some searchers."""
    common = vars(experiment.budget)
    own = {
        searcher.label: different
        for searcher in experiment.searchers
        if (different := _different(searcher.budget, common))
    }
    return {**common, **({"searchers": own} if own else {})}


def _different(budget: Budget, common: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in vars(budget).items() if value != common[name]}


def _table(path: Path) -> Any:
    """Return a table as a data frame; only numbers can be missing, a text may be empty or "nan"."""
    import pandas as pd

    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    for name in table.columns.difference(list(_TEXT)):
        texts = table[name].tolist()
        # Python reads every number to the bits that were written.
        is_whole = all(text.isdecimal() for text in texts)
        table[name] = [int(text) if is_whole else float(text or "nan") for text in texts]
    return table
