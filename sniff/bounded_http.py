"""HTTP for those who only read: so many at once, each with little time. Who takes longer is hung up on."""

from __future__ import annotations

import contextlib
import socket
import socketserver
import threading
from http.server import BaseHTTPRequestHandler
from typing import Any


class FewReaders(socketserver.ThreadingMixIn, socketserver.BaseServer):
    """Of a server: `places` for readers at once, none of whom is waited for; `patience`: s that one has for all."""

    daemon_threads = True
    block_on_close = False
    places: threading.BoundedSemaphore
    patience: float

    def process_request(self, request: Any, client_address: Any) -> None:
        """Take a reader, if there is a place for him."""
        if self.places.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer him while his time lasts, however slowly he asks."""
        limit = threading.Timer(self.patience, _hang_up, (request,))
        limit.daemon = True
        limit.start()
        try:
            super().process_request_thread(request, client_address)
        finally:
            limit.cancel()
            self.places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A reader that went away is nobody's business."""


class QuietHandler(BaseHTTPRequestHandler):
    """Answers with whole pages, and says nothing of this machine or on standard error."""

    def get(self) -> None:
        """Answer what is asked by `path`."""
        self.send_error(404)

    def do_GET(self) -> None:
        """A request came."""
        self.get()

    def answer(self, page: str, kind: str) -> None:
        """Give a page. `kind`: its Content-Type."""
        body = page.encode("utf-8", "replace")
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def version_string(self) -> str:
        """Nothing about this machine."""
        return "sniff485"

    def log_message(self, format: str, *args: object) -> None:
        """Standard error is for people."""


def _hang_up(request: socket.socket) -> None:
    with contextlib.suppress(OSError):  # it is gone
        request.shutdown(socket.SHUT_RDWR)
