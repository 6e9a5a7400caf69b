"""The published top hundred as a gallery (Fig. 1a)."""

from __future__ import annotations

import csv
from importlib.resources import files
from typing import Any

from matplotlib.figure import Figure

from softvox_gym.design import Design
from softvox_view.figures import Inputs, style
from softvox_view.figures.robots import picture

COLUMNS = 10

#: Inches of a cell: the picture, what is cut away at its sides, where there is only floor, and the
#: two lines under it.
CELL, CAPTION = style.WIDTH / COLUMNS, 0.27
MARGIN = 0.02 * CELL


def published() -> list[tuple[Design, str]]:
    """Return the published top hundred in their order: each design and its fitness as printed."""
    path = files("softvox_gym") / "data" / "authors" / "published_top100.csv"
    rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    return [(Design(int(row["design"])), row["fitness"]) for row in rows]


def draw_gallery(_: Inputs) -> Figure:
    """Draw ten by ten robots as built, in the paper's order, the fitness under each."""
    robots = published()
    height = -(-len(robots) // COLUMNS) * (CELL + CAPTION)
    made = style.figure(style.WIDTH, height, layout=None)
    axis = made.add_axes((0, 0, 1, 1))
    under: dict[str, Any] = {"ha": "center", "va": "top"}
    for i, (design, fitness) in enumerate(robots):
        left, top = i % COLUMNS * CELL, i // COLUMNS * (CELL + CAPTION)
        x, y, foot = left + CELL / 2, top + CELL / 2, top + CELL
        half = CELL / 2 - MARGIN
        shown = picture(design, round(style.DPI * CELL))
        extent = (x - half, x + half, y + half, y - half)
        axis.imshow(shown, extent=extent, interpolation="antialiased")
        axis.text(x, foot + 0.02, fitness, size=style.SMALL, color=style.INK, **under)
        axis.text(x, foot + 0.135, f"{design.index}", size=style.TINY, color=style.GREY, **under)
    axis.set(xlim=(0, style.WIDTH), ylim=(height, 0))
    axis.set_axis_off()
    return made
