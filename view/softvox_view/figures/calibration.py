"""A calibration: matched headings over the grid, and the best point's tracks with the real ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from softvox_gym.calibration import Calibration
from softvox_gym.design import Design
from softvox_gym.real_tracks import PER_CYCLE, WITHIN, RealTrack, as_csv, compare
from softvox_gym.simulation import simulate
from softvox_search.report.style import grid
from softvox_view.figures import Drawing, style
from softvox_view.figures.tracks import MOST_MORE, draw_pages

#: The most panels for a third parameter, and the most designs with drawn tracks.
MOST_MAPS, MOST_DESIGNS = 12, MOST_MORE

#: Labels of parameters on axes.
WORDS = {
    "friction_static": "static friction",
    "friction_kinetic": "kinetic friction",
    "shear_ratio": "T*",
    "strain": "strain",
    "frequency_hz": "frequency, Hz",
}

#: The ring around the best point.
RING: dict[str, Any] = {"mec": "#D55E00", "mew": 1.4, "ms": 9}

Array = NDArray[np.float64]


def draw_calibration(calibration: Calibration, tracks: Sequence[RealTrack]) -> Drawing:
    """Draw the map and the tracks; all tracks are of the calibration's designs. Compare them too.

    Raises
    ------
    ValueError
        If there are more designs than have room.
    """
    if len(calibration.designs) > MOST_DESIGNS:
        raise ValueError(
            f"the tracks are of {len(calibration.designs)} designs, and at most {MOST_DESIGNS} "
            "have room in the figure; give fewer"
        )
    simulated = best_tracks(calibration, tracks)
    rows = [compare(track, simulated[track.design], PER_CYCLE) for track in tracks]
    designs = [Design(number) for number in simulated]
    with style.style():
        pages = draw_pages("calibration_tracks", designs, simulated, tracks, rows)
        figures = {"calibration": draw_map(calibration), **pages}
    return Drawing(figures, {"calibration_tracks.csv": as_csv(rows)})


def best_tracks(calibration: Calibration, tracks: Sequence[RealTrack]) -> dict[int, Array]:
    """Return the tracks of the designs at the best point, each as long as its longest real track.

    They are by design number, cm from the start, shape (m, 2); a design that diverges stays put.
    """
    last = dict.fromkeys(calibration.designs.tolist(), 0.0)
    for track in tracks:
        last[track.design] = max(last[track.design], float(track.cycle[-1]))
    samples = np.ceil(np.array(list(last.values())) * PER_CYCLE - 1e-6)
    physics = calibration.physics_of(calibration.best, samples / PER_CYCLE)
    result = simulate(calibration.designs, physics, track=PER_CYCLE)
    assert result.track is not None
    moved = np.where(result.diverged[:, np.newaxis, np.newaxis], 0.0, result.track[..., :2])
    moved = moved * (physics.edge * 100)
    return {
        number: track[: int(count) + 1]
        for number, track, count in zip(last, moved, samples, strict=True)
    }


def draw_map(calibration: Calibration) -> Figure:
    """Draw the number of matched headings over the first two parameters that vary.

    A third parameter has a panel per value, if these are not too many; all others are as at the
    best point, which has a ring. Cells without a point are white.
    """
    best, parameters = calibration.best, calibration.parameters
    differ = [name for name, values in parameters.items() if np.ptp(values) > 0]
    if len(differ) > 2 and len(np.unique(parameters[differ[2]])) > MOST_MAPS:
        differ = differ[:2]
    across, up, over = (*differ, None, None, None)[:3]
    fixed = {name: values[best] for name, values in parameters.items() if name not in differ[:3]}
    is_shown = np.all([parameters[name] == at for name, at in fixed.items()], axis=0)
    (columns, x), (rows, y), (panels, z) = (_places(calibration, k) for k in (across, up, over))
    made, axes = grid(len(panels), height=1.6)
    most = int(calibration.has_heading.sum())
    for panel, (axis, label) in enumerate(zip(axes, panels, strict=True)):
        here = np.flatnonzero(is_shown & (z == panel))
        cells = np.full((len(rows), len(columns)), np.nan)
        cells[y[here], x[here]] = calibration.headings[here]
        colours: dict[str, Any] = {"cmap": style.SEQUENTIAL, "vmin": 0, "vmax": most}
        image = axis.imshow(cells, origin="lower", aspect="auto", **colours)
        axis.set_xticks(range(len(columns)), columns, rotation=90)
        axis.set_yticks(range(len(rows)), rows)
        axis.set_title(f"{word(over)} = {label}" if over else "", size=style.SMALL)
        if best in here:
            axis.plot(x[best], y[best], "o", mfc="none", **RING)
    made.supxlabel(word(across))
    made.supylabel(word(up))
    bar = made.colorbar(image, ax=axes, pad=0.02, aspect=40, shrink=0.8)
    bar.locator = MaxNLocator(integer=True)
    bar.set_label(f"headings within {WITHIN}\N{DEGREE SIGN}, of {most}")
    others = "".join(f"; {word(name)} = {value:g}" for name, value in fixed.items())
    made.suptitle(f"ringed: the best point{others}", size=style.SMALL)
    return made


def word(name: str | None) -> str:
    """Return the label of a parameter."""
    return WORDS.get(name, name.replace("_", " ")) if name else ""


def _places(calibration: Calibration, name: str | None) -> tuple[list[str], NDArray[np.int64]]:
    """Return the values of a parameter as text, and the index of each point's value."""
    if name is None:
        return [""], np.zeros(len(calibration), np.int64)
    values, place = np.unique(calibration.parameters[name], return_inverse=True)
    return [f"{value:g}" for value in values], place
