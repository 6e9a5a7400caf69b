"""A comparison that is killed, with real signals, as a real process."""

import os
import signal
import subprocess
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
    deadline = time.monotonic() + 30
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


def journal_size(folder):
    path = folder / "results" / "exp" / "journal.bin"
    return path.stat().st_size if path.exists() else 0


def test_killed_again_and_again_it_goes_on_and_the_result_is_the_same_bits(uninterrupted, tmp_path):
    folder = prepare(tmp_path)
    sizes = [0]
    for _ in range(3):
        process = start(folder)
        wait_for(lambda before=sizes[-1]: journal_size(folder) > before + 2000, process)
        workers = descendants(process.pid)
        assert len(workers) >= 2
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        wait_for_end_of(workers)
        sizes.append(journal_size(folder))
    assert not (folder / "results" / "exp" / "manifest.json").exists()
    done = softvox(*ARGUMENTS, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "10 of 10 runs done (" in done.stdout
    assert results(folder / "results") == uninterrupted


def test_killed_before_its_first_run_it_starts_anew(uninterrupted, tmp_path):
    folder = prepare(tmp_path)
    process = start(folder)
    wait_for(lambda: (folder / "results" / "exp").exists(), process)
    process.kill()
    process.communicate()
    done = softvox(*ARGUMENTS, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert results(folder / "results") == uninterrupted


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_it_says_that_the_same_command_goes_on_which_it_does(
    number, uninterrupted, tmp_path
):
    folder = prepare(tmp_path)
    process = start(folder)
    wait_for(lambda: journal_size(folder) > 3000, process)
    workers = descendants(process.pid)
    if number == signal.SIGTERM:
        process.send_signal(number)
    else:  # a terminal sends it to all processes
        os.killpg(process.pid, number)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out) == (128 + number, "")
    assert err == (
        f"softvox: stopped: {number.name}, what is done is kept; the same command goes on\n"
    )
    wait_for_end_of(workers)
    done = softvox(*ARGUMENTS, cwd=folder)
    assert "of them before)" in done.stdout
    assert results(folder / "results") == uninterrupted


def test_stopped_while_the_workers_start_it_says_one_line(tmp_path):
    folder = prepare(tmp_path)
    process = start(folder)
    wait_for(lambda: journal_size(folder) > 0, process)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert len(err.splitlines()) == 1
