"""The app on a port of its own, and requests to it."""

import http.client
import json
import socket
import threading
from contextlib import contextmanager
from urllib.parse import urlencode

from softvox_view.explore.app import Explorer


class Served:
    """A server that runs, as its browsers see it."""

    def __init__(self, explorer, port):
        self.explorer = explorer
        self.host = f"127.0.0.1:{port}"
        self.address = f"http://{self.host}/"

    def ask(self, path, *, method="GET", headers=None):
        """Return status, headers and body."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            connection.request(method, path, headers=headers or {})
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def events(self, name, **query):
        """Return the events of an answer."""
        with self.reading(name, **query) as events:
            return list(events)

    @contextmanager
    def reading(self, name, **query):
        """Give the events of an answer as they come."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        try:
            connection.request("GET", f"/api/{name}?{urlencode(query)}")
            response = connection.getresponse()
            assert response.status == 200
            try:
                lines = (line.decode() for line in iter(response.readline, b""))
                yield (json.loads(line.removeprefix("data: ")) for line in lines if line.strip())
            finally:
                response.close()
        finally:
            connection.close()


@contextmanager
def serving(results=None):
    """Serve on any free port, with recorded results perhaps."""
    explorer = Explorer(results=results)
    server = explorer.server()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            yield Served(explorer, listener.getsockname()[1])
        finally:
            server.should_exit = True
            thread.join(20)
            assert not thread.is_alive()
