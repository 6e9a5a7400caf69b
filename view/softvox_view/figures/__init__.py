"""The paper's figures from this package's own data: their names, and how one is made.

Light to import; matplotlib loads with `make`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softvox_view.tracks_csv import RealTrack

#: Every figure and what it shows; each is a module here with a function `draw`.
FIGURES = {
    "gallery": "the published top hundred, ten by ten (Fig. 1a)",
    "tessellation": "the key to the maps: sites, pairs and nesting (Fig. 3)",
    "heatmap": "the fitness of all 6561 designs as a map (Fig. 4)",
    "classes": "maps of the kinds of robot and of the symmetry classes",
    "heading": "a map of the directions in which the designs travel",
    "robustness": "maps of the mean fitness at noise level 1, and of the share kept",
    "tracks": "the best of nine bodies over 23 cycles, real tracks laid over (Fig. 7')",
    "volume": "relative volume over one cycle, by mode of actuation (Fig. 7'')",
    "search": "searchers compared, from folders of results of softvox compare",
}


@dataclass(frozen=True)
class Inputs:
    """What figures may be made of besides the data that ship with the package.

    Parameters
    ----------
    tracks : tuple of RealTrack
        Of real robots, for the figure tracks.
    results : tuple of Path
        Folders of results of `softvox compare`, for the figure search.
    """

    tracks: tuple[RealTrack, ...] = ()
    results: tuple[Path, ...] = ()


@dataclass
class Made:
    """What a figure came to.

    Parameters
    ----------
    figures : dict of str to Figure
        By file name without its ending.
    tables : dict of str to bytes
        Tables that belong to it, by file name.
    lines : list of str
        What to tell on the terminal.
    look : callable, optional
        A context manager to write the figures within, where they have a style of their own.
    """

    figures: dict[str, Figure]
    tables: dict[str, bytes] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    look: Callable[[], AbstractContextManager[None]] | None = None


def make(name: str, inputs: Inputs | None = None) -> Made:
    """Draw a figure in the house's style.

    Parameters
    ----------
    name : str
        One of `FIGURES`.
    inputs : Inputs, optional

    Raises
    ------
    ValueError
        For a name that no figure has, or inputs that the figure can't be made of.
    """
    from softvox_view.figures.style import style

    if name not in FIGURES:
        raise ValueError(f"no figure {name!r}; there are {', '.join(FIGURES)}")
    module = import_module(f"softvox_view.figures.{name}")
    with style():
        made: Made = module.draw(inputs or Inputs())
    return made


def files_of(made: Made, formats: Sequence[str]) -> dict[str, bytes]:
    """Return the files of a figure by name: every picture in every format, then the tables.

    Parameters
    ----------
    made : Made
    formats : sequence of str
        Of `style.FORMATS`.
    """
    from softvox_view.figures import style

    files: dict[str, bytes] = {}
    with (made.look or style.style)():
        for name, figure in made.figures.items():
            files |= {f"{name}.{form}": style.encoded(figure, form) for form in formats}
    return {**files, **made.tables}
