import contextlib
import os
import signal
import subprocess
import time

import pytest
from cli_process import COMMAND, hear_signals, snapshot, softvox

LONG = "n" * 300

BAD = {
    "landscap": "invalid choice",
    "--vresion": "did you mean --version?",
    "landscape --thread 2": "did you mean --threads?",
    "landscape --threads 0": "--threads",
    "landscape --threads two": "--threads",
    "landscape surplus": "surplus",
    "landscape --physics newton": "--physics",
    "landscape --out file": "--out file is not a folder",
    "landscape --out file --force": "--out file is not a folder",
    "landscape --out file/below": "--out file is not a folder",
    "landscape --out no/such/folder": "--out no/such is not a folder; make it first",
    f"landscape --out {LONG}": f"--out {LONG}: File name too long",
    f"simulate 1 --frames {LONG}": f"--frames {LONG}: File name too long",
    "simulate": "DESIGN",
    "simulate 6561": "0 to 6560",
    "simulate -1": "0 to 6560",
    "simulate 1.5": "0 to 6560",
    "simulate nan": "8 digits",
    "simulate 00021223": "8 digits",
    "simulate 0002122": "8 digits",
    "simulate 000212220": "8 digits",
    "simulate 6453 --shape 2 2": "--shape",
    "simulate 6453 --shape 2 2 0": "--shape",
    "simulate 1 --shape 1000 1000 1000": "--shape",
    "simulate 1 --youngs-modulus nan": "--youngs-modulus must be positive and finite, got nan",
    "simulate 1 --density inf": "--density must be",
    "simulate 1 --density -1": "--density must be",
    "simulate 1 --edge 0": "--edge must be",
    "simulate 1 --edge 1e300": "can't be counted",
    "simulate 1 --friction-static -0.1": "--friction-static must be",
    "simulate 1 --friction-kinetic high": "--friction-kinetic",
    "simulate 1 --firction-static 1": "did you mean --friction-static?",
    "simulate 1 --shear-ratio -0.5": "--shear-ratio must be finite and not negative",
    "simulate 1 --shear-ratio 0.5 --shear-strength 0": "shear_ratio; give only one",
    "reality revrsal": "did you mean reversal?",
    "reality --out file": "--out file is not a folder",
    "simulate 1 --duration -inf": "--duration must be",
    "simulate 1 --duration 0.1": "--duration must be longer than settle_time",
    "simulate 1 --duration 1e9": "--duration",
    "simulate 1 --time-step-fraction 1.1": "--time-step-fraction",
    "simulate 1 --time-step-fraction 1e-15": "--duration of 4 s in time steps",
    "simulate 1 --frequency-hz 1e9": "--frequency-hz",
    "simulate 1 --gravity 1 2": "--gravity takes one number or three",
    "simulate 1 --actuation squeeze": "--actuation",
    "simulate 1 --strain -1": "--strain must be",
    "simulate 1 --every 5": "--frames",
    "simulate 1 --frames folder": "--frames folder is a folder",
    "simulate 1 --frames file": "--frames file exists",
    "simulate 1 --frames no/f.npz": "--frames no is not a folder",
    "simulate 1 --frames f.npz --every 1 --duration 90000": "--every",
    "verify surplus": "surplus",
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    return tmp_path


@pytest.mark.parametrize("command", BAD, ids=lambda command: command[:60])
def test_bad_input_is_one_line_naming_the_mend_and_nothing_is_written(command, folder):
    before = snapshot(folder)
    done = softvox(*command.split(), cwd=folder)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("softvox: error: ")
    assert BAD[command] in done.stderr
    assert snapshot(folder) == before


@pytest.mark.parametrize("command", ["landscape", "simulate 1", "verify"])
def test_an_unknown_instruction_set_is_bad_input(command, tmp_path):
    done = softvox(*command.split(), cwd=tmp_path, SOFTVOX_ISA="mmx")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert done.stderr.startswith("softvox: error: SOFTVOX_ISA=mmx")
    assert snapshot(tmp_path) == {}


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs a folder that nobody can write")
def test_a_folder_that_cannot_be_written_is_refused_before_the_work(tmp_path):
    started = time.monotonic()
    done = softvox("landscape", "--out", "/proc/landscape", "--duration", "400", cwd=tmp_path)
    assert time.monotonic() - started < 20
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "--out /proc can't be written to" in done.stderr


@contextlib.contextmanager
def running_landscape(cwd, *options):
    """Start a landscape that takes minutes; it computes when this gives it, and never outlives."""
    process = subprocess.Popen(
        [*COMMAND, "landscape", "--duration", "400", "--threads", "1", *options],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=hear_signals,
    )
    try:
        wait_until_it_computes(process)
        yield process
    finally:
        process.kill()
        process.communicate()


def wait_until_it_computes(process):
    ticks = os.sysconf("SC_CLK_TCK")
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.02)
        with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
            if int(file.read().rpartition(")")[2].split()[11]) > 0.8 * ticks:
                return
    raise AssertionError("it never ran")


needs_proc = pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="needs /proc")


@needs_proc
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_stopped_landscape_says_so_and_leaves_nothing(number, tmp_path):
    with running_landscape(tmp_path) as process:
        process.send_signal(number)
        out, err = process.communicate(timeout=10)
    assert process.returncode == 128 + number
    assert out == ""
    assert err == f"softvox: stopped: {number.name}, no file was left half written\n"
    assert snapshot(tmp_path) == {}


@needs_proc
def test_a_stopped_landscape_leaves_the_earlier_one_as_it_was(tmp_path):
    assert softvox("landscape", "--duration", "0.3", cwd=tmp_path).returncode == 0
    before = snapshot(tmp_path)
    with running_landscape(tmp_path, "--force") as process:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=10)
    assert process.returncode == 130
    assert snapshot(tmp_path) == before


@needs_proc
def test_a_killed_landscape_leaves_no_half_table(tmp_path):
    with running_landscape(tmp_path) as process:
        process.kill()
        process.communicate(timeout=10)
    assert snapshot(tmp_path) == {}
