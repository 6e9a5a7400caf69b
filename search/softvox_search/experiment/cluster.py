"""Runs done by the workers of a Dask cluster, here or on other machines, to the same bits.

Runs travel in chunks. A worker does as many of a chunk as fit into some seconds and returns these;
the rest is given out again. Every worker is asked what it is before it gets work, and once more by
each chunk, as workers may join later.
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

#: s, of work in a chunk: a hundred times what Dask needs for it (benchmarks/cluster.csv). The
#: scheduler takes a millisecond per chunk, so that of many workers each does larger ones.
SECONDS, SECONDS_PER_WORKER = 1.0, 0.02

#: s, after which workers that have joined meanwhile are given work.
LOOK = 1.0

#: s, until a scheduler that does not answer is given up.
PATIENCE = 10

#: What a worker is asked for: libraries, modules, and folders where modules are looked for too.
Question = tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]


@contextmanager
def connected(scheduler: str, *, workers: int = 1, jobs: int = 1) -> Iterator[Client]:
    """Connect to the scheduler at an address, or start a cluster and end it afterwards.

    Parameters
    ----------
    scheduler : str
        An address, "local" for so many workers on this machine, or "slurm" for so many jobs, of
        which dask-jobqueue's configuration says the rest.

    Raises
    ------
    ImportError
        Where Dask is not installed.
    BadInputError
        Where no scheduler answers, or no cluster can be started.
    """
    import dask
    from distributed import Client, LocalCluster, Status

    # Dask tells in many lines what becomes one error here, and of workers that it replaces.
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
                        raise ValueError("there is no sbatch here; say it where jobs are submitted")
                    n = dask.config.get("jobqueue.slurm.cores") or 1  # a run at a time in each
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
    with suppress(AssertionError):  # of Dask's, about jobs that were not taken
        cluster.close()


def _kill(cluster: Any) -> None:
    """End the workers of a cluster on this machine at once, whatever they do."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
        with suppress(OSError, TypeError):  # where there is none any more
            os.kill(nanny.pid, signal.SIGKILL)


def do_all(
    tasks: Sequence[Task],
    *,
    client: Client,
    experiment: Experiment | TransferExperiment,
    folders: Sequence[str] = (),
    say: Say,
) -> Generator[Done | Failed, None, None]:
    """Do runs of an experiment on a cluster; yield each as it is finished, in any order.

    When the generator is closed the cluster is asked to drop what it has not done.

    Parameters
    ----------
    folders : sequence of str
        Where workers look for the experiment's modules too.
    say : callable (message)
        Called whenever there is no worker to do them.

    Raises
    ------
    UsageError
        Where a worker is not as this process is, or the scheduler is lost.
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
                f"the scheduler {_address(client)} is lost; what is done is kept, and once it is "
                "back the same command goes on"
            ) from error


def _do_all(
    tasks: Sequence[Task],
    client: Client,
    question: Question,
    expected: dict[str, Any],
    say: Say,
) -> Generator[Done | Failed, None, None]:
    """As `do_all`, but for the errors of a connection that is lost."""
    from distributed.scheduler import KilledWorker

    if not tasks:
        return
    _check_workers(client, question, expected)
    left, size, is_waiting = deque(tasks), 1, False
    flying: dict[str, tuple[Any, list[Task]]] = {}
    suspects: dict[str, Task] = {}  # of chunks whose workers died
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
            while left and len(flying) + len(chunks) < slots:  # none waits behind a slow one
                fair = max(1, min(size, len(left) // (2 * slots)))
                chunks.append([left.popleft() for _ in range(fair)])
            if not flying and not chunks:  # nothing else is done beside it that could be to blame
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
    """Do runs on a worker, at least one, until so many seconds have passed; return how many did."""
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
    """Leave Python's global generator to the runs: Dask draws from it too, in threads beside."""
    for name, module in list(sys.modules.items()):
        is_its = name.partition(".")[0] in ("dask", "distributed", "tornado")
        if is_its and getattr(module, "random", None) is random:
            module.random = _OF_DASK  # type: ignore[attr-defined]


_OF_DASK = random.Random()


@cache
def _environments() -> Environments:
    """Return the environments of a process that does one run at a time."""
    return Environments()


#: What a worker has that does one run at a time, in a process of its own.
_ALONE = {"threads": 1, **SINGLE}


def _worker_facts(*question: Any, dask_worker: Any) -> dict[str, Any]:
    """Return what results on a worker depend on."""
    own = {name: os.environ.get(name) for name in SINGLE}
    return {**_facts(*question), **own, "threads": dask_worker.state.nthreads}


def _facts(
    libraries: tuple[str, ...], modules: tuple[str, ...], folders: tuple[str, ...]
) -> dict[str, Any]:
    """Return what results in this process depend on, by what a person calls it."""
    sys.path += [folder for folder in folders if folder not in sys.path]
    made = made_with(libraries)
    code = {f"the source of {module}": _code(module) for module in modules}
    return {**made["versions"], "the engine's probe": made["engine_probe"][:12], **code}


@cache
def _code(module: str) -> str | None:
    """Return the digest of a module's source as it is when first asked, which is when it loads."""
    digest = digest_of([module])
    return None if digest == digest_of([]) else digest[:12]


def _check_workers(client: Client, question: Question, expected: dict[str, Any]) -> None:
    """Raise UsageError, naming every worker now there whose results may be others."""
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
        more = f"; so it is with {len(refused) - 1} more" if len(refused) > 1 else ""
        raise UsageError(f"worker {address} {what}{more}")


def _difference(facts: dict[str, Any], expected: dict[str, Any]) -> str:
    """Return in what a worker differs, and the remedy; "" where in nothing."""
    for name, value in expected.items():
        if (its := facts.get(name)) != value:
            if name in _ALONE:
                return (
                    f"has {name} {its}, and does one run at a time with {value}: start workers by "
                    "dask worker ADDRESS --nthreads 1 --nworkers N"
                )
            return (
                f"has {name} {its or 'not at all'}, and here it is {value or 'not there'}: its "
                "results may be others; install there what is here, and start it anew"
            )
    return ""


def _killed(deaths: int) -> str:
    workers = f"{deaths} workers" if deaths > 1 else "1 worker"
    return f"{workers} died doing it alone (distributed.scheduler.allowed-failures)"


def _address(client: Client) -> str:
    return str(client.scheduler.address) if client.scheduler else "of the cluster"
