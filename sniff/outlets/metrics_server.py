"""/metrics over HTTP: whoever asks gets the newest page; the bus never waits for anybody.

The page is made by whoever listens to the buses, once a second, and put here; readers only get what is there. A reader
has ten seconds for everything, there are eight at once at most, and nothing but GET /metrics is answered. What other
machines can reach asks for a token: `Authorization: Bearer TOKEN`, or `/metrics?token=TOKEN`.
"""

from __future__ import annotations

import hmac
import socket
import threading
from http.server import HTTPServer
from urllib.parse import parse_qsl

from sniff.bounded_http import FewReaders, QuietHandler
from sniff.outlets.metrics import CONTENT_TYPE

HOST = "127.0.0.1"
READERS = 8
PATIENCE = 5.0
"""Seconds for a reader to go on."""

ALL_PATIENCE = 10.0
"""Seconds for a reader to be done."""


class MetricsServer:
    """Serves `page`. Raises OSError when the port cannot be had. `port`: 0 takes any; then says which it is. `token`:
    that readers must show; None: none."""

    def __init__(self, port: int, host: str = HOST, token: str | None = None) -> None:
        self.page = "# EOF\n"
        self.token = token
        self._server = _Server(self, host, port)
        self.port: int = self._server.server_port
        self._thread = threading.Thread(target=self._server.serve_forever, name="metrics", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Answer nobody any more."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def is_token(token: str, authorization: str, query: str) -> bool:
    """Whether a request shows the token, in its header or in its address. Takes equally long for every wrong one."""
    shown = authorization.removeprefix("Bearer ").strip() if authorization.startswith("Bearer ") else ""
    if not shown:
        shown = next((text for key, text in parse_qsl(query[:1024]) if key == "token"), "")
    return hmac.compare_digest(shown.encode("utf-8", "replace"), token.encode())


class _Server(FewReaders, HTTPServer):
    request_queue_size = READERS

    def __init__(self, owner: MetricsServer, host: str, port: int) -> None:
        self.owner = owner
        self.places, self.patience = threading.BoundedSemaphore(READERS), ALL_PATIENCE
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        super().__init__((host, port), _Handler)


class _Handler(QuietHandler):
    timeout = PATIENCE
    server: _Server

    def get(self) -> None:
        path, _, query = self.path.partition("?")
        token = self.server.owner.token
        if token is not None and not is_token(token, self.headers.get("Authorization", ""), query):
            self.send_response(401)
            self.send_header("WWW-Authenticate", "Bearer")
            self.send_header("Content-Length", "0")
            self.end_headers()
        elif path != "/metrics":
            self.send_error(404, "only /metrics is here")
        else:
            self.answer(self.server.owner.page, CONTENT_TYPE)
