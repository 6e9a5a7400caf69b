"""Code of the user's own, searchers and wrappers: where it is found, and what it prints."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path


def look_in(*folders: Path) -> None:
    """Let modules be found in folders as well, after everything else and in this order."""
    for folder in map(os.path.abspath, folders):
        if folder not in sys.path and not ("" in sys.path and folder == os.getcwd()):
            sys.path.append(folder)


@contextlib.contextmanager
def prints_aside() -> Iterator[None]:
    """Send what is printed meanwhile to standard error: standard output is for results."""
    with contextlib.redirect_stdout(sys.stderr):
        yield
