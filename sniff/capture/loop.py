"""The capture loop: wait for octets, stamp them, hand them to recorder and pipe. Nothing in it waits but the poll.

Time is cut into beats. In each beat what came is gathered and goes into the pipe in one write, closed by a Tick for
every bus: all that the bus gave up to then has been sent. Beats are 20 ms apart while octets come and shortly after
(100 ms where nobody watches), 250 ms in silence.
"""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass, field, replace
from functools import partial

from dissectors.frame import Chunk
from dissectors.line import MS, NS_PER_S, LineSettings
from sniff.capture.captured_bus import FAR, CapturedBus
from sniff.capture.disk_watch import SLOW
from sniff.capture.frame_counter import FrameCounter
from sniff.capture.ipc import (
    LOSSY,
    IpcError,
    IpcKind,
    MessageSplitter,
    decode_derived,
    decode_trigger,
    encode_status,
    encode_tick,
)
from sniff.capture.ipc_sender import IpcSender
from sniff.capture.run_watch import RunWatch
from sniff.capture.trigger_ring import TriggerRing
from sniff.capture.waiting import Waiting
from sniff.engine.event_texts import SettingsChange, refusal
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.recording.writer import Recorder
from sniff.sources import PortError, Source
from sniff.sources.clock import STEP, Clock

BEAT = 20 * MS
UNWATCHED_BEAT = 100 * MS
IDLE_BEAT = 250 * MS
BUSY_FOR = 100 * MS
"""After the last octet beats stay short for so long."""

STATUS_EVERY = 1000 * MS
FLUSH_AT = 32 * 1024
"""Octets gathered that are sent before the beat."""

CLOSING_PATIENCE = 30.0
"""Seconds that a disk gets for what it did not take yet, once nothing more is heard. Whoever stops again ends it."""

SYNC_PATIENCE = 1.0
"""Seconds for the last sync; the system has the octets by then."""

DRAIN = 0.2
"""Seconds for what had arrived when it was told to stop; a port gives a few thousand octets a read."""

CLOSING_EVERY = 0.5
LOOK_EVERY = 0.02
"""Seconds between words to the main process, and between looks at the files, while they are closed."""

_COMMAND_SIZE = 64 * 1024


@dataclass
class CaptureLoop:
    """Runs until somebody says `stop`. `commands`: the connection that the main process sends on, None for none.

    `sessions`: of the sources, in their order; where settings are searched for, the first item of a bus says so.
    `end_at`, `count`: its limits, ns on the clock and frames of all buses. `round_triggers`: ns before and after a
    trigger that are recorded, and nothing else is. `watched`: whether somebody looks at what comes as it comes.

    `reason`: why it ends, in words, None before; `at_end`: because there is nothing more to read. `closing`: whether
    its files are being closed.
    """

    clock: Clock
    sources: list[Source]
    recorders: list[Recorder]
    outlet: IpcSender
    commands: socket.socket | None = None
    waker: socket.socket | None = None  # readable when a signal came
    priority: str = ""
    end_at: int | None = None
    count: int | None = None
    round_triggers: tuple[int, int] | None = None
    sessions: list[Session] = field(default_factory=list)
    watched: bool = True
    reason: str | None = field(default=None, init=False)
    at_end: bool = field(default=False, init=False)
    closing: bool = field(default=False, init=False)
    _hurried: bool = field(default=False, init=False)
    _offset: int = field(default=0, init=False)  # of the wall clock from the capture's, as told last, ns
    _due: int = field(default=FAR, init=False)  # of the bus that is due first
    _heard: bool = field(default=False, init=False)  # since the last step
    _buses: list[CapturedBus] = field(default_factory=list, init=False)
    _splitter: MessageSplitter = field(default_factory=MessageSplitter, init=False)
    _waiting: Waiting = field(init=False)
    _runs: RunWatch = field(init=False)
    _beat_at: int = field(init=False)  # ns, as those that follow
    _beat_while_busy: int = field(init=False)
    _busy_until: int = field(init=False)
    _status_at: int = field(init=False)

    def run(self) -> str:
        """Capture; why it ended, in words."""
        self.begin()
        while self.reason is None:
            self.step()
        return self.rest()

    def begin(self) -> None:
        """Take what is there at first; `step` does one turn from then on, until there is a `reason` to end."""
        self._waiting = Waiting()
        self._buses = list(map(self._bus, range(len(self.sources))))
        is_awaited = self.watched or any(bus.is_unknown or bus.counter is not None for bus in self._buses)
        self._beat_while_busy = BEAT if is_awaited else UNWATCHED_BEAT
        now = self.clock.now()
        self._beat_at = self._status_at = self._busy_until = now
        self._runs = RunWatch(now)
        if self.commands is not None:
            self.commands.setblocking(False)
            self._waiting.register(self.commands.fileno(), self._take_commands)
        if self.waker is not None:
            waker = self.waker
            self._waiting.register(waker.fileno(), lambda: waker.recv(64))
        for session, bus in zip(self.sessions, self._buses, strict=False):
            if session.unknown:  # before the first octet: it was heard with settings that are only tried
                self._settings(bus, SettingsChange(session.line, searching=True))
        for bus in self._buses:
            self._take(bus)

    def rest(self) -> str:
        """After the last turn: what arrived meanwhile; why it ended, in words."""
        until = time.monotonic() + DRAIN
        for bus in self._buses:
            while not bus.ended and self._take(bus) and time.monotonic() < until:
                pass
        self._beat(self.clock.now())
        return self.reason or "stopped"

    def _bus(self, index: int) -> CapturedBus:
        recorder = self.recorders[index] if self.recorders else None
        ring = TriggerRing(recorder, *self.round_triggers) if self.round_triggers and recorder is not None else None
        bus = CapturedBus(index, self.sources[index], recorder, ring)
        if self.sessions:
            session = self.sessions[index]
            bus.seeks_line, bus.is_unknown = "line" in session.unknown, bool(session.unknown)
            bus.counter = FrameCounter(session) if self.count is not None else None
        return bus

    def finish(self) -> int:
        """Close the files; a slow disk is waited for, and said. The exit code: LOSSY when not everything is in them."""
        self.closing = True
        for bus in self._buses:
            if bus.ring is not None:
                bus.ring.finish()
        for recorder in self.recorders:
            recorder.finish()
        self._wait_for_files()
        until = time.monotonic() + SYNC_PATIENCE
        for recorder in self.recorders:
            recorder.give_up()
            if recorder.finished:
                recorder.synced(max(0.0, until - time.monotonic()))
        for bus in self._buses:
            for text in bus.recorder.notices if bus.recorder is not None else ():  # of the last look at the file
                self.outlet.item(bus.index, LineEvent(bus.source.now(), LineEventKind.NOTE, text))
            self.outlet.post(self._status(bus))
        return LOSSY if any(recorder.trouble or recorder.lost_octets for recorder in self.recorders) else 0

    def _wait_for_files(self) -> None:
        """Until the disk has taken all, or its time is over, or somebody wants it no more."""
        until = time.monotonic() + CLOSING_PATIENCE
        said = time.monotonic() + CLOSING_EVERY
        while not all(recorder.finished for recorder in self.recorders) and not self._hurried:
            now = time.monotonic()
            if now >= until:
                break
            if now >= said:
                said = now + CLOSING_EVERY
                self._send_status()
                self.outlet.flush()
            for fd, call in self._waiting.wait(LOOK_EVERY):
                if fd not in [bus.fd for bus in self._buses]:
                    call()

    def stop(self, reason: str) -> None:
        """End soon; the first reason counts. Said again while files are closed, they are not waited for any longer."""
        self._hurried = self.closing
        self.reason = self.reason or reason

    # -- one turn ----------------------------------------------------------------------------------------------

    def step(self) -> None:
        """One turn: wait for whatever comes first, and take it."""
        wait = max(0, min(self._beat_at, self._due) - self.clock.now())
        ready = self._waiting.wait(wait / 1e9)
        now = self.clock.now()
        stalled = self._runs.see(now, wait)
        if stalled is not None:
            self._say_stalled(stalled)
        for _, call in ready:
            call()
        now = self.clock.now()
        if self._heard:
            self._heard = False
            self._busy_until = now + BUSY_FOR
            self._beat_at = min(self._beat_at, now + self._beat_while_busy)
        if self._due <= now:
            for bus in self._buses:
                if bus.due <= now:
                    self._take(bus)
        if now >= self._beat_at or self.outlet.gathered > FLUSH_AT:
            self._beat(now)

    def _say_stalled(self, time: int) -> None:
        """Nobody read for so long, ns. Buffers hold some of what came, as if it had come now."""
        for bus in self._buses:
            if bus.fd is not None:
                text = f"nobody knows how many: this process did not run for {time / NS_PER_S:.0f} s"
                self._say(bus, LineEventKind.DROPPED, text, -1)

    def _take(self, bus: CapturedBus) -> bool:
        """One read of a source; whether it gave anything."""
        source = bus.source
        items = source.read()
        for item in items:
            self._keep(bus, item)
            if isinstance(item, Chunk):
                bus.octets += len(item.octets)
        if items:
            self._heard = True
        fd = source.fileno()
        if fd != bus.fd:
            self._watch(bus, fd)
        deadline = source.deadline()
        if deadline != bus.due:
            self._set_due(bus, FAR if deadline is None else deadline)
        if source.ended and not bus.ended:
            bus.ended = True
            self._set_due(bus, FAR)
            self._watch(bus, None)
            if all(other.ended for other in self._buses):
                self.at_end = self.reason is None
                self.stop("nothing more to read")
        return bool(items)

    def _set_due(self, bus: CapturedBus, due: int) -> None:
        if bus.due != due:
            bus.due = due
            self._due = min(other.due for other in self._buses)

    def _keep(self, bus: CapturedBus, item: Item) -> None:
        bus.keep(item)
        self.outlet.item(bus.index, item)

    def _say(self, bus: CapturedBus, kind: LineEventKind, text: str, count: int = 0) -> None:
        """Something happened to a bus just now; the recording and the main process are told."""
        self._keep(bus, LineEvent(bus.source.now(), kind, text, count))

    def _watch(self, bus: CapturedBus, fd: int | None) -> None:
        if bus.fd is not None:
            self._waiting.unregister(bus.fd)
        bus.fd = fd
        if fd is not None:
            self._waiting.register(fd, partial(self._take, bus))

    # -- beats -------------------------------------------------------------------------------------------------

    def _beat(self, now: int) -> None:
        for recorder in self.recorders:
            recorder.tick(now)
        news = self._watch_files(now)
        for bus in self._buses:
            self.outlet.droppable(encode_tick(bus.index, bus.source.now()))
        if news or now >= self._status_at:
            self._status_at = now + STATUS_EVERY
            self._check_clock()
            self._send_status()
        self.outlet.flush()
        busy = now < self._busy_until or self.outlet.size
        self._beat_at = now + (self._beat_while_busy if busy else IDLE_BEAT)
        for recorder in self.recorders:
            if recorder.due is not None:
                self._beat_at = min(self._beat_at, max(now, recorder.due))
        if self.end_at is not None:
            self._beat_at = min(self._beat_at, self.end_at)
            if now >= self.end_at:
                self.stop("the time asked for is over")
        if self.count is not None and self._count_frames() >= self.count:
            self.stop("the number of frames asked for is reached")
        if not self.recorders and not self.outlet.open:
            self.stop("nobody listens")

    def _count_frames(self) -> int:
        """Of all buses so far."""
        frames = 0
        for bus in self._buses:
            if bus.counter is not None:
                bus.counter.advance(bus.source.now())
                frames += bus.counter.frames
        return frames

    def _watch_files(self, now: int) -> bool:
        """Say, in the recording too, what is new about the files and the disk; whether anything is."""
        runs = self._runs.runs_since(now)
        was_held_up = runs is not None and runs < SLOW
        news = [(bus, text) for bus in self._buses for text in bus.file_news(now, was_held_up)]
        for bus, text in news:
            self._say(bus, LineEventKind.NOTE, text)
        return bool(news)

    def _check_clock(self) -> None:
        offset = self.clock.drift()
        if abs(offset - self._offset) > STEP:
            self._offset = offset
            off = f"{offset / MS:+.3f} ms" if abs(offset) < NS_PER_S else f"{offset / NS_PER_S:+.3f} s"
            text = f"wall clock is {off} from the capture's"
            for bus in self._buses:
                self._say(bus, LineEventKind.CLOCK, text, offset)

    def _send_status(self) -> None:
        for bus in self._buses:
            self.outlet.droppable(self._status(bus))

    def _status(self, bus: CapturedBus) -> bytes:
        return encode_status(bus.status(self.outlet.dropped[bus.index], self.priority, self.closing))

    # -- what the main process says ----------------------------------------------------------------------------

    def _take_commands(self) -> None:
        assert self.commands is not None
        try:
            data = self.commands.recv(_COMMAND_SIZE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        try:
            for kind, bus, body in self._splitter.feed(data):
                self._command(kind, bus, body)
        except IpcError:
            data = b""  # not our main process: stop listening to it
        if not data:
            self._waiting.unregister(self.commands.fileno())
            self.commands = None
            if self.closing:
                return
            if not self.recorders:
                self.stop("the main process is gone")
            elif any(bus.seeks_line for bus in self._buses):
                self.stop("the main process is gone, which searched for the line settings")
            elif self.count is not None and any(bus.is_unknown for bus in self._buses):
                self.stop("the main process is gone, which searched for the protocol whose frames are counted")

    def _command(self, kind: int, index: int, body: bytes) -> None:
        if kind == IpcKind.STOP:
            self.stop("stopped")
            return
        if index >= len(self._buses):
            return
        bus = self._buses[index]
        if kind == IpcKind.FOUND:
            self._find(bus, SettingsChange.parse(body.decode("utf-8", "replace")))
        elif kind == IpcKind.TRIGGER:
            self._fire(bus, *decode_trigger(body))
        elif kind == IpcKind.MARK:
            self._mark(bus, LineEventKind.MARK, *decode_trigger(body))
        elif kind == IpcKind.UNMARK:
            self._mark(bus, LineEventKind.UNMARK, *decode_trigger(body))
        elif kind == IpcKind.DERIVED:
            bus.keep_derived(decode_derived(body))
        elif kind == IpcKind.RECONFIGURE:
            self._reconfigure(bus, body.decode("ascii", "replace"))

    def _find(self, bus: CapturedBus, found: SettingsChange) -> None:
        """What a search came to."""
        bus.seeks_line = bus.is_unknown = False
        self._take(bus)
        self._settings(bus, replace(found, searching=False, found=True))

    def _reconfigure(self, bus: CapturedBus, line: str) -> None:
        """Change the line settings of its port, or say why they are not taken."""
        self._take(bus)  # what is there was heard with the settings before
        try:
            bus.source.reconfigure(LineSettings.parse(line))
        except (PortError, ValueError) as error:
            self._say(bus, LineEventKind.REFUSED, refusal(line, str(error)))
        self._take(bus)

    def _mark(self, bus: CapturedBus, kind: LineEventKind, time: int, text: str) -> None:
        """What a person wrote about a moment; events stand in order of time, so it says how long ago that was."""
        now = bus.source.now()
        self._keep(bus, LineEvent(now, kind, text, max(0, now - time)))

    def _fire(self, bus: CapturedBus, time: int, text: str) -> None:
        """A trigger: of a recording that keeps only what surrounds such, that of all buses; else a mark on its own."""
        event = LineEvent(bus.source.now(), LineEventKind.TRIGGER, text)
        if bus.ring is None:
            self._keep(bus, event)
            return
        self.outlet.item(bus.index, event)
        for other in self._buses:
            if other.ring is not None:
                said = text if other is bus else f"on {self.sessions[bus.index].bus}: {text}"
                other.ring.fire(time, said)

    def _settings(self, bus: CapturedBus, change: SettingsChange) -> None:
        """Say in the recording and to the main process what the settings are from here on."""
        self._say(bus, LineEventKind.SETTINGS, str(change))
