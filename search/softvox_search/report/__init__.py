"""The report of an experiment: statistics, tables and figures from its runs.

Importing it is cheap, as every worker does so: `write` loads pandas, scipy and matplotlib.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

__all__ = ["write"]


def write(folder: Path, results: Results) -> list[str]:
    """Write the report of an experiment: report.md, and the folders tables and figures beside it.

    The same results give the same bytes. Every file is written atomically, and replaces an existing
    one. Returns the files written, relative to the folder, report.md last.

    Raises
    ------
    softvox_gym.files.OutputError
        If a file can't be written.
    """
    from softvox_gym.files import write_file, write_folder
    from softvox_search.report import style, text

    making: Any
    drawing: Any
    showing: Any
    if results.is_of_transfer:
        from softvox_search.report import transfer, transfer_figures

        making, drawing, showing = transfer, transfer_figures, transfer
    else:
        from softvox_search.report import figures, page, tables

        making, drawing, showing = tables, figures, page
    csv = {f"{name}.csv": text.csv(table) for name, table in making.make(results).items()}
    write_folder(folder / "tables", csv, force=True)
    # Figures and page are made from the tables as stored, so they can be made again from the files.
    made = text.read(folder / "tables", csv)
    with style.style():
        pictures = {
            f"{name}.png": style.encoded(figure) for name, figure in drawing.draw(made).items()
        }
    if pictures:
        write_folder(folder / "figures", pictures, force=True)
    write_file(
        folder / "report.md", showing.page(results, made, list(pictures)).encode(), force=True
    )
    named = {"tables": csv, "figures": pictures}
    return [f"{name}/{file}" for name, files in named.items() for file in files] + ["report.md"]
