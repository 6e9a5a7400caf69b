"""A process that has loaded what the command needs, and becomes it as often as it is asked to.

Loading takes longer than most commands. Each command is a fork: a process with streams, a folder
and an environment of its own, which leaves nothing behind.
"""

import atexit
import contextlib
import gc
import json
import os
import runpy
import socket
import struct
import sys
from importlib.metadata import entry_points

#: How numbers are sent: a child's, then its exit status.
NUMBER = struct.Struct("i")


def load() -> None:
    """Load what nearly all commands need, and where it is there what those of the extras do."""
    import softvox_gym.cli

    for entry in entry_points(group=softvox_gym.cli.GROUP):
        entry.load()
    with contextlib.suppress(ImportError):
        import matplotlib.figure  # noqa: F401
        import pandas  # noqa: F401


def serve(connection: socket.socket) -> int | None:
    """Make a child per request, and return in it the file of the request, its streams its own."""
    while True:
        word, files, *_ = socket.recv_fds(connection, 1, 4)
        if not word:
            return None
        child = os.fork()
        if child == 0:
            connection.close()
            for number, file in enumerate(files[1:]):
                os.dup2(file, number)
                os.close(file)
            return files[0]
        for file in files:
            os.close(file)
        connection.send(NUMBER.pack(child))
        _, status = os.waitpid(child, 0)
        connection.send(NUMBER.pack(os.waitstatus_to_exitcode(status)))


def become_the_command(wish: int) -> None:
    """Do what python -m softvox_gym does, but for taking apart what is loaded."""
    with open(wish) as file:
        request = json.load(file)
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = ["softvox", *request["arguments"]]
    sys.path[0] = os.getcwd()
    try:
        runpy.run_module("softvox_gym", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(end.code)


if __name__ == "__main__":
    load()
    gc.freeze()  # forks share what nobody touches
    wish = serve(socket.socket(fileno=int(sys.argv[1])))
    if wish is not None:
        become_the_command(wish)
