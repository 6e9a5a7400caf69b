"""The report of an experiment: statistics, tables and figures from its runs.

Light to import, as every worker does: pandas, scipy and matplotlib load with `write`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

__all__ = ["write"]


def write(folder: Path, results: Results) -> list[str]:
    """Write the report of an experiment: report.md, and the folders tables and figures beside it.

    The same results give the same bytes. Each file appears whole; one that exists is replaced.

    Returns
    -------
    list of str
        The files written, relative to the folder, report.md last.

    Raises
    ------
    softvox_gym.files.OutputError
        Where a file can't be written.
    """
    from softvox_search.report.page import write_report

    return write_report(folder, results)
