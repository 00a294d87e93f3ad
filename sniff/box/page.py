"""The status page: over a socket in the runtime directory, and over the loopback if told so; for reading only.

GET /status is JSON, GET / the same in words, over HTTP: `curl --unix-socket /run/sniff485/site.sock http://box/`. The
page is made by whoever watches the buses and put here; readers only get what is there. A reader has five seconds, and
there are eight at once at most.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import socketserver
import threading
from collections.abc import Mapping, Sequence
from http.client import HTTPConnection, HTTPException
from pathlib import Path

from sniff.bounded_http import FewReaders, QuietHandler
from sniff.box.status import BoxStatus

HOST = "127.0.0.1"
READERS = 8
_QUEUE = 4 * READERS

PATIENCE = 5.0
"""Seconds for a reader to go on, and for a box to say how it is."""

ALL_PATIENCE = 5.0
"""Seconds for a reader to be done."""

MOST = 4 << 20
"""Octets of an answer that are read."""

HAS_UNIX = hasattr(socket, "AF_UNIX")
SUFFIX = ".sock"


class RunsAlready(Exception):
    """Another box has the socket; the message says which."""


class StatusPage:
    """Serves the newest page. `port`: of the loopback, None where it is not asked for."""

    def __init__(self, path: Path | None, port: int | None = None) -> None:
        """`path`: of the socket, None for none; `port`: 0 takes any. Raises RunsAlready, and OSError."""
        self.json, self.words = "{}", ""
        self.path = path
        self._servers: list[socketserver.BaseServer] = []
        self._places = threading.BoundedSemaphore(READERS)
        self.port: int | None = None
        try:
            if path is not None:
                _remove_left_behind(path)
                self._serve(_UnixServer(str(path), _handler(self)))
                os.chmod(path, 0o660)  # who may read ports may ask: the group is that of the service
            if port is not None:
                server = _TcpServer((HOST, port), _handler(self))
                self.port = int(server.server_address[1])
                self._serve(server)
        except BaseException:
            self.close()
            raise

    def _serve(self, server: _TcpServer | _UnixServer) -> None:
        server.places, server.patience = self._places, ALL_PATIENCE
        self._servers.append(server)
        threading.Thread(target=server.serve_forever, name="status", daemon=True).start()

    def close(self) -> None:
        """Answer nobody any more."""
        for server in self._servers:
            server.shutdown()
            server.server_close()
        if self._servers and self.path is not None:
            with contextlib.suppress(OSError):
                self.path.unlink()
        self._servers = []


class _TcpServer(FewReaders, socketserver.TCPServer):
    allow_reuse_address = True
    request_queue_size = _QUEUE


if HAS_UNIX:

    class _UnixServer(FewReaders, socketserver.UnixStreamServer):
        request_queue_size = _QUEUE


def _handler(page: StatusPage) -> type[QuietHandler]:
    class Handler(QuietHandler):
        timeout = PATIENCE

        def get(self) -> None:
            pages = {"/status": ("application/json", page.json), "/": ("text/plain", page.words)}
            found = pages.get(self.path.partition("?")[0])
            if found is None:
                self.send_error(404, "/status and / are here")
                return
            kind, words = found
            self.answer(words, f"{kind}; charset=utf-8")

    return Handler


def _remove_left_behind(path: Path) -> None:
    """Remove the socket of a box that is gone. Raises RunsAlready for one that answers."""
    if not path.exists():
        return
    try:
        status = ask(path)
    except (ConnectionRefusedError, FileNotFoundError):  # nobody listens
        path.unlink(missing_ok=True)
        return
    except OSError as error:  # somebody does, who is too busy to tell, or hangs
        raise RunsAlready(f"{path}: a box of this name runs already, and did not say how it is ({error})") from error
    raise RunsAlready(f"box {status.name} runs already: process {status.pid}")


# -- asking ------------------------------------------------------------------------------------------------------------


def runtime_folders(environment: Mapping[str, str] | None = None) -> list[Path]:
    """Where sockets of boxes may be, the likeliest first; the first that can be written to is where one is made."""
    environment = os.environ if environment is None else environment
    named = environment.get("RUNTIME_DIRECTORY", "").partition(":")[0]
    own = environment.get("XDG_RUNTIME_DIR", "")
    folders = [Path(named)] if named else []
    folders += [Path("/run/sniff485")]
    folders += [Path(own) / "sniff485"] if own else []
    return folders


def sockets(folders: Sequence[Path]) -> list[Path]:
    """The sockets that are there."""
    return [path for folder in folders if folder.is_dir() for path in sorted(folder.glob(f"*{SUFFIX}"))]


class _UnixConnection(HTTPConnection):
    def __init__(self, path: Path) -> None:
        super().__init__("box", timeout=PATIENCE)
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(PATIENCE)
        self.sock.connect(str(self._path))


def ask(where: Path | int) -> BoxStatus:
    """How a box stands, by its socket or its port on the loopback. Raises OSError, also for what is no box."""
    connection = HTTPConnection(HOST, where, timeout=PATIENCE) if isinstance(where, int) else _UnixConnection(where)
    try:
        connection.request("GET", "/status")
        answer = connection.getresponse()
        value = json.loads(answer.read(MOST))
        return BoxStatus.from_json(value)
    except (HTTPException, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise OSError(f"no status page of a box: {type(error).__name__}") from error
    finally:
        connection.close()
