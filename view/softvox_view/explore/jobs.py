"""Long work for many browser tabs: the newest request of a tab wins, and none blocks another."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

#: Computations at once; a tab has one of each kind.
MOST = 16

#: s between looks at how far the work is.
POLL_SECONDS = 0.05

Event = dict[str, Any]


class CancelledError(Exception):
    """The work is no longer wanted."""


class BusyError(Exception):
    """Too much is running already."""


class Job:
    """A piece of work of one tab; the work calls `report`, the one who waits reads `events`.

    Parameters
    ----------
    work : callable (Job) -> dict
        Done in a thread. Must call `report` now and then, and let `CancelledError` pass.
    """

    def __init__(self, work: Callable[[Job], Event]) -> None:
        self._work = work
        self._cancelled = threading.Event()
        self._on_cancel: list[Callable[[], None]] = []
        self._lock = threading.Lock()
        self._progress: tuple[int, int] | None = None
        self._events: asyncio.Queue[Event] = asyncio.Queue()
        self._ended = asyncio.Event()

    @property
    def is_cancelled(self) -> bool:
        """Whether nobody wants the result any more."""
        return self._cancelled.is_set()

    def cancel(self) -> None:
        """Say that the result is no longer wanted; the work ends at its next report."""
        with self._lock:
            self._cancelled.set()
            callbacks, self._on_cancel = self._on_cancel, []
        for callback in callbacks:
            callback()

    def when_cancelled(self, callback: Callable[[], None]) -> None:
        """Call something, at once or later, when the job is cancelled, from any thread."""
        with self._lock:
            if not self.is_cancelled:
                self._on_cancel.append(callback)
                return
        callback()

    def report(self, done: int, total: int) -> None:
        """Tell how far the work is.

        Raises
        ------
        CancelledError
            Where nobody wants it any more.
        """
        if self.is_cancelled:
            raise CancelledError
        self._progress = done, total

    async def events(self) -> AsyncIterator[Event]:
        """Yield how the work goes, for one reader; the last event is its end.

        Events have the key "event": progress (done, total), then done (with what the work
        returned), superseded or error (with error, a line).
        """
        while True:
            event = await self._events.get()
            yield event
            if event["event"] != "progress":
                return

    async def run(self, threads: ThreadPoolExecutor, after: Job | None) -> None:
        """Do the work, once another job has ended; whether or not anybody reads the events."""
        try:
            if after is not None:
                await after._ended.wait()
            if self.is_cancelled:
                self._events.put_nowait({"event": "superseded"})
            else:
                await self._run(asyncio.get_running_loop().run_in_executor(threads, self._do))
        finally:
            self._ended.set()

    async def _run(self, future: asyncio.Future[Event]) -> None:
        told = None
        while not future.done():
            await asyncio.wait([future], timeout=POLL_SECONDS)
            if self._progress is not None and self._progress != told:
                told = self._progress
                done, total = told
                self._events.put_nowait({"event": "progress", "done": done, "total": total})
        self._events.put_nowait(future.result())

    def _do(self) -> Event:
        try:
            if self.is_cancelled:
                raise CancelledError
            return {**self._work(self), "event": "done"}
        except CancelledError:
            return {"event": "superseded"}
        except Exception as error:  # told to the page, which would otherwise wait for ever
            logging.getLogger(__name__).debug("a job failed", exc_info=True)
            return {"event": "error", "error": str(error) or type(error).__name__}


class Jobs:
    """What runs for all tabs.

    Parameters
    ----------
    most : int
        Tabs that can have something running at once; the work of others is refused.
    """

    def __init__(self, most: int = MOST) -> None:
        self.most = most
        self._threads = ThreadPoolExecutor(max_workers=most, thread_name_prefix="softvox-job")
        self._newest: dict[str, Job] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def running(self) -> int:
        """How many tabs have something running."""
        return len(self._newest)

    def start(self, tab: str, work: Callable[[Job], Event]) -> Job:
        """Start work for a tab; what it had running is cancelled first.

        Raises
        ------
        BusyError
            Where too many other tabs have something running.
        """
        before = self._newest.get(tab)
        if before is None and len(self._newest) >= self.most:
            raise BusyError(
                f"{self.most} computations are running already; wait for one, or close other tabs"
            )
        job = Job(work)
        self._newest[tab] = job
        if before is not None:
            before.cancel()
        task = asyncio.get_running_loop().create_task(self._run(tab, job, before))
        self._tasks.add(task)  # the loop itself would let go of it
        task.add_done_callback(self._tasks.discard)
        return job

    async def _run(self, tab: str, job: Job, before: Job | None) -> None:
        try:
            await job.run(self._threads, before)
        finally:
            if self._newest.get(tab) is job:
                del self._newest[tab]

    def close(self) -> None:
        """Cancel everything; the server is about to end."""
        for job in list(self._newest.values()):
            job.cancel()

    def join(self) -> None:
        """Wait until all threads have ended."""
        self.close()
        self._threads.shutdown(wait=True, cancel_futures=True)
