"""The server: answers this machine's own browser tabs, and nobody else."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

import softvox_gym
from softvox_gym import Result, noisy_landscape, simulate
from softvox_gym.engine import Progress
from softvox_gym.physics import ACTUATIONS, ParameterError
from softvox_gym.rendering import png
from softvox_view import replay
from softvox_view.explore import landscapes, paths, requests
from softvox_view.explore.landscapes import listed
from softvox_view.explore.requests import PHYSICS
from softvox_view.tessellation import SIDE, design_at

if TYPE_CHECKING:
    from softvox_search.experiment.results import Results

#: s between looks at how far a computation is.
POLL_SECONDS = 0.05

#: Of a recording, and how many it has at least and at most, whatever the frequency.
FRAMES_PER_CYCLE, FEWEST_FRAMES, MOST_FRAMES = 20, 100, 600

HOSTS = ("127.0.0.1", "localhost")

HEADERS = {
    "content-security-policy": (
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "cross-origin-resource-policy": "same-origin",
    "x-content-type-options": "nosniff",
    "cache-control": "no-cache",
}

Query = Mapping[str, str]
Answer = dict[str, Any]
Work = Callable[[Query, Progress], Answer]


class UnwantedError(Exception):
    """Nobody waits for the computation any more."""


class Guard:
    """Middleware that refuses other sites, and adds headers that browsers heed.

    Binding to loopback keeps other machines out, but a page anywhere can send requests to
    127.0.0.1. To follow a link to the page itself, as shared states are, is no attack.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 403."""

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        headers = Headers(scope=scope)
        own = f"http://{headers.get('host')}"
        is_own = headers.get("sec-fetch-site", "none") in ("same-origin", "none")
        answer = self._app
        if headers.get("origin", own) != own or (scope["path"].startswith("/api") and not is_own):
            answer = PlainTextResponse("another site may not use this server", status_code=403)
        await answer(scope, receive, with_headers)


class Explorer:
    """What the server keeps, and its answers.

    Parameters
    ----------
    threads : int, optional
        Of the engine, for a landscape; all processors where None.
    results : dict of Results, optional
        Folders of results whose paths can be shown, by name.
    """

    def __init__(
        self, *, threads: int | None = None, results: Mapping[str, Results] | None = None
    ) -> None:
        self.running = 0
        self._threads = threads
        self._results = results or {}
        self._runs = {name: paths.runs_of(found) for name, found in self._results.items()}
        works = (self.start, self.recording, self.landscape, self.path)
        self._works: dict[str, Work] = {work.__name__: work for work in works}
        self.app = Starlette(
            routes=[
                Route("/api/replay.html", self.replay),
                Route("/api/still.png", self.still),
                Route("/api/{name}", self.answer),
                Mount("/player", StaticFiles(packages=[("softvox_view.replay", "assets")])),
                Mount("/", StaticFiles(packages=[("softvox_view.explore", "assets")], html=True)),
            ],
            middleware=[
                Middleware(Guard),
                Middleware(TrustedHostMiddleware, allowed_hosts=HOSTS),
            ],
            exception_handlers={ParameterError: _refused},
        )

    def server(self) -> uvicorn.Server:
        """Return what serves the app until a signal; answers under way then get a second to end."""
        return uvicorn.Server(
            uvicorn.Config(
                self.app,
                ws="none",
                lifespan="off",
                log_level="critical",
                timeout_graceful_shutdown=1,
            )
        )

    def start(self, query: Query, progress: Progress) -> Answer:
        """Say what can be asked for, and all about the published landscape.

        cells has the design of every cell of the map, row by row from the bottom; noise is the mean
        fitness under noise of level 1, by design, step_error what half the time step changes.
        """
        table = softvox_gym.landscape()
        row, column = np.divmod(np.arange(len(table)), SIDE)
        return {
            "side": SIDE,
            "cells": design_at(row, column).tolist(),
            **{name: table[name].tolist() for name in ("n_voxels", "n_active", "is_connected")},
            "noise": listed(noisy_landscape(1.0)["mean"]),
            "step_error": listed(table["step_error"]),
            **landscapes.values_of(table),
            "version": softvox_gym.__version__,
            "sliders": requests.SLIDERS,
            "actuations": ACTUATIONS,
            "searchers": paths.searchers(),
            "results": {name: list(runs) for name, runs in self._runs.items()},
        }

    def recording(self, query: Query, progress: Progress) -> Answer:
        """Simulate one design or two, and return their recording."""
        return replay.recording(_simulated(query))

    def landscape(self, query: Query, progress: Progress) -> Answer:
        """Compute the landscape under some physics."""
        physics, warnings = requests.physics_of(requests.read(query, also=PHYSICS))
        values = landscapes.landscape(physics, threads=self._threads, progress=progress)
        return {"values": values, "warnings": warnings}

    def path(self, query: Query, progress: Progress) -> Answer:
        """Let a searcher search, or read what one did."""
        asked = requests.read(query, needed=("searcher", "seed", "budget"), also=("results",))
        searcher, name = asked["searcher"], asked.get("results", "")
        how = {key: int(asked[key]) for key in ("seed", "budget")}
        if not name:
            return paths.search(searcher, **how, progress=progress)
        if name not in self._results:
            remedy = "softvox explore --results DIR adds some"
            raise ParameterError("results", f"{name[:60]!r} are not there; {remedy}")
        return paths.recorded(self._results[name], self._runs[name], searcher, **how)

    def replay(self, request: Request) -> Response:
        """Return a replay as a page to keep."""
        result = _simulated(request.query_params)
        return HTMLResponse(replay.page(replay.recording(result), replay.still(result)))

    def still(self, request: Request) -> Response:
        """Return a picture, for browsers that can't show the replay."""
        picture = png(replay.still(_simulated(request.query_params)))
        return Response(picture, media_type="image/png")

    async def answer(self, request: Request) -> Response:
        """Answer with server-sent events: see `_events`."""
        work = self._works.get(request.path_params["name"])
        if work is None:
            raise HTTPException(404)
        events = self._events(work, request.query_params)
        return StreamingResponse(events, media_type="text/event-stream")

    async def _events(self, work: Work, query: Query) -> AsyncIterator[str]:
        """Do some work in a thread, and yield how it goes as events in JSON.

        These have the key progress, [done, total], time and again; the last has answer, what the
        work returned, or error, a line, perhaps with the parameter that is wrong. A reader who
        goes away ends the work at its next progress.
        """
        far: list[int] = []
        is_unwanted = threading.Event()

        def progress(*now: int) -> None:
            if is_unwanted.is_set():
                raise UnwantedError
            far[:] = now

        self.running += 1
        future = asyncio.get_running_loop().run_in_executor(None, work, query, progress)
        try:
            while not future.done():
                await asyncio.wait([future], timeout=POLL_SECONDS)
                if far:
                    yield _event(progress=far)
            yield _event(answer=future.result())
        except Exception as error:  # shown on the page, which would otherwise wait for ever
            parameter = getattr(error, "parameter", None)
            yield _event(error=str(error) or type(error).__name__, parameter=parameter)
        finally:
            is_unwanted.set()
            future.cancel()
            self.running -= 1


def _event(**values: Any) -> str:
    return f"data: {json.dumps(values, allow_nan=False)}\n\n"


def _simulated(query: Query) -> Result:
    """Simulate the designs of a request with frames for a replay."""
    asked = requests.read(query, needed=("design",), also=("compare", *PHYSICS))
    designs = [asked.pop(name) for name in ("design", "compare") if name in asked]
    physics, _ = requests.physics_of(asked)
    wish = FRAMES_PER_CYCLE * float(physics.frequency_hz) * float(physics.duration)
    frames = min(max(wish, FEWEST_FRAMES), MOST_FRAMES)
    stride = max(1, round(float(physics.duration) / float(physics.time_step) / frames))
    return simulate(designs, physics, frames=stride, threads=1)


async def _refused(_: Request, error: Exception) -> Response:
    return PlainTextResponse(str(error), status_code=422)
