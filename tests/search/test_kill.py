"""A comparison that is killed, with real signals, as a real process."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cli_process import COMMAND, hear_signals, softvox
from small_experiments import OWN, results

SLOW = """\
seeds = 5
entropy = 3
[budget]
unique = 60
[[searchers]]
name = "own:Slow"
label = "slow"
[[searchers]]
name = "random"
"""

ARGUMENTS = ("compare", "exp.toml", "--no-report", "--workers", "2")

pytestmark = pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="needs /proc")


def prepare(folder):
    folder.mkdir(exist_ok=True)
    (folder / "own.py").write_text(OWN)
    (folder / "exp.toml").write_text(SLOW)
    return folder


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    folder = prepare(tmp_path_factory.mktemp("whole"))
    done = softvox(*ARGUMENTS, cwd=folder)
    assert done.returncode == 0, done.stderr
    return results(folder / "results")


def start(folder):
    return subprocess.Popen(
        [*COMMAND, *ARGUMENTS],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=hear_signals,
    )


def wait_for(condition, process=None):
    deadline = time.monotonic() + 120  # of a machine that does much else
    while not condition():
        assert time.monotonic() < deadline
        assert process is None or process.poll() is None, process.communicate()
        time.sleep(0.005)


def descendants(pid):
    """Return the processes that a process started, and those that they started."""
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            found += [int(child), *descendants(int(child))]
    return found


def is_running(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def wait_for_end_of(processes):
    wait_for(lambda: not any(map(is_running, processes)))


def runs_done(folder):
    return len(list(folder.glob("results/exp/runs/*.parquet")))


def test_killed_again_and_again_it_goes_on_and_the_result_is_the_same_bits(uninterrupted, tmp_path):
    folder = prepare(tmp_path)
    for wanted in (1, 4):
        process = start(folder)
        wait_for(lambda wanted=wanted: runs_done(folder) >= wanted, process)
        wait_for(lambda process=process: len(descendants(process.pid)) >= 2, process)
        workers = descendants(process.pid)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        wait_for_end_of(workers)
    assert not (folder / "results" / "exp" / "manifest.json").exists()
    done = softvox(*ARGUMENTS, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert "10 of 10 runs done (" in done.stdout
    assert results(folder / "results") == uninterrupted


MOMENTS = 60

#: Forks an experiment again and again, and kills it at random moments; begins a new folder when one
#: is finished. After every kill the files in the folder must be whole.
DRIVER = """\
import os, random, signal, sys, time
from pathlib import Path
from small_experiments import experiment_of, results, run_here
from softvox_search.experiment import compare
from softvox_search.experiment.results import finished
from softvox_search.experiment.run import identity, made_with

compare.provenance = lambda **_: {}  # a quarter of the time, for nothing that is tested here
compare.code_digest = lambda _: ""
folder, moments = Path(sys.argv[1]), int(sys.argv[2])
experiment = experiment_of(folder, (folder / "many.toml").read_text())
run_here(experiment, folder / "first")
begun = time.monotonic()
run_here(experiment, folder / "whole")
taken = min(time.monotonic() - begun, 0.5)
whole = results(folder / "whole")
identities = [identity(run, made_with()) for run in experiment.runs()]
draw = random.Random(5)
number, killed, found = 0, 0, set()
while killed < moments:
    out = folder / str(number)
    child = os.fork()
    if child == 0:
        try:
            run_here(experiment, out)
        finally:
            os._exit(0)
    time.sleep(draw.uniform(0, taken))
    os.kill(child, signal.SIGKILL)
    status = os.waitpid(child, 0)[1]
    killed += os.WIFSIGNALED(status)
    said = []
    done = finished(out, identities, said.append)
    assert not said, said
    found.add(len(done))
    here = results(out)
    assert all(content == whole[name] for name, content in here.items() if ".partial-" not in name)
    if (out / "manifest.json").exists() or killed == moments:
        _, said, here = run_here(experiment, out)
        assert len(here.runs) <= len(identities) - len(done) + 5, "a finished run was done again"
        assert not said, said
        assert results(out) == whole
        number += 1
print(number, len(found))
"""


def test_killed_at_random_moments_whole_runs_stay_and_the_result_is_the_same_bits(tmp_path):
    (tmp_path / "many.toml").write_text(
        "seeds = 10\nbudget.unique = 20\n[[searchers]]\nname = 'random'\n"
        "[[searchers]]\nname = 'hill_climber'\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, str(tmp_path), str(MOMENTS)],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    folders, states = map(int, done.stdout.split())
    assert folders >= 1
    assert states >= 3


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_it_says_that_the_same_command_goes_on_which_it_does(
    number, uninterrupted, tmp_path
):
    folder = prepare(tmp_path)
    process = start(folder)
    wait_for(lambda: runs_done(folder) > 1, process)
    workers = descendants(process.pid)
    if number == signal.SIGTERM:
        process.send_signal(number)
    else:  # a terminal sends it to all processes
        os.killpg(process.pid, number)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out) == (128 + number, "")
    assert err == (
        f"softvox: stopped: {number.name}, finished work is kept; the same command continues\n"
    )
    wait_for_end_of(workers)
    if number == signal.SIGINT:
        done = softvox(*ARGUMENTS, cwd=folder)
        assert "of them before)" in done.stdout
        assert results(folder / "results") == uninterrupted


def test_stopped_while_the_workers_start_it_says_one_line(tmp_path):
    folder = prepare(tmp_path)
    process = start(folder)
    wait_for(lambda: (folder / "results" / "exp").exists(), process)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert len(err.splitlines()) == 1
