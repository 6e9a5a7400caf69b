"""The server's answers: a Starlette application."""

from __future__ import annotations

import asyncio
import json
import logging
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

import softvox_gym
from softvox_gym import Design, Physics, Result, engine, simulate
from softvox_gym.engine import Progress
from softvox_gym.physics import ACTUATIONS
from softvox_gym.rendering import png
from softvox_view import replay
from softvox_view.explore import landscapes, paths, requests
from softvox_view.explore.guard import Guard
from softvox_view.explore.landscapes import listed
from softvox_view.explore.recorded import Recorded
from softvox_view.explore.requests import PHYSICS, BadRequestError

#: Computations at once, of all tabs; others wait.
MOST = 16

#: s between looks at how far a computation is.
POLL_SECONDS = 0.05

#: Of a recording, and how many it has at least and at most, whatever the frequency.
FRAMES_PER_CYCLE, FEWEST_FRAMES, MOST_FRAMES = 20, 100, 600

Work = Callable[[Progress], dict[str, Any]]


class CancelledError(Exception):
    """The computation is no longer wanted."""


class Explorer:
    """What the server keeps, and its answers.

    Parameters
    ----------
    threads : int, optional
        Of the engine, shared by all that computes landscapes; all processors where None.
    results : dict of Recorded, optional
        Folders of results whose paths can be shown, by name.
    """

    def __init__(
        self, *, threads: int | None = None, results: Mapping[str, Recorded] | None = None
    ) -> None:
        self.running = 0
        self.stopping = threading.Event()
        self._threads = threads or engine.default_threads()
        self._results = results or {}
        self._pool = ThreadPoolExecutor(max_workers=MOST)
        self.app = Starlette(
            routes=[
                *(
                    Route(f"/api/{name}", getattr(self, name))
                    for name in ("about", "atlas", "robots")
                ),
                Route("/api/replay.html", self.replay),
                Route("/api/still.png", self.still),
                Route("/api/landscape", self.landscape),
                Route("/api/path", self.path),
                Mount("/player", StaticFiles(packages=[("softvox_view.replay", "assets")])),
                Mount("/", StaticFiles(packages=[("softvox_view.explore", "assets")], html=True)),
            ],
            middleware=[Middleware(Guard)],
            exception_handlers={BadRequestError: _bad_request},
        )

    def about(self, request: Request) -> Response:
        """Say what can be asked for."""
        return JSONResponse(
            {
                "version": softvox_gym.__version__,
                "sliders": requests.SLIDERS,
                "actuations": ACTUATIONS,
                "searchers": paths.searchers(),
                "most_budget": requests.MOST_BUDGET,
                "results": {name: list(found.runs) for name, found in self._results.items()},
            }
        )

    def atlas(self, request: Request) -> Response:
        """Return all about the published landscape."""
        return JSONResponse(landscapes.atlas())

    def robots(self, request: Request) -> Response:
        """Simulate one design or two, and return what became of them, with their recording."""
        result, warnings, _ = _simulated(request)
        columns = (*result.displacement.T, result.fitness)
        numbers = zip(*map(listed, columns), strict=True)
        robots = [
            {"design": Design(digits).index, "digits": Design(digits).digits}
            | dict(zip(("dx", "dy", "dz", "fitness"), values, strict=True))
            for digits, values in zip(result.designs, numbers, strict=True)
        ]
        recording = replay.recording(result)
        return JSONResponse({"robots": robots, "recording": recording, "warnings": warnings})

    def replay(self, request: Request) -> Response:
        """Return a replay as a page to keep."""
        result, _, changes = _simulated(request)
        content = replay.page(replay.recording(result), replay.still(result))
        name = "-".join(str(Design(digits).index) for digits in result.designs)
        name += "".join(f"_{key}_{_short(value)}" for key, value in changes.items())
        headers = {"content-disposition": f'attachment; filename="replay-{name}.html"'}
        return Response(content, media_type="text/html", headers=headers)

    def still(self, request: Request) -> Response:
        """Return a picture, for browsers that can't show the replay."""
        result, _, _ = _simulated(request)
        return Response(png(replay.still(result)), media_type="image/png")

    async def landscape(self, request: Request) -> Response:
        """Compute the landscape under some physics; lines of JSON say how it goes."""
        physics, warnings = requests.physics_of(requests.read(request.query_params, also=PHYSICS))

        def work(progress: Progress) -> dict[str, Any]:
            threads = max(1, self._threads // self.running)
            values = landscapes.landscape(physics, threads=threads, progress=progress)
            return {"values": values, "warnings": warnings}

        return self._streamed(work)

    async def path(self, request: Request) -> Response:
        """Let a searcher search, or read what one did; lines of JSON say how it goes."""
        asked = requests.read(
            request.query_params, needed=("searcher", "seed", "budget"), also=("results",)
        )
        searcher, seed, budget = asked["searcher"], asked["seed"], asked["budget"]
        name = asked.get("results", "")
        if not name:
            return self._streamed(
                lambda progress: paths.search(searcher, seed=seed, budget=budget, progress=progress)
            )
        if name not in self._results:
            raise BadRequestError(
                f"there are no results {name[:60]!r}; softvox explore --results DIR adds some",
                "results",
            )
        run = self._results[name].run(searcher, seed)
        return self._streamed(lambda _: self._results[name].path(run, budget))

    def _streamed(self, work: Work) -> Response:
        return StreamingResponse(self._lines(work), media_type="application/x-ndjson")

    async def _lines(self, work: Work) -> AsyncIterator[str]:
        """Do some work in a thread, and yield how it goes as lines of JSON.

        These have the key "event": progress (done, total), then done (with what the work returned)
        or error (with error, a line). A reader who goes away ends the work at its next progress.
        """
        far: list[tuple[int, int]] = []
        is_unwanted = threading.Event()

        def progress(done: int, total: int) -> None:
            if is_unwanted.is_set() or self.stopping.is_set():
                raise CancelledError
            far[:] = [(done, total)]

        self.running += 1
        future = asyncio.get_running_loop().run_in_executor(self._pool, work, progress)
        try:
            while not future.done():
                await asyncio.wait([future], timeout=POLL_SECONDS)
                while far:
                    done, total = far.pop()
                    yield _line("progress", done=done, total=total)
            try:
                yield _line("done", **future.result())
            except CancelledError:
                return
            except Exception as error:  # shown on the page, which would otherwise wait for ever
                logging.getLogger(__name__).debug("a computation failed", exc_info=True)
                yield _line("error", error=str(error) or type(error).__name__)
        finally:
            is_unwanted.set()
            future.cancel()
            self.running -= 1

    def close(self) -> None:
        """End all computations, and wait until they have."""
        self.stopping.set()
        self._pool.shutdown(cancel_futures=True)


def _line(event: str, **values: Any) -> str:
    return json.dumps({"event": event, **values}, allow_nan=False) + "\n"


def _short(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _simulated(request: Request) -> tuple[Result, list[str], dict[str, Any]]:
    """Simulate the designs of a request with frames for a replay; also its warnings and changes."""
    asked = requests.read(request.query_params, needed=("design",), also=("compare", *PHYSICS))
    changes = {name: value for name, value in asked.items() if name in PHYSICS}
    physics, warnings = requests.physics_of(changes)
    designs = [asked[name] for name in ("design", "compare") if name in asked]
    result = simulate(designs, physics, frames=_stride(physics), threads=1)
    return result, warnings, changes


def _stride(physics: Physics) -> int:
    """Return the steps from frame to frame of a recording."""
    wish = FRAMES_PER_CYCLE * float(physics.frequency_hz) * float(physics.duration)
    frames = min(max(wish, FEWEST_FRAMES), MOST_FRAMES)
    return max(1, round(float(physics.duration) / float(physics.time_step) / frames))


async def _bad_request(_: Request, error: Any) -> Response:
    return JSONResponse({"error": str(error), "parameter": error.parameter}, status_code=422)
