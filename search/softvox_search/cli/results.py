"""What the commands that write a folder of results share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from softvox_gym.cli.signals import Stopped
from softvox_gym.cli.terminal import BadInputError, bad_input, complain
from softvox_gym.files import OutputError, check_folder
from softvox_gym.missing import missing
from softvox_search.cli.own_code import prints_aside

KEPT = "finished work is kept; the same command continues"

#: The libraries needed to read results.
LIBRARIES = ("msgspec", "pandas", "pyarrow")

#: Print a warning of one line.
warn = partial(complain, "warning")


@contextmanager
def needs(command: str) -> Iterator[None]:
    """Turn a missing package into an error of one line."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise BadInputError(missing(command, error, LIBRARIES)) from error


def check_report() -> None:
    """Check, before the runs, that the report can be made."""
    try:
        from softvox_search.report import figures, page  # noqa: F401
    except ModuleNotFoundError as error:
        what = missing("the report", error, ("matplotlib", "pandas", "scipy"))
        raise BadInputError(f"{what}, or give --no-report") from error
    except Exception as error:
        raise BadInputError(
            f"the report can't be made, {type(error).__name__}: {error}; fix that, or give "
            "--no-report"
        ) from error


def report(folder: Path) -> list[str]:
    """Write the report on the results in a folder; return the names of the files to read."""
    from softvox_search import report
    from softvox_search.experiment.results import read

    with prints_aside():
        report.write(folder, read(folder, of_transfer=None))
    return ["report.md"]


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Name what can't be written, and say at any early end that finished work is kept."""
    try:
        yield
    except Stopped as stop:
        stop.add_note(KEPT)
        raise
    except OutputError as error:
        raise BadInputError(f"{error}; {KEPT}") from error
    except OSError as error:
        why = error.strerror or error
        place = error.filename or f"cannot write into {folder}"
        raise BadInputError(f"{place}: {why}; {KEPT}") from error


def make_folder(folder: Path) -> None:
    """Make the folder of results, and its parents, if they don't exist."""
    with bad_input("--out"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        check_folder(folder, (), force=True)
        folder.mkdir(exist_ok=True)
