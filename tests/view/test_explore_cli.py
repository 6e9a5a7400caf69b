import http.client
import os
import re
import signal
import socket
import subprocess

import pytest
from cli_process import COMMAND, hear_signals, softvox

pytest.importorskip("starlette", reason="the app needs softvox-gym[explore]")
pytest.importorskip("uvicorn", reason="the app needs softvox-gym[explore]")


def started(*arguments):
    return subprocess.Popen(
        [*COMMAND, "explore", "--no-browser", "--port", "0", *arguments],
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=hear_signals,
    )


@pytest.mark.parametrize(
    ("number", "status", "said"),
    [(signal.SIGINT, 0, ""), (signal.SIGTERM, 128 + signal.SIGTERM, "softvox: stopped: SIGTERM")],
)
def test_it_tells_its_address_and_ends_cleanly_when_stopped(number, status, said):
    with started("--state", "design=4295&gravity=-3") as process:
        try:
            line = process.stdout.readline()
            assert re.search(r" http://127\.0\.0\.1:\d+/#design=4295&gravity=-3\n", line)
            host, port = re.search(r"//([^:]+):(\d+)/", line).groups()
            with socket.create_connection((host, int(port)), timeout=10):  # must not hold it up
                process.send_signal(number)
                _, errors = process.communicate(timeout=90)
        finally:
            process.kill()
    assert process.returncode == status
    assert errors.startswith(said)
    assert errors.count("\n") == (1 if said else 0)


def test_ctrl_c_ends_a_landscape_that_is_being_computed():
    with started() as process:
        try:
            host = re.search(r"//(\S+)/", process.stdout.readline())[1]
            connection = http.client.HTTPConnection(host, timeout=90)
            connection.request("GET", "/api/landscape?gravity=-2")
            response = connection.getresponse()
            assert b"progress" in response.readline()
            process.send_signal(signal.SIGINT)
            with pytest.raises(http.client.IncompleteRead):
                response.read()
            connection.close()
            _, errors = process.communicate(timeout=90)
        finally:
            process.kill()
    assert (process.returncode, errors) == (0, "")


def test_a_port_in_use_gives_one_line_and_status_2():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        done = softvox("explore", "--no-browser", "--port", port)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"softvox: error: --port {port}: ")
    assert "Address already in use" in done.stderr
    assert done.stderr.endswith("; choose another, or 0 for any that is free\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--port", "65536"), "--port 65536: "),
        (("--port", "http"), "--port: invalid int value: 'http'"),
        (("--threads", "0"), "must be a whole number above 0"),
    ],
)
def test_bad_options_give_one_line_and_status_2(arguments, words):
    done = softvox("explore", "--no-browser", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_the_framework_it_says_what_to_install():
    code = (
        "import sys; sys.modules['uvicorn'] = None; from softvox_gym.cli import main; "
        "sys.exit(main(['explore', '--no-browser', '--port', '0']))"
    )
    done = subprocess.run([*COMMAND[:1], "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == ("softvox: error: explore needs uvicorn: pip install uvicorn\n")


def test_help_fits_80_columns_and_loads_no_framework():
    done = softvox("explore", "--help", COLUMNS="80")
    assert done.returncode == 0
    assert [line for line in done.stdout.splitlines() if len(line) > 80] == []
    code = "import sys, softvox_view.cli.explore; print('starlette' in sys.modules)"
    loaded = subprocess.run([*COMMAND[:1], "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout == "False\n"
