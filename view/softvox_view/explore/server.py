"""Runs the app on this machine: a socket on loopback, and an orderly end."""

from __future__ import annotations

import socket
from types import FrameType

import uvicorn

from softvox_view.explore.app import Explorer

LOOPBACK = "127.0.0.1"

#: s that open connections get to end by themselves.
GRACE_SECONDS = 2


class Server(uvicorn.Server):
    """The app on a port of loopback, which accepts connections from now on.

    Parameters
    ----------
    explorer : Explorer
    port : int
        0 for any that is free.

    Raises
    ------
    OSError
        Where the port is in use, or not allowed.
    """

    def __init__(self, explorer: Explorer, port: int = 0) -> None:
        self.explorer = explorer
        self.socket = socket.create_server((LOOPBACK, port), backlog=128)
        self.address = f"http://{LOOPBACK}:{self.socket.getsockname()[1]}/"
        super().__init__(
            uvicorn.Config(
                explorer.app,
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
            self.run(sockets=[self.socket])
        finally:
            self.explorer.close()
            self.socket.close()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End what still computes, so that its readers are not waited for."""
        self.explorer.stopping.set()
        super().handle_exit(sig, frame)
