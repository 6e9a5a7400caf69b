"""The app on a port of its own, and requests to it."""

import http.client
import json
import signal
import threading
from contextlib import contextmanager
from urllib.parse import urlencode

from softvox_view.explore.app import Explorer
from softvox_view.explore.server import Server


class Served:
    """A server that runs, as its browsers see it."""

    def __init__(self, server):
        self.server = server
        self.explorer = server.explorer
        self.address = server.address
        self.host = server.address.removeprefix("http://").rstrip("/")

    def ask(self, path, *, method="GET", headers=None):
        """Return status, headers and body."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            connection.request(method, path, headers=headers or {})
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def get(self, path):
        """Return status and JSON."""
        status, _, body = self.ask(path)
        return status, json.loads(body)

    def lines(self, path, **query):
        """Return status and the lines of JSON."""
        status, _, content = self.ask(f"{path}?{urlencode(query)}")
        return status, [json.loads(line) for line in content.splitlines()]

    @contextmanager
    def reading(self, path, **query):
        """Give the lines of JSON as they come."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            connection.request("GET", f"{path}?{urlencode(query)}")
            response = connection.getresponse()
            assert response.status == 200
            try:
                yield (json.loads(line) for line in iter(response.readline, b""))
            finally:
                response.close()
        finally:
            connection.close()


@contextmanager
def serving(results=None):
    """Serve on any free port, with recorded results perhaps."""
    server = Server(Explorer(results=results))
    thread = threading.Thread(target=server.serve_until_stopped)
    thread.start()
    try:
        yield Served(server)
    finally:
        server.handle_exit(signal.SIGTERM, None)
        thread.join(20)
        assert not thread.is_alive()
