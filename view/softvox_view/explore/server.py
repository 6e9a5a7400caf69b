"""Runs the app on this machine: a socket on loopback, and an orderly end."""

from __future__ import annotations

import errno
import socket
import threading
from collections.abc import Callable
from types import FrameType

import uvicorn

from softvox_view.explore.app import Explorer, make_app

LOOPBACK = "127.0.0.1"

STANDARD_PORT = 80

#: s that open connections get to end by themselves.
GRACE_SECONDS = 2


class PortError(Exception):
    """A port that can't be had; the message is one line naming the mend."""


def bind(port: int) -> socket.socket:
    """Return a socket that listens on loopback.

    Parameters
    ----------
    port : int
        0 for any that is free.

    Raises
    ------
    PortError
        Where it is in use, or not allowed.
    """
    made = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((LOOPBACK, port))
        made.listen(128)
    except OSError as error:
        made.close()
        why = "is in use" if error.errno == errno.EADDRINUSE else f"can't be had: {error.strerror}"
        raise PortError(
            f"port {port} {why}; choose another, or --port 0 for any that is free"
        ) from error
    return made


def hosts_at(port: int) -> list[str]:
    """Return the names under which browsers ask a server at a port; they leave the standard out."""
    names = [LOOPBACK, "localhost"]
    return [f"{name}:{port}" for name in names] + (names if port == STANDARD_PORT else [])


class Server(uvicorn.Server):
    """The app on a socket.

    Parameters
    ----------
    sock : socket
        From `bind`.
    explorer : Explorer
    when_ready : callable (address), optional
        Called once it answers.
    """

    def __init__(
        self,
        sock: socket.socket,
        explorer: Explorer,
        *,
        when_ready: Callable[[str], None] | None = None,
    ) -> None:
        port = sock.getsockname()[1]
        self.address = f"http://{LOOPBACK}:{port}/"
        self.explorer = explorer
        self.ended = threading.Event()
        self._sock, self._when_ready = sock, when_ready
        app = make_app(explorer, hosts_at(port))
        super().__init__(
            uvicorn.Config(
                app,
                http="h11",
                ws="none",
                loop="asyncio",
                lifespan="off",
                log_level="error",
                access_log=False,
                server_header=False,
                timeout_graceful_shutdown=GRACE_SECONDS,
            )
        )

    def serve_until_stopped(self) -> None:
        """Serve until a signal or `stop`."""
        try:
            self.run(sockets=[self._sock])
        finally:
            self.explorer.jobs.join()
            self._sock.close()
            self.ended.set()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin, and tell that it has begun."""
        await super().startup(sockets=sockets)
        if self._when_ready is not None and not self.should_exit:
            self._when_ready(self.address)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End what still computes, so that its readers are not waited for."""
        self.explorer.jobs.close()
        super().handle_exit(sig, frame)

    def stop(self) -> None:
        """End, from another thread."""
        self.explorer.jobs.close()
        self.should_exit = True
