"""The server's answers: a Starlette application."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from importlib.resources import files
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

import softvox_gym
from softvox_gym import Design, engine
from softvox_gym.physics import ACTUATIONS
from softvox_view import replay
from softvox_view.explore import landscapes, parameters, paths, robots
from softvox_view.explore.guard import Guard
from softvox_view.explore.jobs import BusyError, Event, Job, Jobs
from softvox_view.explore.landscapes import Landscapes
from softvox_view.explore.parameters import BadRequestError
from softvox_view.explore.recorded import Recorded

#: Bytes of a request's body; the longest that the page sends has a few hundred.
MOST_BODY = 10_000

#: What the page is made of, in the folder `assets`. The player's own parts come from its package.
OWN = (
    "app.js",
    "colours.js",
    "controls.js",
    "downloads.js",
    "map.js",
    "palettes.js",
    "panels.js",
    "path.js",
    "robot.js",
    "server.js",
    "state.js",
    "app.css",
)
TYPES = {"js": "text/javascript", "css": "text/css", "html": "text/html"}


class Explorer:
    """What the server keeps, and its answers.

    Parameters
    ----------
    threads : int, optional
        Of the engine, shared by all that computes landscapes; all processors where None.
    results : dict of Recorded, optional
        Folders of results whose paths can be shown, by name: `recorded.read_all`.
    """

    def __init__(
        self, *, threads: int | None = None, results: Mapping[str, Recorded] | None = None
    ) -> None:
        self.jobs = Jobs()
        self._landscapes = Landscapes()
        self._threads = threads or engine.default_threads()
        self._results = results or {}

    def routes(self) -> list[Route]:
        """Return what answers where."""
        return [
            Route("/", page),
            Route("/favicon.ico", favicon),
            Route("/assets/{name}", asset),
            Route("/api/about", self.about),
            Route("/api/atlas", self.atlas),
            Route("/api/robots", self.robots),
            Route("/api/replay.html", self.replay),
            Route("/api/still.png", self.still),
            Route("/api/landscape", self.landscape, methods=["POST"]),
            Route("/api/path", self.path, methods=["POST"]),
        ]

    async def about(self, request: Request) -> Response:
        """Tell what can be asked for."""
        return JSONResponse(
            {
                "version": softvox_gym.__version__,
                "sliders": parameters.about_sliders(),
                "actuations": ACTUATIONS,
                "searchers": paths.searchers(),
                "most_budget": paths.MOST_BUDGET,
                "results": {name: list(found.runs) for name, found in self._results.items()},
            }
        )

    async def atlas(self, request: Request) -> Response:
        """Tell all about the published landscape."""
        return JSONResponse(await run_in_threadpool(landscapes.atlas))

    async def robots(self, request: Request) -> Response:
        """Simulate one design or two, and tell what became of them, with their recording."""
        designs, wanted = _designs_and_conditions(request)
        return JSONResponse(await run_in_threadpool(robots.told, designs, wanted))

    async def replay(self, request: Request) -> Response:
        """Return a replay as a page to keep."""
        designs, wanted = _designs_and_conditions(request)
        content = await run_in_threadpool(robots.page, designs, wanted)
        name = "-".join(str(design.index) for design in designs)
        name += "".join(f"_{what}_{_short(value)}" for what, value in wanted.changes.items())
        headers = {"content-disposition": f'attachment; filename="replay-{name}.html"'}
        return Response(content, media_type="text/html", headers=headers)

    async def still(self, request: Request) -> Response:
        """Return a picture, for browsers that can't show the replay."""
        designs, wanted = _designs_and_conditions(request)
        return Response(
            await run_in_threadpool(robots.still, designs, wanted), media_type="image/png"
        )

    async def landscape(self, request: Request) -> Response:
        """Compute the landscape under some conditions; lines of JSON tell how it goes."""
        asked = await _body(request, ("client", "parameters"))
        changes = asked.get("parameters", {})
        if not isinstance(changes, dict):
            raise BadRequestError("parameters must be an object of numbers by name")
        wanted = parameters.conditions(changes)

        def work(job: Job) -> Event:
            threads = max(1, self._threads // max(1, self.jobs.running))
            values = self._landscapes.at(wanted, threads=threads, progress=job.report)
            return {
                "values": values.to_dict(),
                "changes": landscapes.changes(values),
                "warnings": wanted.warnings,
            }

        return self._answer(f"landscape {parameters.client(asked.get('client'))}", work)

    async def path(self, request: Request) -> Response:
        """Let a searcher search, or read what one did; lines of JSON tell how it goes."""
        asked = await _body(request, ("client", "results", "searcher", "seed", "budget"))
        path = self._recorded(asked) if asked.get("results") else _live(asked)
        budget = parameters.whole("budget", asked.get("budget"), least=1, most=paths.MOST_BUDGET)
        tab = f"path {parameters.client(asked.get('client'))}"
        return self._answer(tab, lambda job: path(job, budget))

    def _recorded(self, asked: dict[str, Any]) -> Callable[[Job, int], Event]:
        name = asked["results"]
        found = self._results.get(name) if isinstance(name, str) else None
        if found is None:
            raise BadRequestError(
                f"there are no results {str(name)[:60]!r}; softvox explore --results DIR adds some",
                "results",
            )
        run = found.run(asked.get("searcher"), asked.get("seed"))
        return lambda job, budget: found.path(run, budget)

    def _answer(self, tab: str, work: Callable[[Job], Event]) -> Response:
        try:
            job = self.jobs.start(tab, work)
        except BusyError as error:
            return JSONResponse({"error": str(error)}, status_code=503)
        return _Lines(job)


def _short(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _live(asked: dict[str, Any]) -> Callable[[Job, int], Event]:
    name = paths.searcher(asked.get("searcher"))
    seed = parameters.whole("seed", asked.get("seed"), least=0, most=10**15)
    return lambda job, budget: paths.follow(job, name, seed=seed, budget=budget)


class _Lines(Response):
    """Streams events as lines of JSON; a reader who goes away cancels the job."""

    def __init__(self, job: Job) -> None:
        super().__init__(media_type="application/x-ndjson")
        del self.headers["content-length"]
        self._job = job

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the events."""

        async def watch() -> None:
            while (await receive())["type"] != "http.disconnect":
                pass
            self._job.cancel()

        watcher = asyncio.ensure_future(watch())
        start = {"type": "http.response.start", "status": 200, "headers": self.raw_headers}
        body: dict[str, Any] = {"type": "http.response.body", "more_body": True}
        try:
            await send(start)
            async for event in self._job.events():
                await send({**body, "body": json.dumps(event, allow_nan=False).encode() + b"\n"})
            await send({**body, "body": b"", "more_body": False})
        finally:
            self._job.cancel()
            watcher.cancel()


def make_app(explorer: Explorer, hosts: Iterable[str]) -> ASGIApp:
    """Return the application.

    Parameters
    ----------
    explorer : Explorer
    hosts : iterable of str
        The names, with port, under which it may be asked; see `Guard`.
    """
    handlers: dict[Any, Any] = {BadRequestError: _bad_request, HTTPException: _http_error}
    return Guard(Starlette(routes=explorer.routes(), exception_handlers=handlers), hosts)


async def page(request: Request) -> Response:
    """Return the page."""
    return Response(_read("index.html"), media_type=TYPES["html"])


async def favicon(request: Request) -> Response:
    """Return the icon that browsers ask for unasked: none."""
    return Response(status_code=204)


async def asset(request: Request) -> Response:
    """Return a part of the page, one of a fixed list: no path of a request reaches the disk."""
    name = request.path_params["name"]
    if name == "player.js":
        content = replay.script()
    elif name == "player.css":
        content = replay.style()
    elif name in OWN:
        content = _read(name)
    else:
        raise HTTPException(404)
    return Response(content, media_type=TYPES[name.rpartition(".")[2]])


def _read(name: str) -> str:
    return files("softvox_view.explore").joinpath("assets", name).read_text(encoding="utf-8")


async def _bad_request(request: Request, error: BadRequestError) -> Response:
    return JSONResponse({"error": str(error), "parameter": error.parameter}, status_code=422)


async def _http_error(request: Request, error: HTTPException) -> Response:
    told = f"{error.detail}: {request.method} {request.url.path}"
    return JSONResponse({"error": told}, status_code=error.status_code, headers=error.headers)


def _designs_and_conditions(request: Request) -> tuple[list[Design], parameters.Conditions]:
    """Read what a request asks for: design, perhaps compare, and changes of the physics."""
    asked = request.query_params
    repeated = next((name for name in asked if len(asked.getlist(name)) > 1), None)
    if repeated is not None:
        raise BadRequestError(f"{repeated} is given more than once; give it once", repeated)
    changes = dict(asked)
    designs = [parameters.design(changes.pop("design", ""))]
    if "compare" in changes:
        designs.append(parameters.design(changes.pop("compare"), "compare"))
    return designs, parameters.conditions(changes)


async def _body(request: Request, names: tuple[str, ...]) -> dict[str, Any]:
    """Read the JSON object that a request carries."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise HTTPException(415, "send application/json")
    content = b""
    async for part in request.stream():
        content += part
        if len(content) > MOST_BODY:
            raise HTTPException(413, f"send at most {MOST_BODY} bytes")
    asked: Any = None
    with suppress(ValueError, RecursionError):
        asked = json.loads(content)
    if not isinstance(asked, dict):
        raise BadRequestError(f"the body must be a JSON object with {', '.join(names)}")
    unknown = next((name for name in asked if name not in names), None)
    if unknown is not None:
        raise BadRequestError(f"there is no {unknown[:60]!r}; expected are {', '.join(names)}")
    return asked
