"""Playing a capture to other software: on a pseudo-terminal or a TCP port of this machine, never on a real port.

It begins when somebody listens, keeps the times of the capture (divided by `speed`), and ends with the capture.
"""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from dissectors.frame import Chunk
from sniff.engine.session import Item
from sniff.formats import read

PATIENCE = 0.05
"""Seconds between two looks for a listener."""


class ReplaySource(Protocol):
    """What is played."""

    def items(self) -> Iterator[Item]:
        """In order of time."""
        ...


class Replay:
    """Plays one capture in a thread; a context manager. `port`: what to open. `sent`: octets so far.

    `speed`: 1 as it was, 10 ten times as fast. `error`: why it ended early, "" otherwise.
    """

    port: str = ""

    def __init__(self, path: Path, speed: float = 1.0) -> None:
        if not speed > 0:
            raise ValueError(f"speed {speed}: expected more than 0")
        self.capture: ReplaySource = read(path)
        self.speed = speed
        self.sent = 0
        self.error = ""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="replay", daemon=True)

    def start(self) -> None:
        """Wait for a listener, in a thread."""
        self._thread.start()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; whether it has come."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def close(self) -> None:
        """End it; harmless when called twice."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def __enter__(self) -> Replay:
        self.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _run(self) -> None:
        try:
            self._play(self.capture)
        except (BrokenPipeError, ConnectionError):
            self.error = f"the listener went away after {self.sent} octets"
        except Exception as error:  # in a thread nobody else would hear of it
            self.error = str(error)

    def _play(self, capture: ReplaySource) -> None:
        raise NotImplementedError

    def _paced(self, capture: ReplaySource) -> Iterator[bytes]:
        """The octets of each chunk when it is due; ends early when stopped."""
        began, first = time.monotonic(), None
        for item in capture.items():
            if not isinstance(item, Chunk):
                continue
            first = item.time if first is None else first
            wait = began + (item.time - first) / 1e9 / self.speed - time.monotonic()
            if self._stop.wait(max(0.0, wait)):
                return
            yield item.octets
            self.sent += len(item.octets)


class PtyReplay(Replay):
    """On a pseudo-terminal of its own. Raises OSError where the system has none."""

    def __init__(self, path: Path, speed: float = 1.0) -> None:
        super().__init__(path, speed)
        import pty
        import tty

        self._master, slave = pty.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        os.close(slave)
        os.set_blocking(self._master, False)

    def close(self) -> None:
        """End it and take the pseudo-terminal away."""
        super().close()
        if self._master >= 0:
            os.close(self._master)
            self._master = -1

    def _play(self, capture: ReplaySource) -> None:
        import select

        poller = select.poll()
        poller.register(self._master, 0)
        while poller.poll(0):  # hung up: nobody has opened the other side
            if self._stop.wait(PATIENCE):
                return
        for octets in self._paced(capture):
            _put(octets, lambda data: os.write(self._master, data), self._stop)


class TcpReplay(Replay):
    """On a TCP port of this machine for one listener, as a serial gateway would (`socket://127.0.0.1:PORT`)."""

    def __init__(self, path: Path, speed: float = 1.0, port: int = 0) -> None:
        super().__init__(path, speed)
        self._server = socket.create_server(("127.0.0.1", port))
        self._server.settimeout(PATIENCE)
        self.port = f"socket://127.0.0.1:{self._server.getsockname()[1]}"

    def close(self) -> None:
        """End it and close the port."""
        super().close()
        self._server.close()

    def _play(self, capture: ReplaySource) -> None:
        client = self._accept()
        if client is None:
            return
        with client:
            client.setblocking(False)
            for octets in self._paced(capture):
                _put(octets, client.send, self._stop)
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_WR)

    def _accept(self) -> socket.socket | None:
        while not self._stop.is_set():
            try:
                return self._server.accept()[0]
            except TimeoutError:
                continue
        return None


def _put(octets: bytes, write: Callable[[bytes], int], stop: threading.Event) -> None:
    """All of the octets, waiting while the other side does not read."""
    while octets and not stop.is_set():
        try:
            octets = octets[write(octets) :]
        except BlockingIOError:
            stop.wait(0.001)
