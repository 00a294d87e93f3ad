"""/metrics over HTTP: whoever asks gets the newest page; the bus never waits for anybody.

The page is made by whoever listens to the buses, once a second, and put here; readers only get what is there. A reader
has ten seconds for everything, there are eight at once at most, and nothing but GET /metrics is answered. What other
machines can reach asks for a token: `Authorization: Bearer TOKEN`, or `/metrics?token=TOKEN`.
"""

from __future__ import annotations

import hmac
import socket
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qsl

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


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = READERS

    def __init__(self, owner: MetricsServer, host: str, port: int) -> None:
        self.owner = owner
        self._places = threading.BoundedSemaphore(READERS)
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        super().__init__((host, port), _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._places.acquire(blocking=False):
            self.shutdown_request(request)  # too many at once
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        limit = threading.Timer(ALL_PATIENCE, _hang_up, (request,))
        limit.daemon = True
        limit.start()
        try:
            super().process_request_thread(request, client_address)
        finally:
            limit.cancel()
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A reader that went away is nobody's business."""


def _hang_up(request: socket.socket) -> None:
    try:
        request.shutdown(socket.SHUT_RDWR)
    except OSError:  # it is gone
        return


class _Handler(BaseHTTPRequestHandler):
    timeout = PATIENCE
    server: _Server

    def do_GET(self) -> None:
        path, _, query = self.path.partition("?")
        token = self.server.owner.token
        if token is not None and not is_token(token, self.headers.get("Authorization", ""), query):
            self.send_response(401)
            self.send_header("WWW-Authenticate", "Bearer")
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        if path != "/metrics":
            self.send_error(404, "only /metrics is here")
            return
        body = self.server.owner.page.encode("utf-8", "replace")
        self.send_response(200)
        self.send_header("Content-Type", CONTENT_TYPE)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def version_string(self) -> str:
        """Nothing about this machine."""
        return "sniff485"

    def log_message(self, format: str, *args: object) -> None:
        """Standard error is for people."""
