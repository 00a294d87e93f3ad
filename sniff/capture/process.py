"""The capture process: `python -m sniff.capture.process`, told what to do over a connection.

It has a session of its own, so that neither Ctrl-C nor the end of the terminal reaches it. SIGTERM and SIGINT end it
with its files closed; SIGHUP is ignored. When the main process dies while a recording runs, the recording goes on until
it is told to stop (`kill PID`), its time is over, or its ports are gone for good. Without a recording it ends.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import socket
import stat
import sys
from types import FrameType

from sniff.capture.config import CaptureConfig, RecordSpec, SourceSpec
from sniff.capture.ipc import IpcError, IpcKind, MessageSplitter, decode_json, encode_ended, encode_json
from sniff.capture.ipc_sender import IpcSender
from sniff.capture.loop import CaptureLoop
from sniff.capture.priority import raise_priority
from sniff.engine.capture import CaptureError
from sniff.engine.session import Session
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder, SharedFile
from sniff.sources import PortError, Source, open_source
from sniff.sources.capture_file import CaptureFileSource
from sniff.sources.clock import Clock
from sniff.sources.growing_recording import GrowingRecordingSource

FAREWELL = 2.0
"""Seconds that the last message may wait for its reader."""

CRASH_PATIENCE = 5.0
"""Seconds for each file after a defect of the loop."""

SWITCH = 0.0002
"""Seconds after which a recorder's thread must give way to the reader."""


def main() -> int:
    """Run one capture; 0 when it ended as asked, LOSSY when that left octets unrecorded."""
    connection = connect()
    config = _read_config(connection)
    sys.setswitchinterval(SWITCH)
    priority = raise_priority()  # before the recorders start their threads, which inherit it
    clock = Clock.start()
    sources: list[Source] = []
    try:
        for spec in config.sources:
            sources.append(_opened(spec, clock))
        sessions = [session_of(*pair, clock) for pair in zip(config.sources, sources, strict=True)]
        recorders = open_recorders(config, sessions)
    except (PortError, CaptureError, OSError, ValueError) as error:
        for source in sources:
            source.close()
        kind = "port" if isinstance(error, PortError) else "capture"
        connection.sendall(encode_json(IpcKind.FAILED, {"kind": kind, "text": str(error)}))
        return 4
    return _capture(config, clock, sources, sessions, recorders, connection, priority)


def _opened(spec: SourceSpec, clock: Clock) -> Source:
    """The source of a bus. Raises PortError."""
    if not spec.patient:
        return open_source(spec.spec, spec.line, clock)
    from sniff.sources.awaited import AwaitedSource

    return AwaitedSource(spec.spec, spec.line, clock, open_source)


def session_of(spec: SourceSpec, source: Source, clock: Clock) -> Session:
    """What is known of a bus at the start of its capture."""
    started = source.session.started if isinstance(source, CaptureFileSource | GrowingRecordingSource) else clock.wall
    return Session(
        spec.spec,
        spec.line,
        spec.protocol,
        started,
        spec.bus,
        source.session_adapter,
        notes=spec.notes,
        unknown=spec.unknown,
        profiles=spec.profiles,
    )


def open_recorders(config: CaptureConfig, sessions: list[Session]) -> list[Recorder]:
    """One a bus, into one file; none without a recording. Raises CaptureError or ValueError."""
    record = config.record
    if record is None:
        return []
    rotation = None if record.rotation is None else Rotation.parse(record.rotation)
    shared = SharedFile(record.path, sessions, rotation, record.keep, record.keep_free, record.keep_of_all)
    return shared.recorders()


def round_triggers(record: RecordSpec | None) -> tuple[int, int] | None:
    """What of a recording is kept round a trigger, ns before and after; None where all is."""
    if record is None or (record.before is None and record.after is None):
        return None
    return record.before or 0, record.after or 0


def _capture(
    config: CaptureConfig,
    clock: Clock,
    sources: list[Source],
    sessions: list[Session],
    recorders: list[Recorder],
    connection: socket.socket,
    priority: str,
) -> int:
    outlet = IpcSender(connection, len(sources))
    paths = [str(recorder.path) for recorder in recorders]
    hello = {
        "pid": os.getpid(),
        "priority": priority,
        "wall": clock.wall,
        "monotonic": clock.monotonic,
        "sessions": [session.to_metadata() for session in sessions],
        "paths": paths,
    }
    outlet.post(encode_json(IpcKind.HELLO, hello))
    loop = CaptureLoop(
        clock,
        sources,
        recorders,
        outlet,
        connection,
        priority=priority,
        count=config.count,
        sessions=sessions,
        watched=config.watched,
        round_triggers=round_triggers(config.record),
    )
    if config.duration is not None:
        loop.end_at = clock.now() + config.duration
    waker = _end_on_signals(loop)
    gc.freeze()  # what is there by now stays: no need to look through it again and again
    try:
        reason = loop.run()
    except BaseException:
        for recorder in recorders:
            recorder.finish()
        for recorder in recorders:
            recorder.close(CRASH_PATIENCE)
        raise
    finally:
        for source in sources:
            source.close()
    code = loop.finish()
    waker.close()
    outlet.finish(encode_ended(reason, loop.at_end), FAREWELL)
    return code


def _end_on_signals(loop: CaptureLoop) -> socket.socket:
    """SIGTERM and SIGINT end the loop, at once although it waits."""
    here, there = socket.socketpair()
    here.setblocking(False)
    there.setblocking(False)

    def stop(number: int, _: FrameType | None) -> None:
        loop.stop(f"stopped by {signal.Signals(number).name}")

    for name in ("SIGINT", "SIGTERM", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), stop)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.set_wakeup_fd(there.detach(), warn_on_full_buffer=False)
    loop.waker = here
    return here


def connect() -> socket.socket:
    """The connection to the main process, by standard input.

    It is that connection, or (Windows) a pipe that says where to connect to and what to say there first.
    """
    if stat.S_ISSOCK(os.fstat(0).st_mode):
        connection = socket.socket(fileno=os.dup(0))
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        os.close(nothing)
        return connection
    port, token = sys.stdin.readline().split()
    connection = socket.create_connection(("127.0.0.1", int(port)))
    connection.sendall(bytes.fromhex(token))
    return connection


def _read_config(connection: socket.socket) -> CaptureConfig:
    splitter = MessageSplitter()
    while True:
        data = connection.recv(4096)
        if not data:
            raise SystemExit("sniff485: the capture process is started by sniff485 itself")
        for kind, _, body in splitter.feed(data):
            if kind != IpcKind.CONFIG:
                raise IpcError(f"message {kind} before the settings")
            return CaptureConfig.from_json(decode_json(body))


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(main())
