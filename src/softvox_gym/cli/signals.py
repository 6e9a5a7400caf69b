"""Being stopped: an exception where a signal's default would leave files behind."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from types import FrameType


class Stopped(BaseException):
    """A signal, whose number it has, asked the program to stop; the exit status is 128 more."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Raise `Stopped` for Ctrl-C, SIGTERM and a closed terminal; once, so that cleaning up is safe.

    A signal that is ignored (nohup, a background job) stays so. After a stop all are ignored for
    good: the process is about to end, and a second Ctrl-C must not disturb that.
    """
    usual = {signal.SIG_DFL, signal.default_int_handler}
    numbers = [
        number
        for name in ("SIGINT", "SIGTERM", "SIGHUP")
        if (number := getattr(signal, name, None)) and signal.getsignal(number) in usual
    ]

    stopped = False

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal stopped
        stopped = True
        for other in numbers:
            signal.signal(other, signal.SIG_IGN)
        raise Stopped(number)

    before = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield
    finally:
        if not stopped:
            for number, handler in before.items():
                signal.signal(number, handler)
