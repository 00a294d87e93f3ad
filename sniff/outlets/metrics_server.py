"""/metrics over HTTP, on the loopback only: whoever asks gets the newest page; the bus never waits for anybody.

The page is made by whoever listens to the bus, once a second, and put here; readers only get what is there. A reader
has five seconds, and there are eight at once at most.
"""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from sniff.outlets.metrics import CONTENT_TYPE

HOST = "127.0.0.1"
READERS = 8
PATIENCE = 5.0


class MetricsServer:
    """Serves `page`. Raises OSError when the port cannot be had. `port`: 0 takes any; then says which it is."""

    def __init__(self, port: int) -> None:
        self.page = "# EOF\n"
        self._server = _Server(self, port)
        self.port: int = self._server.server_port
        self._thread = threading.Thread(target=self._server.serve_forever, name="metrics", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Answer nobody any more."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, owner: MetricsServer, port: int) -> None:
        self.owner = owner
        self._places = threading.BoundedSemaphore(READERS)
        super().__init__((HOST, port), _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._places.acquire(blocking=False):
            self.shutdown_request(request)  # too many at once
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A reader that went away is nobody's business."""


class _Handler(BaseHTTPRequestHandler):
    timeout = PATIENCE
    server: _Server

    def do_GET(self) -> None:
        if self.path.partition("?")[0] != "/metrics":
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
