"""The published top hundred as a gallery (Fig. 1a)."""

from __future__ import annotations

import csv
from importlib.resources import files

from matplotlib.figure import Figure

from softvox_gym.design import Design
from softvox_view.figures import Inputs, style
from softvox_view.figures.robots import picture

COLUMNS = 10

#: Inches of a cell: the picture, and the two lines under it.
CELL, CAPTION = style.WIDTH / COLUMNS, 0.27

#: Shares of the picture cut away at the sides, where there is only floor.
MARGIN = 0.02

PIXELS = round(style.DPI * CELL)


def published() -> list[tuple[Design, str]]:
    """Return the published top hundred in their order: each design and its fitness as printed."""
    path = files("softvox_gym") / "data" / "authors" / "published_top100.csv"
    rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    return [(Design(int(row["design"])), row["fitness"]) for row in rows]


def draw(_: Inputs) -> Figure:
    """Draw ten by ten robots as built, in the paper's order, the fitness under each."""
    robots = published()
    rows = -(-len(robots) // COLUMNS)
    made = style.figure(style.WIDTH, rows * (CELL + CAPTION), layout=None)
    for i, (design, fitness) in enumerate(robots):
        row, column = divmod(i, COLUMNS)
        _robot(made, design, fitness, left=column * CELL, top=row * (CELL + CAPTION))
    return made


def _robot(made: Figure, design: Design, fitness: str, *, left: float, top: float) -> None:
    width, height = made.get_size_inches()
    inner = CELL * (1 - 2 * MARGIN)
    box = (
        (left + MARGIN * CELL) / width,
        1 - (top + MARGIN * CELL + inner) / height,
        inner / width,
        inner / height,
    )
    axis = made.add_axes(box)
    axis.imshow(picture(design, PIXELS), interpolation="antialiased")
    axis.set_axis_off()
    middle = (left + CELL / 2) / width
    for text, below, size, colour in (
        (fitness, 0.02, style.SMALL, style.INK),
        (f"{design.index}", 0.135, style.TINY, style.GREY),
    ):
        y = 1 - (top + CELL + below) / height
        made.text(middle, y, text, size=size, color=colour, ha="center", va="top")
