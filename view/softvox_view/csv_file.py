"""CSV files that people made, read with messages that name the line and the mend."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path


class CsvError(ValueError):
    """A file that can't be used; the message names the file, the line and the mend."""


def records(path: Path, columns: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Read a file whose first line names its columns, in any order.

    Parameters
    ----------
    path : Path
    columns : sequence of str
        Those that there must be, each once; others may be there besides.

    Yields
    ------
    line : int
        Where a record begins, 1 for the first line.
    record : dict of str to str
        Its values by column; blank lines are left out.

    Raises
    ------
    CsvError
        Where the file can't be read, or is not such a file.
    """
    reader = csv.reader(io.StringIO(_text(path), newline=""), strict=True)
    line = 1
    try:
        names = [name.strip() for name in next(reader, [])]
        _check_header(path, names, columns)
        line = reader.line_num + 1
        for cells in reader:
            if any(cell.strip() for cell in cells):
                if len(cells) != len(names):
                    raise CsvError(
                        f"{path}, line {line}: {len(cells)} values, but the first line names "
                        f"{len(names)} columns; give one value for each, separated by commas"
                    )
                yield line, dict(zip(names, cells, strict=True))
            line = reader.line_num + 1
    except csv.Error as error:
        fault = str(error)
        if fault == "unexpected end of data":
            fault = "a quoted value begins here and does not end"
        raise CsvError(
            f"{path}, line {line}: {fault}; mend that line, or save the file as CSV anew"
        ) from None


def _text(path: Path) -> str:
    """Return what is in a file of text."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise CsvError(f"{path} does not exist; name a file that does") from None
    except IsADirectoryError:
        raise CsvError(f"{path} is a folder; name a CSV file in it") from None
    except OSError as error:
        raise CsvError(
            f"{path} can't be read ({error.strerror}); make it readable, or name another file"
        ) from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = _line(error.object[: error.start].decode("utf-8"))
        raise CsvError(
            f"{path}, line {line}: not text in UTF-8; save the file as CSV in UTF-8"
        ) from None
    if "\0" in text:
        raise CsvError(
            f"{path}, line {_line(text[: text.index(chr(0))])}: a character NUL, which is no text; "
            "take it out, or save the file as CSV in UTF-8"
        )
    return text


def _line(before: str) -> int:
    """Return the line that comes after a text."""
    return 1 + len(re.findall(r"\r\n?|\n", before))


def _check_header(path: Path, names: Sequence[str], columns: Sequence[str]) -> None:
    missing = [name for name in columns if name not in names]
    twice = [name for name in columns if names.count(name) > 1]
    if missing or twice:
        wrong = f"lacks {', '.join(missing)}" if missing else f"names {twice[0]} twice"
        shown = ",".join(names)[:60]
        raise CsvError(
            f"{path}, line 1: the first line {wrong}; it must name the columns "
            f"{','.join(columns)}, separated by commas, got {shown!r}"
        )
