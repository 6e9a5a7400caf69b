"""Runs on the workers of a Dask cluster, here or on other machines, with the same bits.

Runs travel in chunks. A worker does runs of a chunk for a given time and returns them; the rest of
the chunk is handed out again. Every worker's versions are checked before it gets work, and again
by each chunk, as workers may join later.
"""

from __future__ import annotations

import logging
import os
import random
import shutil
import signal
import sys
import time
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import cache
from math import ceil
from queue import Empty, Queue
from typing import TYPE_CHECKING, Any

from softvox_gym.cli.terminal import BadInputError
from softvox_search.experiment.compare import digest_of, modules
from softvox_search.experiment.environments import Environments
from softvox_search.experiment.pool import SINGLE, Done, Failed, Task, done, for_workers
from softvox_search.experiment.results import Say
from softvox_search.experiment.run import made_with
from softvox_search.experiment.schema import Experiment, UsageError
from softvox_search.experiment.transfer import TransferExperiment

if TYPE_CHECKING:
    from distributed import Client

#: s of work in a chunk: a hundred times Dask's overhead per chunk (benchmarks/cluster.csv). The
#: scheduler takes a millisecond per chunk, so with many workers the chunks are larger.
SECONDS, SECONDS_PER_WORKER = 1.0, 0.02

#: s, interval at which workers that have joined get work.
LOOK = 1.0

#: s, after which a scheduler that does not answer is given up.
PATIENCE = 10

#: What a worker is asked about: libraries, modules, and further folders of modules.
Question = tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]


@contextmanager
def connected(scheduler: str, *, workers: int = 1, jobs: int = 1) -> Iterator[Client]:
    """Connect to the scheduler at an address; or start a cluster, and end it afterwards.

    Parameters
    ----------
    scheduler : str
        An address; "local" for so many workers on this machine; or "slurm" for so many jobs, which
        dask-jobqueue's configuration describes further.

    Raises
    ------
    ImportError
        If Dask is not installed.
    BadInputError
        If no scheduler answers, or no cluster can be started.
    """
    import dask
    from distributed import Client, LocalCluster, Status

    # Dask logs many lines for each error raised here, and about workers that it replaces.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    where: Any = scheduler
    with ExitStack() as stack:
        try:
            with for_workers():
                if scheduler == "local":
                    where = stack.enter_context(
                        LocalCluster(
                            n_workers=workers,
                            threads_per_worker=1,
                            memory_limit=0,
                            dashboard_address=":0",
                            silence_logs=logging.CRITICAL,
                        )
                    )
                    stack.callback(_kill, where)
                elif scheduler == "slurm":
                    from dask_jobqueue import SLURMCluster
                    from dask_jobqueue.slurm import SLURMJob

                    refused: list[Exception] = []

                    class Job(SLURMJob):  # type: ignore[misc]
                        async def start(self) -> None:
                            try:
                                await super().start()
                            except (RuntimeError, ValueError) as error:  # Dask would log it
                                refused.append(error)
                                self.status = Status.running

                    if shutil.which("sbatch") is None:
                        raise ValueError("no sbatch here; run the command where jobs are submitted")
                    n = dask.config.get("jobqueue.slurm.cores") or 1  # one run at a time on each
                    where = SLURMCluster(
                        processes=n,
                        n_workers=jobs * n,
                        job_cls=Job,
                        scheduler_options={"dashboard_address": ":0"},
                    )
                    stack.callback(_close, where)
                    where.__enter__()  # until the jobs are submitted
                    if refused:
                        raise ValueError(" ".join(str(refused[0]).split()))
                client = Client(where, timeout=PATIENCE, set_as_default=False)
                stack.callback(client.close)
        except (OSError, RuntimeError, TypeError, ValueError) as error:
            raise BadInputError(f"--scheduler {scheduler}: {error}") from error
        yield client


def _close(cluster: Any) -> None:
    with suppress(AssertionError):  # raised by Dask about jobs that were refused
        cluster.close()


def _kill(cluster: Any) -> None:
    """Kill the workers of a cluster on this machine at once."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
        with suppress(OSError, TypeError):  # if the process has ended
            os.kill(nanny.pid, signal.SIGKILL)


def do_all(
    tasks: Sequence[Task],
    *,
    client: Client,
    experiment: Experiment | TransferExperiment,
    folders: Sequence[str] = (),
    say: Say,
) -> Generator[Done | Failed, None, None]:
    """Do runs of an experiment on a cluster; yield each when it is finished, in any order.

    When the generator is closed, the cluster is asked to drop the unfinished runs.

    Parameters
    ----------
    folders : sequence of str
        Folders in which workers also look for the experiment's modules.
    say : callable (message)
        Called whenever there are no workers.

    Raises
    ------
    UsageError
        If a worker's versions differ from this process's, or the scheduler is lost.
    """
    question = (tuple(experiment.libraries), tuple(modules(experiment)), tuple(folders))
    expected = {**_facts(*question), **_ALONE}
    with closing(_do_all(tasks, client, question, expected, say)) as outcomes:
        try:
            yield from outcomes
        except Exception as error:
            is_lost = isinstance(error, (OSError, CancelledError)) or client.status != "running"
            if isinstance(error, UsageError) or not is_lost:
                raise
            raise UsageError(
                f"the scheduler {_address(client)} is lost; finished runs are kept, and once it is "
                "back the same command continues"
            ) from error


def _do_all(
    tasks: Sequence[Task],
    client: Client,
    question: Question,
    expected: dict[str, Any],
    say: Say,
) -> Generator[Done | Failed, None, None]:
    """Do runs as `do_all`, but raise the errors of a lost connection as they are."""
    from distributed.scheduler import KilledWorker

    if not tasks:
        return
    _check_workers(client, question, expected)
    left, size, is_waiting = deque(tasks), 1, False
    flying: dict[str, tuple[Any, list[Task]]] = {}
    suspects: dict[str, Task] = {}  # from chunks whose workers died
    ready: Queue[Any] = Queue()
    try:
        while left or flying or suspects:
            if client.status != "running":
                raise OSError("the connection is closed")
            slots = sum(client.nthreads().values())
            if not slots and not is_waiting:
                say(f"{_address(client)} has no workers; waiting for one")
            slots, is_waiting = max(1, slots), not slots
            seconds = max(SECONDS, slots * SECONDS_PER_WORKER)
            chunks: list[list[Task]] = []
            while left and len(flying) + len(chunks) < slots:  # so none waits behind a slow one
                fair = max(1, min(size, len(left) // (2 * slots)))
                chunks.append([left.popleft() for _ in range(fair)])
            if not flying and not chunks:  # alone, so that it is clear which run is to blame
                chunks = [[next(iter(suspects.values()))]]
            for chunk in chunks:
                future = client.submit(_work, chunk, seconds, question, expected, pure=False)
                flying[future.key] = future, chunk
                future.add_done_callback(ready.put)
            try:
                future = ready.get(timeout=LOOK)
            except Empty:
                continue
            _, chunk = flying.pop(future.key)
            error = future.exception() if future.status == "error" else None
            if error is None:
                outcomes, elapsed = future.result()
                left.extendleft(reversed(chunk[len(outcomes) :]))
                size = ceil(len(outcomes) * seconds / max(elapsed, 1e-3))
                for one in outcomes:
                    suspects.pop(one.run, None)
                yield from outcomes
            elif not isinstance(error, KilledWorker):
                _check_workers(client, question, expected)
                raise UsageError(f"{type(error).__name__} on the cluster: {error}")
            elif chunk[0][0] in suspects:
                run, _ = chunk[0]
                del suspects[run]
                yield Failed(run, _killed(error.allowed_failures + 1), "")
            else:
                suspects.update({task[0]: task for task in chunk})
    finally:
        if client.status == "running":
            with suppress(OSError, CancelledError):
                client.cancel([future for future, _ in flying.values()], force=True)


def _work(
    chunk: Sequence[Task], seconds: float, question: Question, expected: dict[str, Any]
) -> tuple[list[Done | Failed], float]:
    """Do runs on a worker, at least one, until the time is up; return the number done."""
    from distributed import get_worker

    worker = get_worker()
    if what := _difference(_worker_facts(*question, dask_worker=worker), expected):
        raise RuntimeError(f"worker {worker.address} {what}")
    _part_from_dask()
    started, outcomes = time.monotonic(), []
    for task in chunk:
        outcomes.append(done(task, _environments()))
        if time.monotonic() - started > seconds:
            break
    return outcomes, time.monotonic() - started


def _part_from_dask() -> None:
    """Keep Python's global generator for the runs: Dask draws from it too, in other threads."""
    for name, module in list(sys.modules.items()):
        is_its = name.partition(".")[0] in ("dask", "distributed", "tornado")
        if is_its and getattr(module, "random", None) is random:
            module.random = _OF_DASK  # type: ignore[attr-defined]


_OF_DASK = random.Random()


@cache
def _environments() -> Environments:
    """Return the environments of a process that does one run at a time."""
    return Environments()


#: What must hold for a worker that does one run at a time, in its own process.
_ALONE = {"threads": 1, **SINGLE}


def _worker_facts(*question: Any, dask_worker: Any) -> dict[str, Any]:
    """Return what results on a worker depend on."""
    own = {name: os.environ.get(name) for name in SINGLE}
    return {**_facts(*question), **own, "threads": dask_worker.state.nthreads}


def _facts(
    libraries: tuple[str, ...], modules: tuple[str, ...], folders: tuple[str, ...]
) -> dict[str, Any]:
    """Return what results in this process depend on, by names for error messages."""
    sys.path += [folder for folder in folders if folder not in sys.path]
    made = made_with(libraries)
    code = {f"the source of {module}": _code(module) for module in modules}
    return {**made["versions"], "the engine's probe": made["engine_probe"][:12], **code}


@cache
def _code(module: str) -> str | None:
    """Return the digest of a module's source when first asked, which is when it is loaded."""
    digest = digest_of([module])
    return None if digest == digest_of([]) else digest[:12]


def _check_workers(client: Client, question: Question, expected: dict[str, Any]) -> None:
    """Raise UsageError, with the first worker whose results may differ and the number of others."""
    answers = client.run(_worker_facts, *question, on_error="return")
    refused = {}
    for address, facts in answers.items():
        if isinstance(facts, OSError):
            continue  # it has left
        if isinstance(facts, Exception):
            refused[address] = f"can't do runs ({type(facts).__name__}: {facts})"
        elif what := _difference(facts, expected):
            refused[address] = what
    if refused:
        address, what = next(iter(refused.items()))
        more = f"; {len(refused) - 1} more can't be used either" if len(refused) > 1 else ""
        raise UsageError(f"worker {address} {what}{more}")


def _difference(facts: dict[str, Any], expected: dict[str, Any]) -> str:
    """Return how a worker differs, and the remedy; "" if it does not differ."""
    for name, value in expected.items():
        if (its := facts.get(name)) != value:
            if name in _ALONE:
                return (
                    f"has {name} {its}, but needs {value} to do one run at a time: start workers "
                    "with dask worker ADDRESS --nthreads 1 --nworkers N"
                )
            return (
                f"has {name} {its or '(missing)'}, but here it is {value or '(missing)'}: its "
                "results may differ; install the same version there, and restart it"
            )
    return ""


def _killed(deaths: int) -> str:
    workers = f"{deaths} workers" if deaths > 1 else "1 worker"
    return f"{workers} died doing it alone (distributed.scheduler.allowed-failures)"


def _address(client: Client) -> str:
    return str(client.scheduler.address) if client.scheduler else "of the cluster"
