"""Signals: an exception in place of the default action, which would leave files behind."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from types import FrameType


class Stopped(BaseException):
    """A signal asked the program to stop; `number` is the signal's, the exit status 128 more."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Raise `Stopped` for Ctrl-C, SIGTERM and a closed terminal; once, so that cleanup is safe.

    A signal that was ignored before (nohup, a background job) stays ignored. After a stop all are
    ignored: the process is about to end, and a second Ctrl-C must not interrupt its cleanup.
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
