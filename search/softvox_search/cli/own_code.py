"""The user's own searchers, methods and wrappers: where they are found, and what they print."""

from __future__ import annotations

import contextlib
import os
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from softvox_gym.cli.terminal import complain

if TYPE_CHECKING:
    from softvox_search.single import RaisedError


def look_in(*folders: Path) -> None:
    """Add folders to the module search path, in this order, after everything else."""
    for folder in map(os.path.abspath, folders):
        if folder not in sys.path and not ("" in sys.path and folder == os.getcwd()):
            sys.path.append(folder)


def tell_raised(error: RaisedError) -> int:
    """Print the error of the user's own code in one line, below its traceback; return 1."""
    if sys.stderr is not None:
        traceback.print_exception(error.__cause__)
    complain("error", str(error))
    return 1


@contextlib.contextmanager
def prints_aside() -> Iterator[None]:
    """Send anything printed in this context to standard error: standard output is for results."""
    with contextlib.redirect_stdout(sys.stderr):
        yield
