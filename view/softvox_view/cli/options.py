"""What several commands share: folders of results, and figures in the folder of --out."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from softvox_gym.cli.parser import add_several
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.files import write_folder
from softvox_gym.missing import missing
from softvox_search.cli.results import LIBRARIES

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results


def import_figures(*modules: str, what: str = "--out", libraries: Sequence[str] = ()) -> None:
    """Import modules of figures; raise BadInputError, before the work, if that fails."""
    try:
        for module in ("style", *modules):  # the style before anything imports matplotlib
            import_module(f"softvox_view.figures.{module}")
    except ModuleNotFoundError as error:
        raise BadInputError(missing(what, error, libraries)) from error


def write_figures(out: Path, files: Mapping[str, bytes | str], *, force: bool) -> None:
    """Write files into the folder of --out, and remove further pages of earlier figures."""
    with bad_input("--out"):
        write_folder(out, files, force=force)
        for path in out.glob("*_[0-9]*"):
            name, _, page = path.stem.rpartition("_")
            if page.isdecimal() and name + path.suffix in files and path.name not in files:
                path.unlink()


def add_results(parser: ArgumentParser, what_for: str) -> None:
    """Add --results, folders that `softvox compare` has written."""
    add_several(parser, "--results", "DIR", f"a results folder of softvox compare, {what_for}")


def read_results(
    folders: Sequence[Path], *, of_transfer: bool | None = False
) -> dict[str, Results]:
    """Read folders of results, by folder name: of searchers, or of what `read` says.

    Raises
    ------
    BadInputError
        If one is not a folder of finished results, two share a name, or a library is missing.
    """
    if not folders:
        return {}
    try:
        from softvox_search.experiment.results import ResultsError, read
    except ModuleNotFoundError as error:
        raise BadInputError(missing("--results", error, LIBRARIES)) from error
    named: dict[str, Results] = {}
    for folder in folders:
        name = folder.resolve().name
        if name in named:
            raise BadInputError(
                f"two folders of results are called {name}; rename one, or use one at a time"
            )
        try:
            named[name] = read(folder, of_transfer=of_transfer)
        except ResultsError as error:
            raise BadInputError(f"--results {error}") from error
    return named
