"""The capture process: `python -m sniff.capture.process`, told what to do over its standard input.

It has a session of its own, so that neither Ctrl-C nor the end of the terminal reaches it. SIGTERM and SIGINT end it
with its files closed; SIGHUP is ignored. When the main process dies while a recording runs, the recording goes on until
it is told to stop (`kill PID`), its time is over, or its ports are gone for good. Without a recording it ends.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
from types import FrameType

from sniff.capture.config import CaptureConfig
from sniff.capture.loop import CaptureLoop, farewell
from sniff.capture.outlet import Outlet
from sniff.capture.priority import raise_priority
from sniff.capture.wire import Kind, MessageSplitter, WireError, decode_json, encode_json
from sniff.formats import CaptureError
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder
from sniff.session import Adapter, Session
from sniff.sources import PortError, Source, open_source
from sniff.sources.clock import Clock

SWITCH = 0.0002
"""Seconds after which a recorder's thread must give way to the reader."""


def main() -> int:
    """Run one capture; 0 when it ended as asked."""
    commands, answers = _own_pipes()
    config = _read_config(commands)
    sys.setswitchinterval(SWITCH)
    priority = raise_priority()  # before the recorders start their threads, which inherit it
    clock = Clock.start()
    sources: list[Source] = []
    try:
        for spec in config.sources:
            sources.append(open_source(spec.spec, spec.line, clock))
        sessions = [session_of(config, index, source.session_adapter, clock) for index, source in enumerate(sources)]
        recorders = open_recorders(config, sessions)
    except (PortError, CaptureError, OSError, ValueError) as error:
        for source in sources:
            source.close()
        kind = "port" if isinstance(error, PortError) else "capture"
        os.write(answers, encode_json(Kind.FAILED, {"kind": kind, "text": str(error)}))
        return 4
    return _capture(config, clock, sources, sessions, recorders, commands, answers, priority)


def session_of(config: CaptureConfig, index: int, adapter: Adapter, clock: Clock) -> Session:
    """What is known of a bus at the start of its capture."""
    spec = config.sources[index]
    return Session(spec.spec, spec.line, spec.protocol, clock.wall, spec.bus, adapter)


def open_recorders(config: CaptureConfig, sessions: list[Session]) -> list[Recorder]:
    """One a bus; none without a recording. Raises CaptureError or ValueError."""
    record = config.record
    if record is None:
        return []
    rotation = None if record.rotation is None else Rotation.parse(record.rotation)
    opened: list[Recorder] = []
    try:
        for spec, session in zip(config.sources, sessions, strict=True):
            opened.append(Recorder(record.path_of(spec, config.sources), session, rotation, record.keep))
    except BaseException:
        for recorder in opened:
            recorder.close()
        raise
    return opened


def _capture(
    config: CaptureConfig,
    clock: Clock,
    sources: list[Source],
    sessions: list[Session],
    recorders: list[Recorder],
    commands: int,
    answers: int,
    priority: str,
) -> int:
    outlet = Outlet(answers, len(sources))
    paths = [str(recorder.path) for recorder in recorders]
    hello = {
        "pid": os.getpid(),
        "priority": priority,
        "wall": clock.wall,
        "monotonic": clock.monotonic,
        "sessions": [session.to_metadata() for session in sessions],
        "paths": paths,
    }
    outlet.send(encode_json(Kind.HELLO, hello))
    loop = CaptureLoop(clock, sources, recorders, outlet, commands, priority=priority)
    if config.duration is not None:
        loop.end_at = clock.now() + config.duration
    waker = _end_on_signals(loop)
    try:
        reason = loop.run()
    finally:
        for source in sources:
            source.close()
        for recorder in recorders:
            recorder.close()
    waker.close()
    farewell(outlet, reason)
    return 0


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


def _own_pipes() -> tuple[int, int]:
    """Standard input and output for this protocol alone: nothing that prints may disturb it."""
    commands, answers = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    os.close(nothing)
    return commands, answers


def _read_config(commands: int) -> CaptureConfig:
    splitter = MessageSplitter()
    while True:
        data = os.read(commands, 4096)
        if not data:
            raise SystemExit("sniff485: the capture process is started by sniff485 itself")
        for kind, _, body in splitter.feed(data):
            if kind != Kind.CONFIG:
                raise WireError(f"message {kind} before the settings")
            return CaptureConfig.from_json(decode_json(body))


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(main())
