"""Processes that do runs in parallel, and end when their parent does, however it ends."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Generator, Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, NamedTuple

_SPAWN = multiprocessing.get_context("spawn")

#: Libraries for linear algebra use one thread per core, and their order of summation may depend on
#: the number of threads. One thread is enough, as the runs are parallel already.
SINGLE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

#: Signals that a terminal sends to all processes; the parent handles them for the workers.
_TERMINAL = {getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)}

#: A run and its identity.
Task = tuple[str, Any]


class Done(NamedTuple):
    """A run that was done: its identity, its summary, and the bytes of its file."""

    run: str
    summary: dict[str, Any]
    content: bytes


class Failed(NamedTuple):
    """A run that raised an error: its identity, type and message of the error, and where."""

    run: str
    error: str
    trace: str


def do_all(tasks: Sequence[Task], *, workers: int) -> Generator[Done | Failed, None, None]:
    """Do runs in worker processes; yield each when it is finished, in any order.

    When the generator is closed, the workers are ended.
    """
    left = list(reversed(tasks))
    team: dict[Connection, tuple[SpawnProcess, str]] = {}
    try:
        while left or team:
            while left and len(team) < workers:
                connection, process = _start()
                team[connection] = process, _give(connection, left.pop())
            for ready in wait(list(team)):
                assert isinstance(ready, Connection)
                process, run = team[ready]
                try:
                    outcome: Done | Failed = ready.recv()
                except (EOFError, OSError):
                    process.join()
                    code = process.exitcode
                    outcome = Failed(run, f"its process ended with exit code {code}", "")
                if left and process.is_alive():
                    team[ready] = process, _give(ready, left.pop())
                else:
                    _end(ready, process)
                    del team[ready]
                yield outcome
    finally:
        for connection, (process, _) in team.items():
            _end(connection, process)


def done(task: Task, environments: Any) -> Done | Failed:
    """Do a run in this process."""
    from softvox_search.experiment.results import encode
    from softvox_search.experiment.run import do

    identity, run = task
    try:
        summary, columns = do(run, environments)
        return Done(identity, summary, encode(identity, summary, columns))
    except (Exception, SystemExit) as error:
        message = f"{type(error).__name__}: {error}"
        return Failed(identity, " ".join(message.split()), traceback.format_exc())


@contextlib.contextmanager
def for_workers() -> Iterator[None]:
    """Shield processes started in this context from Ctrl-C, with single-threaded linear algebra."""
    resource_tracker.ensure_running()  # it would undo the mask if it started within
    before = dict(os.environ)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINAL)  # inherited by processes
    try:
        os.environ.update(SINGLE)
        yield
    finally:
        for name in SINGLE:
            del os.environ[name]
        os.environ.update(before)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _start() -> tuple[Connection, SpawnProcess]:
    """Start a process that does runs."""
    connection, its = _SPAWN.Pipe()
    process = _SPAWN.Process(target=_work, args=(its,), daemon=True)
    with for_workers():
        process.start()
    its.close()
    return connection, process


def _give(connection: Connection, task: Task) -> str:
    """Send a run to a worker; return the run's identity."""
    with contextlib.suppress(OSError):  # a dead worker is noticed on receiving
        connection.send(task)
    return task[0]


def _end(connection: Connection, process: SpawnProcess) -> None:
    """End a worker, even during a run."""
    process.kill()
    process.join()
    connection.close()


def _work(connection: Connection) -> None:
    """Do the runs that the parent sends, until it closes the connection or ends."""
    sys.stdout = sys.stderr  # keeps what searchers print out of the command's results
    threading.Thread(target=_end_with_parent, daemon=True).start()
    from softvox_search.experiment.environments import Environments

    environments = Environments()
    with contextlib.suppress(EOFError):
        while True:
            connection.send(done(connection.recv(), environments))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
