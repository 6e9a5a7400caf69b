"""Only this machine's own browser tabs: requests under another name or from another site fail.

Binding to loopback keeps other machines out, but not other web sites: a page anywhere can send
requests to 127.0.0.1, and one whose name is made to point there (DNS rebinding) could read the
answers. Such requests carry another Host or Origin.
"""

from __future__ import annotations

from collections.abc import Iterable

from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADERS = {
    "content-security-policy": (
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cache-control": "no-cache",
}


class Guard:
    """Refuses requests of other hosts and origins; adds headers that browsers heed.

    Parameters
    ----------
    app : ASGI application
    hosts : iterable of str
        The names, with port, under which the server may be asked.
    """

    def __init__(self, app: ASGIApp, hosts: Iterable[str]) -> None:
        self._app = app
        self._hosts = frozenset(hosts)
        self._origins = frozenset(f"http://{host}" for host in self._hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 403."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":  # there are no web sockets here
            return
        fault = self._fault(scope)

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = [(k.encode(), v.encode()) for k, v in HEADERS.items()]
                message["headers"] = [*message.get("headers", []), *own]
            await send(message)

        answer = JSONResponse({"error": fault}, status_code=403) if fault else self._app
        await answer(scope, receive, with_headers)

    def _fault(self, scope: Scope) -> str | None:
        headers: dict[bytes, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name, []).append(value.decode("latin-1"))
        hosts = headers.get(b"host", [])
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return (
                f"asked as {', '.join(hosts) or 'nobody'}, but this server answers only as "
                f"{' or '.join(sorted(self._hosts))}; open it under that address"
            )
        if any(origin not in self._origins for origin in headers.get(b"origin", [])):
            return "another site may not use this server; open its own page"
        site = headers.get(b"sec-fetch-site", ["none"])[-1]
        if site not in ("same-origin", "none") and not _is_visit(scope, headers):
            return "another site may not use this server; open its own page"
        return None


def _is_visit(scope: Scope, headers: dict[bytes, list[str]]) -> bool:
    """Return whether somebody followed a link to the page, as shared states are."""
    mode = headers.get(b"sec-fetch-mode", [""])[-1]
    target = headers.get(b"sec-fetch-dest", [""])[-1]
    return scope["path"] == "/" and (mode, target) == ("navigate", "document")
