"""Pages for print: A4, filled from the top with blocks and wrapped text; and their files."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from html import escape
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Rectangle
from matplotlib.textpath import text_to_path
from numpy.typing import ArrayLike

from softvox_search.report.style import FORMATS, Look, encoded
from softvox_search.report.style import style as project_style
from softvox_view.figures.style import INK, figure

#: Size of A4, and of its printed area: inches, as all lengths here, from the upper left corner.
WIDTH, HEIGHT = 210 / 25.4, 297 / 25.4
LEFT, RIGHT, HEAD, FOOT = 0.6, WIDTH - 0.6, 0.45, HEIGHT - 0.45

#: Points, size of all text except titles; inches between lines, and from a line's top to its foot.
SIZE = 8.0
LINE, ASCENT = 1.26 * SIZE / 72, 0.97 * SIZE / 72

#: Gap between texts beside each other.
GAP = 0.08

#: A context in which to draw pages: the project's style, at print size.
style = partial(
    project_style,
    Look(dpi=150, font=SIZE, widest=WIDTH),
    {"axes.grid": False, "hatch.linewidth": 0.6},
)

_HTML = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>{title}</title>
<style>
@page {{ size: A4; margin: 0 }}
body {{ margin: 0; background: #ddd }}
svg {{ display: block; width: 210mm; height: 297mm; margin: 5mm auto; background: white }}
@media print {{ svg {{ margin: 0; break-after: page }} body {{ background: none }} }}
</style>
{pages}
</html>
"""

_SVG = """<?xml version="1.0" encoding="utf-8" standalone="no"?>
<svg xmlns="http://www.w3.org/2000/svg"
  width="{wide}pt" height="{tall}pt" viewBox="0 0 {wide} {tall}">
{pages}
</svg>
"""


@lru_cache(maxsize=65536)
def width_of(text: str, weight: str = "normal") -> float:
    """Return the width of a text."""
    font = FontProperties(size=SIZE, weight=weight)
    wide, _, _ = text_to_path.get_text_width_height_descent(text, font, ismath=False)
    return float(wide) / 72


def wrapped(text: str, width: float, *, weight: str = "normal") -> list[str]:
    """Return the lines of a text, broken at spaces only."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and width_of(longer, weight=weight) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


@dataclass
class Column:
    """A column of pages, filled from the top; a block that has no room goes to the next page.

    Pages are made as needed, each with one `Axes` in inches, y downwards. The first page has the
    title; later ones have the title and their number.
    """

    title: str
    figures: list[Figure] = field(default_factory=list)
    left: float = LEFT
    right: float = RIGHT
    page: int = 0
    top: float = HEAD

    def _axis(self) -> Axes:
        """Return the axes of the current page."""
        if self.page == len(self.figures):
            made = figure(WIDTH, HEIGHT, layout=None)
            made.set_label(self.title)
            axis = made.add_axes((0, 0, 1, 1))
            axis.set(xlim=(0, WIDTH), ylim=(HEIGHT, 0))
            axis.set_axis_off()
            if self.figures:
                title = f"{self.title}, page {self.page + 1}"
                axis.text(LEFT, HEAD, title, weight="bold", va="bottom")
            self.figures.append(made)
        return self.figures[self.page].axes[0]

    def room(self, height: float) -> tuple[Axes, float]:
        """Take up some height; return the axes and the y at which it begins."""
        if self.top + height > FOOT and self.top > HEAD:
            self.page, self.top = self.page + 1, HEAD + LINE
        self.top += height
        return self._axis(), self.top - height

    def keep(self, height: float) -> None:
        """Go to the next page unless this one has the given room."""
        self.room(height)
        self.top -= height

    def gap(self, height: float) -> None:
        """Leave a gap, unless the page ends first."""
        self.top = min(self.top + height, FOOT)

    def row(
        self, *cells: tuple[float, str], weight: str = "normal", end: float | None = None
    ) -> tuple[Axes, float]:
        """Write texts beside each other, each at an offset from the column's left side.

        Each is wrapped before the next begins, the last before an end. Returns the axes of the
        first line, and its foot.
        """
        ends = [left for left, _ in cells[1:]] + [end or self.right - self.left + GAP]
        lines = [
            wrapped(text, end - left - GAP, weight=weight)
            for (left, text), end in zip(cells, ends, strict=True)
        ]
        axis, top = self.room(max(map(len, lines)) * LINE)
        for (left, _), own in zip(cells, lines, strict=True):
            for i, line in enumerate(own):
                place = self.left + left, top + i * LINE + ASCENT
                axis.text(*place, line, weight=weight, va="baseline")
        return axis, top + ASCENT

    def table(
        self, at: Sequence[float], *rows: Sequence[str], end: float | None = None, gap: float = 0
    ) -> list[tuple[Axes, float]]:
        """Write rows of texts as `row` does, the first bold, with a gap between them in lines."""
        made = []
        for i, texts in enumerate(rows):
            self.gap(gap * LINE if i else 0)
            weight = "normal" if i else "bold"
            made.append(self.row(*zip(at, texts, strict=False), weight=weight, end=end))
        return made

    def numbered(self, items: Iterable[str], gap: float = 0) -> None:
        """Write a numbered list, with a gap between the items in lines."""
        for i, item in enumerate(items, start=1):
            self.gap(gap * LINE if i > 1 else 0)
            self.row((0, str(i)), (0.28, item))

    def head(self) -> None:
        """Write the title, and blanks for builder and date."""
        axis, top = self.room(0.36)
        axis.text(self.left, top + 0.22, self.title, size=18, weight="bold", va="baseline")
        words = f"built by {20 * '_'}     date {12 * '_'}"
        axis.text(self.right, top + 0.22, words, ha="right", va="baseline")
        rule(axis, self.left, self.right, top + 0.32, lw=1.2)

    def heading(self, text: str, *, follows: float = 3 * LINE) -> None:
        """Write an underlined heading, on the same page as what follows."""
        self.gap(LINE)
        self.keep(1.6 * LINE + follows)
        axis, top = self.room(1.6 * LINE)
        axis.text(self.left, top + ASCENT, text, weight="bold", size=9, va="baseline")
        rule(axis, self.left, self.right, top + 1.25 * LINE)

    def halves(self, share: float, gutter: float = 0.3) -> tuple[Column, ...]:
        """Return two columns side by side from here on; the left one takes a share of the width."""
        middle = self.left + share * (self.right - self.left)
        left, right = (self.left, middle - gutter / 2), (middle + gutter / 2, self.right)
        return tuple(replace(self, left=a, right=b) for a, b in (left, right))

    def below(self, *columns: Column) -> None:
        """Continue below the longest of some columns."""
        self.page, self.top = max((column.page, column.top) for column in columns)


def rule(axis: Axes, left: float, right: float, y: float, **options: Any) -> None:
    """Draw a thin horizontal line."""
    axis.plot((left, right), (y, y), **{"color": INK, "lw": 0.6, **options})


def label(axis: Axes, place: ArrayLike, text: str, **looks: Any) -> None:
    """Write a text centred at a place."""
    x, y = np.asarray(place)
    axis.text(x, y, text, **{"ha": "center", "va": "center", **looks})


def rectangle(axis: Axes, corner: ArrayLike, wide: float, high: float, **looks: Any) -> None:
    """Draw a rectangle from its upper left corner."""
    x, y = np.asarray(corner)
    axis.add_patch(Rectangle((x, y), wide, high, **{"fc": "none", "ec": INK, **looks}))


def box(axis: Axes, left: float, foot: float) -> None:
    """Draw a checkbox."""
    rectangle(axis, (left, foot - 0.11), 0.11, 0.11, lw=0.7)


def write(pages: Iterable[Figure], form: str) -> bytes:
    """Return pages as the bytes of a "pdf", "svg" or "html" file, the same on every run.

    Pages may be drawn lazily: for a PDF only one is kept at a time. HTML is self-contained and
    prints one page per sheet. In an SVG the pages are below one another.
    """
    with style():
        if form == "pdf":
            buffer = io.BytesIO()
            with PdfPages(buffer, metadata=FORMATS["pdf"]) as file:  # pages share their fonts
                for page in pages:
                    file.savefig(page, dpi="figure")
            return buffer.getvalue()
        titles, made = zip(
            *((str(page.get_label()), encoded(page, "svg").decode()) for page in pages), strict=True
        )
    inline = [one[one.index("<svg") :] for one in made]
    if form == "html":
        title = titles[0] + " and more" * (len(made) > 1)
        return _HTML.format(title=escape(title), pages="\n".join(inline)).encode()
    wide, high = WIDTH * 72, HEIGHT * 72
    placed = [
        one.replace("<svg ", f'<svg y="{i * high}" ', 1).replace('pt"', '"', 2)
        for i, one in enumerate(inline)
    ]
    tall = len(placed) * high
    return _SVG.format(wide=wide, tall=tall, pages="\n".join(placed)).encode()
