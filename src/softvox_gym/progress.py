"""A progress bar of one line."""

from __future__ import annotations

import os
import time
from typing import TextIO

BAR = 24


class Progress:
    """Shows the progress of a batch: count, share, speed and the time left.

    A context manager, which removes the line at its end, and a callable (done, total) to pass to
    `simulate`. Draws only on a terminal.

    Parameters
    ----------
    stream : TextIO or None
        Where to draw, normally standard error.
    quiet : bool
        Never draw.
    unit : str
        What is counted.
    """

    def __init__(
        self, stream: TextIO | None, *, quiet: bool = False, unit: str = "designs"
    ) -> None:
        self._unit = unit
        self._stream = stream if stream and stream.isatty() and not quiet else None
        self._start = time.monotonic()
        self._drawn = 0

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self._draw("")

    def __call__(self, done: int, total: int) -> None:
        """Draw the progress."""
        if self._stream is not None:
            seconds = time.monotonic() - self._start
            try:
                width = os.get_terminal_size(self._stream.fileno()).columns or 80
            except OSError:
                width = 80
            self._draw(progress_line(done, total, seconds, width, unit=self._unit))

    def _draw(self, text: str) -> None:
        """Draw over the last line, with blanks, because not every terminal can erase."""
        if self._stream is None or not (text or self._drawn):
            return
        blanks = " " * (self._drawn - len(text))
        try:
            self._stream.write(f"\r{text}{blanks}" + ("" if text else "\r"))
            self._stream.flush()
        except OSError:  # the terminal is gone, but the work may go on
            self._stream = None
        self._drawn = len(text)


def progress_line(
    done: int, total: int, seconds: float, width: int, *, unit: str = "designs"
) -> str:
    """Return the text of the bar, shorter than the width; "" if none fits."""
    share = done / total if total else 1.0
    speed = done / seconds if seconds > 0 else 0.0
    left = _clock((total - done) / speed) if speed else "-:--"
    count = f"{done:{len(str(total))}}/{total}"
    facts = f"{count} {share:4.0%}  {speed:.{0 if speed >= 10 else 2}f} {unit}/s  {left} left"
    filled = round(BAR * share)
    full = f"[{'#' * filled}{' ' * (BAR - filled)}] {facts}"
    for text in (full, facts, count):
        if len(text) < width:
            return text
    return ""


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
