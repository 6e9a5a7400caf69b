"""A table of numbers and what they mean, described once: as text, Markdown, CSV and JSON."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from string import Formatter
from typing import Any, NamedTuple


class Column(NamedTuple):
    """A column of a `Section`.

    Parameters
    ----------
    key : str
        Its name in CSV and JSON.
    title : str
        Its heading for people; "" for a column that is for programs only.
    spec : str or callable
        Format specification of the displayed value, or a function that returns its text. None is
        shown as "-".
    """

    key: str
    title: str = ""
    spec: str | Callable[[Any], str] = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """A table with its explanation.

    Parameters
    ----------
    title, note : str
        The heading, and a definition of the numbers, for a document.
    columns : sequence of Column
        The first identifies the rows.
    rows : sequence of tuple
        Plain values, one per column.
    facts : mapping of str to value
        Single numbers that belong to the table.
    sentence : str
        A format string that states the facts, put after the table.
    file : str
        Name of the CSV file with all rows; "" if JSON has them.
    screen, document : int or None
        The most rows shown as text, and in Markdown; None for all. With 0 the section is left out.
    is_transposed : bool
        Whether the displayed table has the columns as rows.
    """

    title: str = ""
    note: str = ""
    columns: Sequence[Column]
    rows: Sequence[tuple[Any, ...]]
    facts: Mapping[str, Any] = field(default_factory=dict)
    sentence: str = ""
    file: str = ""
    screen: int | None = None
    document: int | None = None
    is_transposed: bool = False

    def records(self) -> list[dict[str, Any]]:
        """Return the rows as dicts."""
        keys = [column.key for column in self.columns]
        return [dict(zip(keys, row, strict=True)) for row in self.rows]

    def to_dict(self) -> dict[str, Any]:
        """Return the explanation of the table, its facts, and its rows if no file has them."""
        rows = {} if self.file else {"rows": self.records()}
        return {"meaning": self.note, **self.facts, **rows}

    def csv(self) -> str:
        """Return all rows as CSV; floats are written so that they read back to the same bits."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([column.key for column in self.columns])
        writer.writerows(self.rows)
        return text.getvalue()

    def text(self) -> str:
        """Return the table as aligned lines, and the sentence."""
        return "\n".join([*aligned(self.cells(self.screen)), *self._sentence()])

    def markdown(self) -> str:
        """Return the table as a part of a Markdown document."""
        header, *rows = self.cells(self.document)
        rule = ["---", *["---:"] * (len(header) - 1)]
        table = [f"| {' | '.join(cells)} |" for cells in (header, rule, *rows)]
        facts = [f"{fact[:1].upper()}{fact[1:]}.\n" for fact in self._sentence()]
        return "\n".join([f"## {self.title}\n", f"{self.note}\n", *table, "", *facts])

    def cells(self, limit: int | None = None) -> list[list[str]]:
        """Return the displayed header and rows as text."""
        seen = [(i, column) for i, column in enumerate(self.columns) if column.title]
        header = [column.title for _, column in seen]
        rows = [[shown(row[i], column.spec) for i, column in seen] for row in self.rows[:limit]]
        table = [header, *rows]
        return [list(row) for row in zip(*table, strict=True)] if self.is_transposed else table

    def _sentence(self) -> list[str]:
        return [_Facts().format(self.sentence, **self.facts)] if self.sentence else []


class _Facts(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        return shown(value, format_spec)


def shown(value: Any, spec: str | Callable[[Any], str]) -> str:
    """Return a value as displayed, such as 0.5 with ".1%" as 50.0 %, and -0.01 as 0."""
    if callable(spec):
        return spec(value)
    text = "-" if value is None else format(value, spec).replace("%", " %")
    is_zero = isinstance(value, float) and text.startswith("-") and not text.strip("-0. %")
    return text.removeprefix("-") if is_zero else text


def counted(number: int, what: str) -> str:
    """Return a count with its noun, such as 1 trial or 2 trials."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def some(values: Iterable[Any], comma: str = ", ", *, most: int = 9) -> str:
    """Return a list in words, of many the first, as 1, 2 and 7 more."""
    words = [str(value) for value in values]
    more = len(words) - most
    return comma.join(words[:most]) + (f" and {more} more" if more > 0 else "")


def aligned(rows: Iterable[Sequence[str]]) -> list[str]:
    """Return lines with columns of equal width, the first to the left, the others to the right."""
    table = list(rows)
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  ".join(
            cell.rjust(width) if place else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    ]
