"""Tracks of the best of nine bodies (Fig. 7'), and of real robots over them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import Design
from softvox_gym.physics import Physics
from softvox_gym.simulation import simulate
from softvox_view.comparison import as_csv, as_lines, compare
from softvox_view.figures import Drawing, Inputs, track_page
from softvox_view.figures.robots import best_of_bodies
from softvox_view.tracks_csv import COLUMNS, RealTrack

CYCLES, PER_CYCLE = 23, 50

#: Panels on a page; what does not fit goes on to further pages.
PER_PAGE = 12

#: Designs of real tracks that are none of the nine have panels of their own, up to so many.
MOST_MORE = 99

Array = NDArray[np.float64]


def draw(inputs: Inputs) -> Drawing:
    """Draw a panel per design, and compare with the real tracks.

    Raises
    ------
    ValueError
        Where real tracks are of too many designs.
    """
    designs = designs_of(inputs.tracks)
    simulated = dict(zip((d.index for d in designs), simulated_tracks(designs), strict=True))
    tables = {"tracks_simulated.csv": tracks_csv(simulated)}
    rows = [compare(track, simulated[track.design], PER_CYCLE) for track in inputs.tracks]
    lines = []
    if rows:
        tables["tracks_compared.csv"] = as_csv(rows)
        lines = as_lines(rows)
    panels = [
        track_page.Panel(
            name=_letters(i),
            design=design,
            cycle=np.arange(CYCLES * PER_CYCLE + 1) / PER_CYCLE,
            simulated=simulated[design.index],
            real=tuple(track for track in inputs.tracks if track.design == design.index),
            compared=tuple(row for row in rows if row.design == design.index),
        )
        for i, design in enumerate(designs)
    ]
    half = track_page.needed_half(list(simulated.values()))
    figures = {
        f"tracks_{1 + first // PER_PAGE}" if first else "tracks": track_page.draw(
            panels[first : first + PER_PAGE], half
        )
        for first in range(0, len(panels), PER_PAGE)
    }
    return Drawing(figures, tables, lines)


def _letters(i: int) -> str:
    """Return a, b, ... z, aa, ab, ... from 0 on."""
    before = _letters(i // 26 - 1) if i >= 26 else ""
    return before + "abcdefghijklmnopqrstuvwxyz"[i % 26]


def designs_of(real: Sequence[RealTrack]) -> list[Design]:
    """Return the designs to show: the best of nine bodies, then others with real tracks.

    Raises
    ------
    ValueError
        Where these are too many.
    """
    best = best_of_bodies()
    more = [d for d in dict.fromkeys(Design(track.design) for track in real) if d not in best]
    if len(more) > MOST_MORE:
        raise ValueError(
            f"real tracks are of {len(more)} designs besides the {len(best)} that are shown, and "
            f"at most {MOST_MORE} have room; leave some out, or draw them one after the other"
        )
    return [*best, *more]


def simulated_tracks(designs: Sequence[Design]) -> Array:
    """Return where the centres of mass are, cm from the start, shape (n, 23 * 50 + 1, 2)."""
    physics = Physics.published()
    result = simulate(designs, physics.lasting(CYCLES), track=PER_CYCLE)
    assert result.track is not None
    return np.asarray(result.track[..., :2] * physics.edge * 100)


def tracks_csv(simulated: dict[int, Array]) -> bytes:
    """Return simulated tracks in the format of the real ones; see `softvox_view.tracks_csv`."""
    lines = [",".join(COLUMNS)]
    for design, track in simulated.items():
        for sample, (x, y) in enumerate(track):
            lines.append(f"{design},simulated,{sample / PER_CYCLE:g},{x:.6f},{y:.6f}")
    return ("\n".join(lines) + "\n").encode()
