"""Folders of results that `softvox compare` has written, as commands are given them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


class ResultsError(ValueError):
    """A folder of results that can't be used; the message says what is wrong, and the mend."""


def checked(folder: Path) -> Path:
    """Return a folder that is there.

    Raises
    ------
    ResultsError
        Where it is none.
    """
    if not folder.is_dir():
        raise ResultsError(f"{folder} is not a folder; name one that softvox compare has written")
    return folder


def by_name(folders: Sequence[Path]) -> dict[str, Path]:
    """Return folders by what they are called.

    Raises
    ------
    ResultsError
        Where two are called alike.
    """
    named: dict[str, Path] = {}
    for folder in folders:
        name = folder.resolve().name
        if name in named:
            raise ResultsError(
                f"two folders of results are called {name}, and so would be what is made of them; "
                "rename one, or take them one after the other"
            )
        named[name] = folder
    return named
