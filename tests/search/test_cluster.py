"""A comparison on a Dask cluster gives the bits that it gives here, whatever dies meanwhile."""

import os
import random
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from cli_process import COMMAND, hear_signals
from small_experiments import OWN, SMALL, experiment_of, results, run_here
from test_kill import descendants, wait_for, wait_for_end_of

from softvox_gym import cli, evaluate
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.noise import Jakobi
from softvox_search.experiment import cluster as clusters
from softvox_search.experiment.cluster import connected, do_all
from softvox_search.experiment.pool import SINGLE
from softvox_search.experiment.schema import UsageError

dask = pytest.importorskip("dask")
pytest.importorskip("distributed")
# What Dask leaves for the interpreter's end to close.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")

#: Waits for a file, or until it has died so often as a file counts.
ILL = """\
import os
import signal
import time

import numpy as np

from softvox_search.protocol import SearcherBase


class Ill(SearcherBase):
    def __init__(self, space, rng, *, folder, deaths=0, waits=False):
        super().__init__(space, rng)
        self.folder, self.deaths, self.waits = folder, deaths, waits

    def ask(self, n=None):
        while self.waits and not os.path.exists(f"{self.folder}/go"):
            time.sleep(0.01)
        died = len([name for name in os.listdir(self.folder) if name.startswith("died")])
        if died < self.deaths:
            open(f"{self.folder}/died{died}", "w").close()
            os.kill(os.getpid(), signal.SIGKILL)
        return np.arange(20)
"""


#: s, after which a wait for a process that never comes ends a test, whoever waits.
PATIENCE = 240


@pytest.fixture(autouse=True)
def _nothing_waits_for_ever():
    def end(*_):
        raise TimeoutError(f"waited for {PATIENCE} s")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture(scope="module")
def client():
    with connected("local", workers=2) as client:
        yield client


@pytest.fixture
def no_workers():
    """Yield a client whose cluster has none yet."""
    with connected("local", workers=0) as client:
        yield client


def doer(client, experiment, **options):
    return partial(do_all, client=client, experiment=experiment, **{"say": pytest.fail, **options})


def run_there(client, experiment, folder, **options):
    own = {name: options.pop(name) for name in ("say", "folders") if name in options}
    outcome, _, here = run_here(
        experiment, folder, cluster=doer(client, experiment, **own), **options
    )
    assert here.runs == []
    return outcome


def ill(folder, name, *options):
    """Return an experiment in which one run is ill, first of all, in a module of its own."""
    (folder / f"{name}.py").write_text(ILL)
    given = ", ".join([f"folder = '{folder}'", *options])
    searcher = f"[[searchers]]\nname = '{name}:Ill'\nseeds = 1\noptions = {{ {given} }}\n"
    first, rest = SMALL.split("[[searchers]]", 1)
    return experiment_of(folder, f"{first}{searcher}[[searchers]]{rest}")


@pytest.fixture
def own_modules(monkeypatch):
    """Let modules be found that a test writes, and forget them."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    return sys.path.append


def test_the_bits_are_those_of_runs_in_this_process(client, tmp_path):
    experiment = experiment_of(tmp_path, SMALL)
    outcome = run_there(client, experiment, tmp_path / "there")
    assert (outcome.total, outcome.failed, outcome.is_whole) == (7, [], True)
    run_here(experiment, tmp_path / "here")
    assert results(tmp_path / "there") == results(tmp_path / "here")
    more = experiment_of(tmp_path, SMALL.replace("seeds = 3", "seeds = 4", 1))
    outcome = run_there(client, more, tmp_path / "there")
    assert (outcome.before, outcome.repeated, outcome.missing) == (7, 5, 0)
    run_here(more, tmp_path / "here")
    assert results(tmp_path / "there") == results(tmp_path / "here")


def test_dask_draws_nothing_from_what_runs_draw_from(client):
    def is_left_alone():
        from dask.sizeof import sizeof

        clusters._part_from_dask()
        before = random.getstate()
        sizeof(list(range(1000)))  # as Dask's threads do, now and then
        return random.getstate() == before

    assert client.submit(is_left_alone, pure=False).result(PATIENCE)


def test_a_worker_that_is_killed_changes_no_bit(client, tmp_path, own_modules):
    own_modules(str(tmp_path))
    experiment = ill(tmp_path, "killed_once", "deaths = 1")
    outcome = run_there(client, experiment, tmp_path / "there", folders=[str(tmp_path)], say=str)
    assert outcome.failed == []
    assert (tmp_path / "died0").exists()
    run_here(experiment, tmp_path / "here")
    assert results(tmp_path / "there") == results(tmp_path / "here")


def test_a_run_that_kills_every_worker_fails_alone(client, tmp_path, own_modules, monkeypatch):
    own_modules(str(tmp_path))
    monkeypatch.setattr(client.cluster.scheduler, "allowed_failures", 0)
    experiment = ill(tmp_path, "kills_always", "deaths = 99")
    outcome = run_there(client, experiment, tmp_path / "there", folders=[str(tmp_path)], say=str)
    ((run, failed),) = outcome.failed
    assert run.kind == "kills_always:Ill"
    assert failed.error == "1 worker died doing it alone (distributed.scheduler.allowed-failures)"
    assert outcome.is_whole
    assert len(list((tmp_path / "there" / "runs").iterdir())) == outcome.total - 1


def test_a_slow_worker_holds_no_other_run_up(client, tmp_path, own_modules):
    own_modules(str(tmp_path))
    client.wait_for_workers(2, timeout=PATIENCE)
    experiment = ill(tmp_path, "slow", "waits = true")
    done = []

    def go(count, total):
        done.append(count)
        if count == total - 1:  # all the others are there, so let it go on
            (tmp_path / "go").touch()

    outcome = run_there(
        client, experiment, tmp_path / "there", folders=[str(tmp_path)], progress=go
    )
    assert (outcome.failed, done[-1]) == ([], outcome.total)


def test_a_worker_gives_back_what_does_not_fit_into_its_time(client, tmp_path):
    experiment = experiment_of(tmp_path, SMALL)
    tasks = [(str(i), run) for i, run in enumerate(experiment.runs())]
    question = (tuple(experiment.libraries), ("softvox_gym", "softvox_search"), ())
    expected = {**clusters._facts(*question), **clusters._ALONE}
    future = client.submit(clusters._work, tasks, 0.0, question, expected, pure=False)
    outcomes, _ = future.result()
    assert [one.run for one in outcomes] == ["0"]


#: A worker that says of itself what is not so.
PATCHED = """\
import importlib.metadata as metadata, sys

real = metadata.version
metadata.version = lambda name: "1.0" if name == "numpy" else real(name)
from distributed.cli.dask_worker import main

main([sys.argv[1], "--no-nanny", "--nthreads", "1", "--no-dashboard"])
"""


@pytest.fixture
def worker_of_other_versions(no_workers):
    process = subprocess.Popen(
        [sys.executable, "-c", PATCHED, no_workers.scheduler.address],
        env={**os.environ, **SINGLE},
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for(no_workers.nthreads, process)
        yield no_workers
    finally:
        process.kill()
        process.wait()


OTHER = r"^worker tcp://\S+ has numpy 1\.0, but here it is {}: its results may differ; install "


def test_a_worker_with_other_versions_is_refused_by_name(
    worker_of_other_versions, tmp_path, monkeypatch
):
    experiment = experiment_of(tmp_path, SMALL)
    refused = OTHER.format(np.__version__)
    with pytest.raises(UsageError, match=refused):
        run_there(worker_of_other_versions, experiment, tmp_path / "there")
    assert list((tmp_path / "there" / "runs").iterdir()) == []
    checks = iter([lambda *_: None, lambda *_: None])  # it joins later, and then leaves
    monkeypatch.setattr(clusters, "_check_workers", lambda *given: next(checks)(*given))
    with pytest.raises(UsageError, match=refused.replace("^", "RuntimeError on the cluster: ")):
        run_there(worker_of_other_versions, experiment, tmp_path / "there")


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"threads": 4}, "has threads 4, but needs 1 to do one run at a time: start workers with "),
        (
            {"OMP_NUM_THREADS": None},
            "has OMP_NUM_THREADS None, but needs 1 to do one run at a time",
        ),
        ({"scipy": None}, "has scipy (missing), but here it is 1.2: its results may differ"),
        ({"cmaes": "0.12"}, "has cmaes 0.12, but here it is (missing)"),
        ({"the source of own": "12"}, "has the source of own 12, but here it is 34"),
        ({}, ""),
    ],
)
def test_in_what_a_worker_differs_is_said_with_the_remedy(found, said):
    here = {"scipy": "1.2", "cmaes": None, "the source of own": "34", **clusters._ALONE}
    assert clusters._difference({**here, **found}, here).startswith(said)
    assert bool(clusters._difference({**here, **found}, here)) == bool(said)


#: A scheduler with a worker, in a process that says its address.
SERVED = """\
from distributed import LocalCluster

options = {"processes": False, "protocol": "tcp", "dashboard_address": None}
with LocalCluster(n_workers=1, threads_per_worker=1, **options) as cluster:
    print(cluster.scheduler_address, flush=True)
    input()
"""


@pytest.fixture
def served():
    process = subprocess.Popen(
        [sys.executable, "-c", SERVED],
        env={**os.environ, **SINGLE},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    with process:
        yield process
        process.kill()


def test_a_scheduler_that_is_lost_is_one_line_and_what_is_done_is_kept(served, client, tmp_path):
    address = served.stdout.readline().strip()
    experiment = experiment_of(tmp_path, SMALL)
    with connected(address) as theirs:

        def lose(count, _):
            if count == 1:
                served.kill()
                wait_for(lambda: theirs.status != "running")

        with pytest.raises(
            UsageError, match=f"the scheduler {address} is lost; finished runs are kept"
        ):
            run_there(theirs, experiment, tmp_path / "there", progress=lose)
    outcome = run_there(client, experiment, tmp_path / "there")
    assert outcome.before == 1
    run_here(experiment, tmp_path / "here")
    assert results(tmp_path / "there") == results(tmp_path / "here")


def test_a_scheduler_that_is_lost_in_a_call_is_told_as_one(tmp_path):
    experiment = experiment_of(tmp_path, SMALL)
    tasks = list(enumerate(experiment.runs()))
    lost = Mock(status="running", scheduler=Mock(address="tcp://there:1"))
    lost.run.return_value = {}
    lost.nthreads.side_effect = OSError("timed out")
    with pytest.raises(UsageError, match=r"^the scheduler tcp://there:1 is lost; "):
        list(do_all(tasks, client=lost, experiment=experiment, say=pytest.fail))
    lost.nthreads.side_effect = AssertionError("a fault of ours")
    with pytest.raises(AssertionError, match="a fault of ours"):
        list(do_all(tasks, client=lost, experiment=experiment, say=pytest.fail))


def start(folder, *arguments):
    (folder / "own.py").write_text(OWN)
    (folder / "exp.toml").write_text(
        "seeds = 50\nbudget.unique = 60\n[[searchers]]\nname = 'own:Slow'\n"
    )
    return subprocess.Popen(
        [*COMMAND, "compare", "exp.toml", "--no-report", "--scheduler", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=hear_signals,
    )


def stopped(process, folder):
    """Stop a comparison as a terminal does, once a run is done; return what it started."""
    try:
        wait_for(lambda: list(folder.glob("results/exp/runs/*.parquet")), process)
        started = descendants(process.pid) if Path("/proc/self/stat").exists() else []
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert (process.returncode, out) == (130, "")
    assert err == "softvox: stopped: SIGINT, finished work is kept; the same command continues\n"
    return started


def test_stopped_it_leaves_another_cluster_usable(client, tmp_path):
    process = start(tmp_path, client.scheduler.address)
    stopped(process, tmp_path)
    tasks = client.cluster.scheduler.tasks
    wait_for(lambda: not tasks)
    assert client.submit(max, 1, 2, pure=False).result() == 2


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="needs /proc")
def test_stopped_it_leaves_nothing_of_its_own_cluster(tmp_path):
    process = start(tmp_path, "local", "--workers", "1")
    started = stopped(process, tmp_path)
    assert len(started) >= 2
    wait_for_end_of(started)


def test_jobs_that_are_refused_are_one_line_with_the_reason(tmp_path, monkeypatch, caplog):
    pytest.importorskip("dask_jobqueue")
    (tmp_path / "sbatch").write_text("#!/bin/sh\necho no such partition >&2\nexit 1\n")
    (tmp_path / "sbatch").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    refused = pytest.raises(BadInputError, match=r"^--scheduler slurm: .* no such partition$")
    with (
        dask.config.set({"jobqueue.slurm.cores": 1, "jobqueue.slurm.memory": "1GB"}),
        refused,
        connected("slurm", jobs=2),
    ):
        pass
    assert caplog.records == []


def test_without_workers_it_says_so_and_waits(no_workers, tmp_path):
    experiment = experiment_of(tmp_path, SMALL)
    said = []

    def say(message):
        said.append(message)
        no_workers.cluster.scale(1)

    outcome = run_there(no_workers, experiment, tmp_path / "there", say=say)
    assert outcome.missing == 0
    assert said == [f"{no_workers.scheduler.address} has no workers; waiting for one"]


def test_an_address_without_a_scheduler_is_named(monkeypatch):
    monkeypatch.setattr(clusters, "PATIENCE", 0.2)
    with (
        pytest.raises(BadInputError, match=r"^--scheduler tcp://127\.0\.0\.1:1: .*tcp://127"),
        connected("tcp://127.0.0.1:1"),
    ):
        pass


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scheduler", "tcp://a:b"], "must be local, slurm or an address as tcp"),
        (["--scheduler", "locl"], "must be local, slurm or an address as tcp://10.0.0.1:8786, got"),
        (["--scheduler", "tcp://a:1", "--workers", "2"], "leave it out with --scheduler tcp://a:1"),
        (["--scheduler", "slurm", "--workers", "2"], "leave it out with --scheduler slurm"),
        (["--scheduler", "local", "--jobs", "2"], "--jobs needs --scheduler slurm"),
        (["--jobs", "2"], "--jobs needs --scheduler slurm"),
        (["--scheduler", "what://x:1"], "--scheduler what://x:1: "),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path, capsys, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    experiment_of(tmp_path, SMALL)
    assert cli.main(["compare", "exp.toml", "--no-report", "--quiet", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


@pytest.mark.parametrize(
    ("where", "module"), [("local", "distributed"), ("slurm", "dask_jobqueue")]
)
def test_a_missing_library_is_named_with_the_extra(tmp_path, capsys, monkeypatch, where, module):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, module, None)
    experiment_of(tmp_path, SMALL)
    command = ["compare", "exp.toml", "--no-report", "--quiet", "--scheduler", where]
    assert cli.main(command) == 2
    assert capsys.readouterr().err == (
        f"softvox: error: --scheduler {where} needs {module.replace('_', '-')}: "
        "pip install 'softvox-gym[cluster]'\n"
    )


def test_designs_are_evaluated_on_it_to_the_same_bits(client, monkeypatch):
    monkeypatch.setattr("softvox_gym.cluster.CHUNK_WORK", 1e5)
    options = {"perturbations": [Jakobi(1.0)], "trials": 2, "seed": 0}
    there, here = (evaluate(range(6400, 6420), client=one, **options) for one in (client, None))
    assert there.fitness.tobytes() == here.fitness.tobytes()
    assert there.result.displacement.tobytes() == here.result.displacement.tobytes()
