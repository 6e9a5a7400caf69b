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
    Returns the files written, relative to the folder, report.md last.

    Raises
    ------
    softvox_gym.files.OutputError
        Where a file can't be written.
    """
    from softvox_gym.files import write_file, write_folder
    from softvox_search.report import figures, style, tables, text
    from softvox_search.report.page import page

    made = tables.make(results)
    with style.style():
        pictures = {
            f"{name}.png": style.encoded(figure) for name, figure in figures.draw(made).items()
        }
    files = {f"{name}.csv": text.csv(table) for name, table in made.items()}
    written = []
    for name, contents in (("tables", files), ("figures", pictures)):
        if contents:
            write_folder(folder / name, contents, force=True)
        written += [f"{name}/{file}" for file in contents]
    # Of the tables as their files have them, so that the page can be made of these again.
    text_of_page = page(results, text.read(folder / "tables"), list(pictures))
    write_file(folder / "report.md", text_of_page.encode(), force=True)
    return [*written, "report.md"]
