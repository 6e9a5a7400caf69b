"""Processes that do runs in parallel, and end when their parent does, however it ends."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from softvox_search.experiment.schema import Run, UsageError

_SPAWN = multiprocessing.get_context("spawn")

#: Libraries for linear algebra use as many threads as there are cores, and may add in another order
#: with another number of them. The runs are in parallel already.
_SINGLE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

#: What a terminal sends to all processes; the parent answers for the workers.
_TERMINAL = [
    number for name in ("SIGINT", "SIGHUP") if (number := getattr(signal, name, None)) is not None
]

#: A run and its identity.
Task = tuple[str, Run]


@dataclass(frozen=True)
class Done:
    """A run that was done.

    Parameters
    ----------
    run : str
        Its identity.
    summary : dict
        As `softvox_search.experiment.run.do` returns it.
    content : bytes
        Its file.
    """

    run: str
    summary: dict[str, Any]
    content: bytes


@dataclass(frozen=True)
class Failed:
    """A run that raised an error.

    Parameters
    ----------
    run : str
        Its identity.
    error : str
        Its type and message.
    trace : str
        Where it was raised.
    """

    run: str
    error: str
    trace: str


def do_all(tasks: Sequence[Task], *, workers: int) -> Generator[Done | Failed, None, None]:
    """Do runs in worker processes; yield each as it is finished, in any order.

    When the generator is closed the workers are ended.

    Parameters
    ----------
    tasks : sequence of (str, Run)
        Runs with their identities.
    workers : int
        Processes, at most.

    Raises
    ------
    UsageError
        Where a worker can't even start.
    """
    left = list(reversed(tasks))
    team: list[_Worker] = []
    try:
        team += [_Worker() for _ in range(min(workers, len(left)))]
        while team:
            ready = wait([worker.connection for worker in team])
            for worker in [worker for worker in team if worker.connection in ready]:
                was_ready, outcome = worker.is_ready, worker.outcome()
                if outcome is not None:
                    yield outcome
                if worker.is_ready and left:
                    worker.give(left.pop())
                    continue
                team.remove(worker)
                worker.end()
                if was_ready and not worker.is_ready and left:  # it died of its run
                    team.append(_Worker())
    finally:
        for worker in team:
            worker.end()


class _Worker:
    """A process that does one run after another."""

    def __init__(self) -> None:
        self.connection, other = _SPAWN.Pipe()
        self.is_ready = False
        self._run: str | None = None
        self._process = _SPAWN.Process(target=_work, args=(other,), daemon=True)
        _start(self._process)
        other.close()

    def outcome(self) -> Done | Failed | None:
        """Return what became of its run; None where it says that it is ready."""
        try:
            outcome: Done | Failed | None = self.connection.recv()
        except (EOFError, OSError):
            return self._died()
        self.is_ready = True
        return outcome

    def give(self, task: Task) -> None:
        """Let it do a run."""
        self._run = task[0]
        with contextlib.suppress(OSError):  # it has died, which `outcome` will find
            self.connection.send(task)

    def end(self) -> None:
        """End it, also in the middle of a run."""
        self._process.kill()
        self._process.join()
        self.connection.close()

    def _died(self) -> Failed:
        self._process.join()
        code = self._process.exitcode
        if self._run is None:
            raise UsageError(f"a worker process ended with exit code {code} before any run")
        self.is_ready = False
        return Failed(self._run, f"its process ended with exit code {code}", "")


def _start(process: SpawnProcess) -> None:
    """Start a process that Ctrl-C does not reach, with single-threaded linear algebra."""
    resource_tracker.ensure_running()  # which would undo the mask if it started meanwhile
    before = {name: os.environ.get(name) for name in _SINGLE}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, _TERMINAL)  # which the process inherits
    try:
        os.environ.update(_SINGLE)
        process.start()
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _work(connection: Connection) -> None:
    """Do the runs that the parent sends, until it has no more or is gone."""
    sys.stdout = sys.stderr  # what searchers print must not come among the command's results
    threading.Thread(target=_end_with_parent, daemon=True).start()
    from softvox_search.experiment.environments import Environments

    environments = Environments()
    connection.send(None)
    with contextlib.suppress(EOFError):
        while True:
            connection.send(done(connection.recv(), environments))


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


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
