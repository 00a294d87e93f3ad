"""The main process's end: starts the capture process, receives what it reads, sends results back."""

from __future__ import annotations

import contextlib
import selectors
import signal
import subprocess
import time
from collections import deque
from collections.abc import Sequence

from dissectors.line import LineSettings
from sniff.capture.config import CaptureConfig, RecordSpec, SourceSpec
from sniff.capture.spawn import Spawned, spawn
from sniff.capture.wire import (
    Derived,
    Ended,
    Kind,
    Message,
    MessageSplitter,
    WireError,
    decode_json,
    decode_message,
    encode,
    encode_derived,
    encode_json,
)
from sniff.formats import CaptureError
from sniff.session import Session, SettingsChange
from sniff.sources import PortError
from sniff.sources.clock import Clock

START_PATIENCE = 30.0
STOP_PATIENCE = 10.0
READ_SIZE = 64 * 1024
READ_AT_ONCE = 128 * 1024
"""Octets of messages taken by one `receive`, so that a caller that is behind still gets to draw."""

DERIVED_BACKLOG = 1024 * 1024


class CaptureLink:
    """A running capture process. A context manager: leaving it stops the capture and closes its files.

    One thread at a time may use it. `pid`: of the capture process. `priority`: what it was granted. `clock`: its
    clock. `paths`: the files that it records to at first. `derived_dropped`: results that did not go back in time.
    """

    def __init__(self, spawned: Spawned) -> None:
        process = spawned.process
        self._process = process
        self._errors = spawned.errors
        self._connection = spawned.connection
        self._sending = True
        self._splitter = MessageSplitter()
        self._waiting: deque[tuple[int, int, bytes]] = deque()
        self._unsent = bytearray()
        self._sessions: list[Session] = []
        self.pid = process.pid
        self.priority = ""
        self.paths: list[str] = []
        self.clock = Clock(0, 0)
        self.derived_dropped = 0
        self.ended: Ended | None = None

    # -- starting ----------------------------------------------------------------------------------------------

    @classmethod
    def start(
        cls, sources: Sequence[SourceSpec], record: RecordSpec | None = None, duration: float | None = None
    ) -> CaptureLink:
        """Start listening; returns when all ports are open and all files begun.

        `duration`: seconds, None for no end. Raises PortError or CaptureError with the reason.
        """
        config = CaptureConfig(tuple(sources), record, None if duration is None else int(duration * 1e9))
        words = [source.spec for source in config.sources] + ([config.record.path] if config.record else [])
        link = cls(spawn(words))
        try:
            link._greet(config)
        except BaseException:
            link._kill()
            raise
        return link

    def _greet(self, config: CaptureConfig) -> None:
        self._connection.setblocking(True)
        try:
            self._connection.sendall(encode_json(Kind.CONFIG, config.to_json()))
        except OSError as error:
            raise PortError(self._why_dead()) from error
        self._connection.setblocking(False)
        until = time.monotonic() + START_PATIENCE
        while not self._waiting:
            alive = self._fill(until - time.monotonic())
            if not self._waiting and (not alive or time.monotonic() > until):  # it may say why, and end at once
                raise PortError(self._why_dead())
        kind, _, body = self._waiting.popleft()
        value = decode_json(body)
        if kind == Kind.FAILED:
            raise (PortError if value.get("kind") == "port" else CaptureError)(str(value.get("text")))
        if kind != Kind.HELLO:
            raise PortError(f"capture process: message {kind} instead of a greeting")
        self._sessions = [Session.from_metadata(session) for session in value["sessions"]]
        self.priority = str(value["priority"])
        self.paths = [str(path) for path in value["paths"]]
        self.clock = Clock(int(value["wall"]), int(value["monotonic"]))

    def session(self, bus: int) -> Session:
        """What is known of a bus."""
        return self._sessions[bus]

    # -- receiving ---------------------------------------------------------------------------------------------

    def fileno(self) -> int:
        """What to wait on for reading."""
        return self._connection.fileno()

    def receive(self, timeout: float = 0.0) -> list[Message]:
        """What has come, in order; waits up to `timeout` seconds for something. After Ended always empty."""
        if self.ended is not None:
            return []
        self._send()
        messages: list[Message] = []
        alive = True
        try:
            if not self._waiting:
                alive = self._fill(timeout)
            while self._waiting:
                message = decode_message(*self._waiting.popleft())
                if message is not None:
                    messages.append(message)
                if isinstance(message, Ended):
                    return self._finish(messages, message)
        except WireError as error:
            self._kill()
            return self._finish(messages, Ended(f"capture process: {error}", clean=False))
        if not alive:
            return self._finish(messages, Ended(self._why_dead(), clean=False))
        return messages

    def _finish(self, messages: list[Message], ended: Ended) -> list[Message]:
        self.ended = ended
        if not messages or messages[-1] is not ended:
            messages.append(ended)
        return messages

    def _fill(self, timeout: float) -> bool:
        """Read what there is; False when the other end is closed."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._connection, selectors.EVENT_READ)
            if not selector.select(max(0, timeout)):
                return True
        taken = 0
        while taken < READ_AT_ONCE:
            try:
                data = self._connection.recv(READ_SIZE)
            except BlockingIOError:
                return True
            except OSError:
                return False
            if not data:
                return False
            taken += len(data)
            self._waiting.extend(self._splitter.feed(data))
        return True

    # -- sending -----------------------------------------------------------------------------------------------

    def derived(
        self,
        bus: int,
        topic: str,
        schema_name: str,
        log_time: int,
        publish_time: int,
        data: bytes,
        metadata: dict[str, str] | None = None,
    ) -> bool:
        """Send a result back into the file, best effort; whether it is on its way. Arguments as `Recorder.derived`."""
        if not self._sending or len(self._unsent) > DERIVED_BACKLOG:
            self.derived_dropped += 1
            return False
        self._unsent += encode_derived(Derived(bus, topic, schema_name, log_time, publish_time, data, metadata))
        self._send()
        return True

    def reconfigure(self, bus: int, line: LineSettings) -> None:
        """Change the line settings of a bus; a SETTINGS event says where they begin to hold."""
        self._unsent += encode(Kind.RECONFIGURE, bus, str(line).encode())
        self._send()

    def found(self, bus: int, line: LineSettings, protocol: str) -> None:
        """Say what a search came to; a SETTINGS event says from where on it holds, and later parts begin with it."""
        self._unsent += encode(Kind.FOUND, bus, str(SettingsChange(line, protocol, found=True)).encode())
        self._send()

    def _send(self) -> None:
        while self._unsent and self._sending:
            try:
                del self._unsent[: self._connection.send(self._unsent)]
            except BlockingIOError:
                return
            except OSError:
                self._sending = False
                self._unsent.clear()

    # -- ending ------------------------------------------------------------------------------------------------

    def stop(self, patience: float = STOP_PATIENCE) -> list[Message]:
        """End the capture and wait until its files are closed; what had not been received, Ended last.

        `patience`: seconds until it is ended by force.
        """
        messages: list[Message] = []
        if self.ended is None:
            self._unsent += encode(Kind.STOP)
            until = time.monotonic() + patience
            while self.ended is None and time.monotonic() < until:
                messages += self.receive(0.1)
            if self.ended is None:
                self._process.terminate()
                until = time.monotonic() + patience
                while self.ended is None and time.monotonic() < until:
                    messages += self.receive(0.1)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(patience)
        self._kill()
        if self.ended is None:
            self._finish(messages, Ended("capture process did not end and was killed", clean=False))
        return messages

    def __enter__(self) -> CaptureLink:
        return self

    def __exit__(self, *exc: object) -> None:
        self.stop()

    def _kill(self) -> None:
        """End the process by its id, if it still runs, and let go of everything."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._sending = False
        self._connection.close()
        self._errors.close()

    def _why_dead(self) -> str:
        try:
            code: int | None = self._process.wait(2)
        except subprocess.TimeoutExpired:
            code = None
        said = b""
        if not self._errors.closed:
            self._errors.seek(0)
            said = self._errors.read()[-2000:]
        last = said.decode("utf-8", "replace").strip().splitlines()[-1:]
        if code is None:
            return "capture process does not answer"
        how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
        return f"capture process {how}" + "".join(f": {line}" for line in last)
