"""The paper's figures from this package's own data: their names, and how to make them.

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
    from softvox_gym.realities import Reality
    from softvox_search.experiment.results import Results

#: Every figure and its content.
FIGURES = {
    "gallery": "the published top hundred, ten by ten (Fig. 1a)",
    "tessellation": "the key to the maps: sites, pairs and nesting (Fig. 3)",
    "heatmap": "the fitness of all 6561 designs, with the best labelled (Fig. 4)",
    "classes": "maps of the kinds of robots and of the symmetry classes",
    "heading": "a map of the directions in which the designs travel",
    "robustness": "mean fitness at noise level 1 against that without, share kept",
    "tracks": "best of nine bodies over 23 cycles, and real tracks (Fig. 7')",
    "volume": "relative volume over one cycle, by mode of actuation (Fig. 7'')",
    "gap": "fitness in every reality against that in its simulator",
    "gap_headings": "headings in every reality against those in its simulator",
    "gap_tracks": "the best of nine bodies in both worlds, with the angle between",
    "gap_map": "a map of the designs that turn in a reality",
    "search": "searchers compared, from folders of softvox compare",
    "transfer": "transfer methods compared, from folders of softvox compare",
}

#: The figures of results, and of realities.
OF_RESULTS = ("search", "transfer")
OF_REALITIES = ("gap", "gap_headings", "gap_tracks", "gap_map")

#: The module with a figure's function `draw_NAME`, if its name is not that of the figure.
MODULES = {
    **dict.fromkeys(("heatmap", "classes", "heading", "robustness"), "maps"),
    **dict.fromkeys(("gallery", "volume"), "robots"),
    **dict.fromkeys(OF_REALITIES, "gap"),
    **dict.fromkeys(OF_RESULTS, "search"),
}


@dataclass(frozen=True)
class Inputs:
    """The inputs of figures besides the data that ship with the package.

    Tracks of real robots are for the figure tracks. Results, by name, each of searchers or of
    transfer methods, are for `OF_RESULTS`. Realities are for `OF_REALITIES`; by default all named
    realities have a panel, and tracks and map show area_friction. The scale is that of the heatmap,
    "rank" or "fitness"; the gallery shows the hundred, or one per class.
    """

    tracks: tuple[RealTrack, ...] = ()
    results: Mapping[str, Results] = field(default_factory=dict)
    realities: tuple[Reality, ...] = ()
    scale: str = "rank"
    one_per_class: bool = False


@dataclass
class Drawing:
    """Figures and tables by file name, figures without its ending, and lines for the terminal."""

    figures: dict[str, Figure]
    tables: dict[str, bytes] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)


def figure_of(results: Results) -> str:
    """Return which of `OF_RESULTS` shows some results."""
    return "transfer" if results.is_of_transfer else "search"


def make(name: str, inputs: Inputs | None = None) -> Drawing:
    """Draw one of `FIGURES`; ValueError if the inputs do not suit it."""
    from softvox_view.figures.style import style  # before anything imports matplotlib

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
