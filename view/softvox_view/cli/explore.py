"""softvox explore: the landscape as a living map, in a browser."""

from __future__ import annotations

import signal
import socket
import threading
import webbrowser
from argparse import Namespace
from contextlib import closing
from typing import Any

from softvox_gym.cli.parser import add_threads
from softvox_gym.cli.signals import Stopped
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.missing import missing
from softvox_view.cli.options import add_results, read_results

PORT = 8653

DESCRIPTION = """\
Show the landscape as a map in a browser: hover over a cell and see the robot,
click and it is simulated and replayed in 3-D; sliders change the physics, and
all 6561 designs are simulated anew. Serves this machine alone, without any
network, until Ctrl-C.

The page's address keeps what is seen: what follows its # is what --state takes.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explore",
        help="the landscape as a living map, in a browser",
        description=DESCRIPTION,
    )
    parser.add_argument(
        "--port",
        type=int,
        default=PORT,
        metavar="N",
        help="to serve at; 0 for any that is free (default: %(default)s)",
    )
    parser.add_argument(
        "--state",
        default="",
        metavar="STATE",
        help="to begin with, as 'design=6453&gravity=-1.62'",
    )
    add_results(parser, "whose searchers' paths can be laid over the map")
    parser.add_argument(
        "--no-browser", action="store_true", help="open none; only print the address"
    )
    add_threads(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Serve until Ctrl-C, which is how this is meant to end: 0."""
    import asyncio  # slow, which would be felt by every command

    try:
        from softvox_view.explore.app import Explorer
    except ModuleNotFoundError as error:
        raise BadInputError(missing("explore", error, ("starlette", "uvicorn"))) from error
    explorer = Explorer(threads=args.threads, results=read_results(args.results))
    try:
        listener = socket.create_server(("127.0.0.1", args.port), backlog=128)
    except (OSError, OverflowError) as error:
        raise BadInputError(
            f"--port {args.port}: {error}; choose another, or 0 for any that is free"
        ) from error
    state = args.state.rpartition("#")[2]
    address = f"http://127.0.0.1:{listener.getsockname()[1]}/" + (f"#{state}" if state else "")
    try:
        # Closed, as Python complains of a coroutine that Ctrl-C keeps from being started.
        with closing(explorer.server().serve(sockets=[listener])) as serving:
            print(f"the landscape is at {address}\nCtrl-C ends it", flush=True)
            if not args.no_browser:
                # Some browsers keep their caller waiting, and the server must answer meanwhile.
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
            asyncio.run(serving)
    except Stopped as stop:
        if stop.number != signal.SIGINT:
            raise
    return 0
