"""The paper's figures from this package's own data: their names, and how one is made.

Light to import; matplotlib loads with `make`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softvox_search.experiment.results import Results
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

    Tracks of real robots are for the figure tracks, results by name for the figure search.
    """

    tracks: tuple[RealTrack, ...] = ()
    results: Mapping[str, Results] = field(default_factory=dict)


@dataclass
class Drawing:
    """What was drawn as a figure.

    Parameters
    ----------
    figures : dict of str to Figure
        By file name without its ending.
    tables : dict of str to bytes
        Tables that belong to it, by file name.
    lines : list of str
        For the terminal.
    style : callable, optional
        A context manager to write the figures within, where that is not the figures' own.
    """

    figures: dict[str, Figure]
    tables: dict[str, bytes] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    style: Callable[[], AbstractContextManager[None]] | None = None


def make(name: str, inputs: Inputs | None = None) -> Drawing:
    """Draw one of `FIGURES`; ValueError for inputs that it can't be made of."""
    from softvox_view.figures.style import style  # before all that imports matplotlib

    draw = import_module(f"softvox_view.figures.{name}").draw
    with style():
        drawn: Figure | Drawing = draw(inputs or Inputs())
    return drawn if isinstance(drawn, Drawing) else Drawing({name: drawn})


def files_of(drawing: Drawing, formats: Sequence[str]) -> dict[str, bytes]:
    """Return the files of a figure by name: every picture in some formats, then the tables."""
    from softvox_view.figures import style

    files: dict[str, bytes] = {}
    with (drawing.style or style.style)():
        for name, figure in drawing.figures.items():
            files |= {f"{name}.{form}": style.encoded(figure, form) for form in formats}
    return files | drawing.tables
