"""The paper's figures from this package's own data: their names, and how one is made.

Light to import; matplotlib loads with `make`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softvox_gym.real_tracks import RealTrack
    from softvox_search.experiment.results import Results

#: Every figure and what it shows.
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

#: The module here with a figure's function `draw_NAME`, where it is not called as the figure is.
MODULES = {
    **dict.fromkeys(("heatmap", "classes", "heading", "robustness"), "maps"),
    **dict.fromkeys(("gallery", "volume"), "robots"),
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
    """Figures and tables by file name, figures without its ending, and lines for the terminal."""

    figures: dict[str, Figure]
    tables: dict[str, bytes] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)


def make(name: str, inputs: Inputs | None = None) -> Drawing:
    """Draw one of `FIGURES`; ValueError for inputs that it can't be made of."""
    from softvox_view.figures.style import style  # before all that imports matplotlib

    module = import_module(f"softvox_view.figures.{MODULES.get(name, name)}")
    with style():
        drawn: Figure | Drawing = getattr(module, f"draw_{name}")(inputs or Inputs())
    return drawn if isinstance(drawn, Drawing) else Drawing({name: drawn})


def files_of(drawing: Drawing, formats: Sequence[str]) -> dict[str, bytes]:
    """Return the files of a figure by name: every picture in some formats, then the tables."""
    from softvox_view.figures import style

    files: dict[str, bytes] = {}
    with style.style():
        for name, figure in drawing.figures.items():
            files |= {f"{name}.{form}": style.encoded(figure, form) for form in formats}
    return files | drawing.tables
