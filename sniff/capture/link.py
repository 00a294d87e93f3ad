"""The main process's end: starts the capture process, receives what it reads, sends results back."""

from __future__ import annotations

import contextlib
import selectors
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from dissectors.line import LineSettings
from sniff.capture.backlog import Backlog
from sniff.capture.config import CaptureConfig, RecordSpec, SourceSpec
from sniff.capture.ending import awaited_exit_code, exit_code, in_words
from sniff.capture.ipc import (
    LOSSY,
    Batch,
    Ended,
    IpcError,
    IpcKind,
    Message,
    MessageSplitter,
    Status,
    decode_json,
    decode_message,
    encode,
    encode_derived,
    encode_json,
    encode_trigger,
    one_by_one,
)
from sniff.capture.spawn import Spawned, spawn
from sniff.engine.capture import CaptureError
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import Session
from sniff.recording.derived_message import DerivedMessage
from sniff.sources import PortError
from sniff.sources.clock import Clock

START_PATIENCE = 30.0
LEFT_TO_GREET = 2.0
"""Seconds for a process that is beginning when it is not wanted any more: it may be about to listen, and then ends in
good order."""

STOP_PATIENCE = 10.0
READ_SIZE = 64 * 1024
GIVEN_AT_ONCE = 128 * 1024
"""Octets of messages given by one `receive`, so that a caller that is behind still gets to draw."""

READ_AT_ONCE = 4 * 1024 * 1024
"""Octets read before that: all there is in good times, so that the end of the capture is seen when it comes."""

GOODBYE = 1.0
"""Seconds for a process that has said its last words, and once more when it was killed: a sync may hold it."""

NOTHING_HEARD = 3.0
"""Seconds without a word, of which there is one a second, after which it is looked whether the process is there."""

NOTHING_SAID = 10.0
"""Seconds after which somebody is told: an overloaded machine may let it wait for some."""

SILENT = "the capture process does not answer"

END_PATIENCE = 2.0
"""Seconds that a process whose connection is closed gets to end."""

DERIVED_BACKLOG = 1024 * 1024


class CaptureLink:
    """A running capture process. A context manager: leaving it stops the capture and closes its files.

    One thread at a time may use it. `pid`: of the capture process. `priority`: what it was granted. `clock`: its
    clock. `paths`: the files that it records to at first. `derived_dropped`: results that did not go back in time.
    `closing`: whether the end of the capture has come here, although other things may wait before it. `over_since`:
    when that was, or when it was asked to end, s of the monotonic clock; None before.
    """

    def __init__(self, spawned: Spawned) -> None:
        process = spawned.process
        self._process = process
        self._errors = spawned.errors
        self._connection = spawned.connection
        self._sending = True
        self._splitter = MessageSplitter()
        self._waiting = Backlog()
        self._heard_at = time.monotonic()
        self._stops = 0
        self._reported: dict[int, Status] = {}  # the newest of each bus
        self._told_to_end = 0  # how hard
        self._malformed: IpcError | None = None
        self.closing = False
        self.over_since: float | None = None
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
        cls,
        sources: Sequence[SourceSpec],
        record: RecordSpec | None = None,
        duration: float | None = None,
        count: int | None = None,
        watched: bool = True,
        is_given_up: Callable[[], bool] = lambda: False,
    ) -> CaptureLink:
        """Start listening; returns when all ports are open and all files begun.

        `duration`: seconds, `count`: frames after which it ends, whatever becomes of this process; None for no end.
        `watched`: as `CaptureConfig` has it. `is_given_up`: whether somebody wants no capture any more; one that has
        not begun soon after that is ended. Raises PortError or CaptureError with the reason, KeyboardInterrupt then.
        """
        limit = None if duration is None else int(duration * 1e9)
        config = CaptureConfig(tuple(sources), record, limit, count, watched)
        words = [source.spec for source in config.sources] + ([config.record.path] if config.record else [])
        link = cls(spawn(words))
        try:
            link._greet(config, is_given_up)
        except BaseException:
            link._kill()
            raise
        return link

    def _greet(self, config: CaptureConfig, is_given_up: Callable[[], bool]) -> None:
        self._connection.setblocking(True)
        try:
            self._connection.sendall(encode_json(IpcKind.CONFIG, config.to_json()))
        except OSError as error:
            raise PortError(self._why_dead()) from error
        self._connection.setblocking(False)
        until = time.monotonic() + START_PATIENCE
        given_up = False
        while not self._waiting:
            alive = self._fill(min(0.1, until - time.monotonic()))
            if self._waiting:
                break
            if not given_up and is_given_up():
                given_up, until = True, min(until, time.monotonic() + LEFT_TO_GREET)
            if not alive or time.monotonic() > until:  # it may say why, and end at once
                if given_up:
                    raise KeyboardInterrupt
                raise PortError(self._why_dead())
        kind, _, body = self._waiting.take()
        value = decode_json(body)
        if kind == IpcKind.FAILED:
            raise (PortError if value.get("kind") == "port" else CaptureError)(str(value.get("text")))
        if kind != IpcKind.HELLO:
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
        """What has come, in order, each read by itself; waits up to `timeout` seconds for something. After Ended always
        empty."""
        return list(one_by_one(self.receive_batches(timeout)))

    def receive_batches(self, timeout: float = 0.0) -> list[Batch]:
        """The same, many reads at a time."""
        if self.ended is not None:
            return []
        messages: list[Batch] = []
        alive = self.look(0.0 if self._waiting else timeout)
        try:
            given = 0
            while self._waiting and given < GIVEN_AT_ONCE:
                kind, bus, body = self._waiting.take()
                given += len(body)
                message = decode_message(kind, bus, body)
                if message is not None:
                    messages.append(message)
                if isinstance(message, Status):
                    self._reported[message.bus] = message
                if isinstance(message, Ended):
                    return self._finish(messages, message)
        except IpcError as malformed:
            return self._finish(messages, self._broken(malformed))
        if not messages and self._silent >= NOTHING_SAID:
            messages += self._say_silent()
        if not alive and not self._waiting:
            error = self._malformed
            return self._finish(messages, self._how_it_ended() if error is None else self._broken(error))
        return messages

    def look(self, timeout: float = 0.0) -> bool:
        """Read on, without giving anything out; whether the other end is open. After Ended it is not: who shares a
        capture may look once more when another has let it go."""
        if self.ended is not None:
            return False
        self._send()
        try:
            alive = self._malformed is None and self._fill(timeout)
        except IpcError as error:
            self._malformed = error
            alive = False
        if not alive:
            self._close()
        return alive

    def _close(self) -> None:
        self.closing = True
        self.over_since = self.over_since or time.monotonic()

    @property
    def _silent(self) -> float:
        """Seconds since anything came."""
        return time.monotonic() - self._heard_at

    def _say_silent(self) -> list[Batch]:
        """Once, what stands for the reports that do not come; the next one that does takes it back."""
        silent = [replace(status, error=SILENT) for status in self._reported.values() if status.error != SILENT]
        self._reported.update((status.bus, status) for status in silent)
        return [*silent]

    def _broken(self, error: IpcError) -> Ended:
        self._kill()
        return Ended(f"capture process: {error}", clean=False)

    def _finish(self, messages: list[Batch], ended: Ended) -> list[Batch]:
        self.ended = ended
        if not messages or messages[-1] is not ended:
            messages.append(ended)
        return messages

    def _fill(self, timeout: float) -> bool:
        """Read what there is; False when the other end is closed."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._connection, selectors.EVENT_READ)
            if not selector.select(max(0, timeout)):
                if self._silent < NOTHING_HEARD:
                    return True
                if not selector.select(0):  # one that was stopped meanwhile gives nothing, whatever has come
                    return exit_code(self._process) is None
        self._heard_at = time.monotonic()
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
            for kind, bus, body in self._splitter.feed(data):
                self._waiting.add(kind, bus, body)
                if kind == IpcKind.ENDED:
                    self._close()
        return True

    @property
    def dropped(self) -> dict[int, int]:
        """Octets of each bus that came here and were not given out, because the caller did not keep up."""
        return self._waiting.dropped

    # -- sending -----------------------------------------------------------------------------------------------

    def derived(self, bus: int, derived: DerivedMessage) -> bool:
        """Send a result back into the file, best effort; whether it is on its way."""
        if not self._sending or len(self._unsent) > DERIVED_BACKLOG:
            self.derived_dropped += 1
            return False
        self._unsent += encode_derived(bus, derived)
        self._send()
        return True

    def reconfigure(self, bus: int, line: LineSettings) -> None:
        """Change the line settings of a bus; a SETTINGS event says where they begin to hold."""
        self._unsent += encode(IpcKind.RECONFIGURE, bus, str(line).encode())
        self._send()

    def found(self, bus: int, line: LineSettings, protocol: str) -> None:
        """Say what a search came to; a SETTINGS event says from where on it holds, and later parts begin with it."""
        self._unsent += encode(IpcKind.FOUND, bus, str(SettingsChange(line, protocol, found=True)).encode())
        self._send()

    def trigger(self, bus: int, time: int, text: str) -> None:
        """Say that a trigger fired: what came round that time (ns) is kept, and a TRIGGER event says why."""
        self._unsent += encode_trigger(bus, time, text)
        self._send()

    def mark(self, bus: int, time: int, text: str | None) -> None:
        """Have a MARK event say in the recording what a person wrote about a moment (ns); None takes it away."""
        self._unsent += encode_trigger(bus, time, text or "", IpcKind.UNMARK if text is None else IpcKind.MARK)
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

    def ask_to_stop(self) -> None:
        """Have the capture end; Ended comes when its files are closed. Asked again, it no longer waits for the disk."""
        if self.ended is None:
            self._stops += 1
            self.over_since = self.over_since or time.monotonic()
            self._told_to_end = 0
            self._heard_at = time.monotonic()
            self._unsent += encode(IpcKind.STOP)
            self._send()

    def insist(self, patience: float = STOP_PATIENCE) -> Ended | None:
        """After `ask_to_stop`, between calls of `receive`: end by force what has said nothing for `patience` seconds.

        How it ended, then; None as long as there is hope. What it had not written is lost.
        """
        if self.ended is not None or not self._stops or self._silent < patience:
            return None
        if not self._told_to_end:
            self._told_to_end = 1
            self._heard_at = time.monotonic()
            self._process.terminate()
            return None
        self._kill()
        self.ended = Ended("capture process did not end and was killed", clean=False)
        return self.ended

    def stop(self, patience: float = STOP_PATIENCE) -> list[Message]:
        """End the capture and wait until its files are closed; what had not been received, Ended last.

        `patience`: seconds of silence until it is ended by force.
        """
        messages: list[Message] = []
        if self.ended is None:
            self.ask_to_stop()
        while self.ended is None:
            messages += self.receive(0.1)
            if (killed := self.insist(patience)) is not None:
                messages.append(killed)
        self.let_go()
        return messages

    def let_go(self) -> None:
        """After the end: wait for the process, which has nothing left to do, a little."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GOODBYE)
        self._kill()

    def __enter__(self) -> CaptureLink:
        return self

    def __exit__(self, *exc: object) -> None:
        self.stop()

    def _kill(self) -> None:
        """End the process by its id, if it still runs, and let go of everything."""
        if self._process.poll() is None:
            self._process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):  # a disk that hangs may hold it still
            self._process.wait(GOODBYE)
        self._sending = False
        self._connection.close()
        self._errors.close()

    def _how_it_ended(self) -> Ended:
        """Why nothing comes any more. One that ended as asked may find this side too slow for its last words."""
        code = awaited_exit_code(self._process, END_PATIENCE)
        if code in (0, LOSSY):
            lost = "; not everything was recorded" if code else ""
            return Ended(f"ended, but its last words did not arrive{lost}", lossy=bool(code), unheard=True)
        return Ended(self._why_dead(), clean=False)

    def _why_dead(self) -> str:
        said = b""
        if not self._errors.closed:
            self._errors.seek(0)
            said = self._errors.read()[-2000:]
        return in_words(awaited_exit_code(self._process, END_PATIENCE), said)
