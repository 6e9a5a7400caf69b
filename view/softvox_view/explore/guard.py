"""Only this machine's own browser tabs: requests under another name or from another site fail.

Binding to loopback keeps other machines out, but not other web sites: a page anywhere can send
requests to 127.0.0.1, and one whose name is made to point there (DNS rebinding) could read the
answers. Such requests carry another Host, an Origin, or say that they come from another site.
"""

from __future__ import annotations

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HOSTS = ("127.0.0.1", "localhost")

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
    """Middleware that refuses other hosts and origins, and adds headers that browsers heed."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 403."""

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        fault = _fault(scope["path"], Headers(scope=scope)) if scope["type"] == "http" else None
        answer = JSONResponse({"error": fault}, status_code=403) if fault else self._app
        await answer(scope, receive, with_headers)


def _fault(path: str, headers: Headers) -> str | None:
    host = headers.get("host", "")
    if host.partition(":")[0] not in HOSTS:
        return f"asked as {host!r}, but this server answers only as {' or '.join(HOSTS)}; use that"
    # To follow a link to the page, as shared states are, is no attack.
    kind = (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest"))
    is_visit = path == "/" and kind == ("navigate", "document")
    is_own = headers.get("sec-fetch-site", "none") in ("same-origin", "none")
    if headers.get("origin", f"http://{host}") != f"http://{host}" or not (is_own or is_visit):
        return "another site may not use this server; open its own page"
    return None
