"""The app on a port of its own, and requests to it."""

import http.client
import json
import threading
from contextlib import contextmanager

from softvox_view.explore.app import Explorer
from softvox_view.explore.server import Server, bind


class Served:
    """A server that runs, as its browsers see it."""

    def __init__(self, server):
        self.server = server
        self.explorer = server.explorer
        self.address = server.address
        self.host = server.address.removeprefix("http://").rstrip("/")

    def ask(self, path, *, method="GET", body=None, headers=None):
        """Return status, headers and body."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            connection.request(method, path, body=body, headers=headers or {})
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def get(self, path):
        """Return status and JSON."""
        status, _, body = self.ask(path)
        return status, json.loads(body)

    def post(self, path, body):
        """Return status and the lines of JSON."""
        headers = {"content-type": "application/json"}
        text = body if isinstance(body, str | bytes) else json.dumps(body)
        status, _, content = self.ask(path, method="POST", body=text, headers=headers)
        return status, [json.loads(line) for line in content.splitlines()]

    @contextmanager
    def posted(self, path, body):
        """Give the lines of JSON as they come."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            headers = {"content-type": "application/json"}
            connection.request("POST", path, body=json.dumps(body), headers=headers)
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
    ready = threading.Event()
    server = Server(bind(0), Explorer(results=results), when_ready=lambda _: ready.set())
    thread = threading.Thread(target=server.serve_until_stopped)
    thread.start()
    try:
        assert ready.wait(20)
        yield Served(server)
    finally:
        server.stop()
        thread.join(20)
        assert not thread.is_alive()
