"""What several commands share: folders of results, and what --out needs."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from softvox_gym.cli.terminal import BadInputError
from softvox_gym.missing import missing
from softvox_search.cli.results import LIBRARIES

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results


def import_figures() -> None:
    """Import what draws the figures of --out; BadInputError, before the work, where it can't be."""
    try:
        from softvox_view.figures import style  # noqa: F401, before all that imports matplotlib
    except ModuleNotFoundError as error:
        raise BadInputError(missing("--out", error)) from error


def add_results(parser: ArgumentParser, what_for: str) -> None:
    """Add --results, folders that `softvox compare` has written."""
    parser.add_argument(
        "--results",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help=f"a folder of softvox compare, {what_for}; may be given several times",
    )


def read_results(
    folders: Sequence[Path], *, of_transfer: bool | None = False
) -> dict[str, Results]:
    """Read folders of results, by what they are called: of searchers, or as `read` says.

    Raises
    ------
    BadInputError
        Where one is no folder of finished results, two are called alike, or a library is missing.
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
                f"two folders of results are called {name}, and so would be what is made of them; "
                "rename one, or take them one after the other"
            )
        try:
            named[name] = read(folder, of_transfer=of_transfer)
        except ResultsError as error:
            raise BadInputError(f"--results {error}") from error
    return named
