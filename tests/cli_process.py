"""The command line as a process, the way people meet it."""

import atexit
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import command_server

COMMAND = [sys.executable, "-m", "softvox_gym"]

PATIENCE = 60  # s


def hear_signals() -> None:
    """Undo what nohup or a shell's background did, which the command would honour.

    To be called in a child before it becomes the command (``preexec_fn``).
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def anew(
    *arguments: str, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run the command in an interpreter of its own, whose hashes are its own too."""
    return subprocess.run(
        [*COMMAND, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


@cache
def server() -> socket.socket:
    """Return a connection to what makes commands; it ends where the connection does."""
    ours, theirs = socket.socketpair()
    with theirs:
        made = [sys.executable, command_server.__file__, str(theirs.fileno())]
        nothing = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
        process = subprocess.Popen(made, pass_fds=[theirs.fileno()], **nothing)
    ours.settimeout(PATIENCE)
    atexit.register(process.wait)
    atexit.register(ours.close)
    return ours


def softvox(
    *arguments: str, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run the command as a process that begins loaded: half a second less than `anew`."""
    if any(name.startswith(("PYTHON", "MPL")) for name in environment):
        return anew(*arguments, cwd=cwd, **environment)  # heard only while loading
    with (
        tempfile.TemporaryFile("w+") as request,
        open(os.devnull) as nothing,
        tempfile.TemporaryFile("w+") as output,
        tempfile.TemporaryFile("w+") as complaints,
    ):
        own = {"cwd": str(cwd or os.getcwd()), "environment": {**os.environ, **environment}}
        json.dump({"arguments": arguments, **own}, request)
        request.seek(0)
        files = [request, nothing, output, complaints]
        socket.send_fds(server(), [b"!"], [file.fileno() for file in files])
        child, status = _number(), None
        try:
            status = _number()
        finally:
            if status is None:
                os.kill(child, signal.SIGKILL)
        output.seek(0)
        complaints.seek(0)
        return subprocess.CompletedProcess(arguments, status, output.read(), complaints.read())


def _number() -> int:
    (number,) = command_server.NUMBER.unpack(server().recv(command_server.NUMBER.size))
    return number


def snapshot(folder: Path) -> dict[str, bytes | None]:
    """Return everything in a folder: names, hidden ones too, and contents."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }
