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
from sniff.capture.disk_watch import SLOW, DiskWatch
from sniff.capture.frame_counter import FrameCounter
from sniff.capture.ipc import (
    LOSSY,
    IpcError,
    IpcKind,
    MessageSplitter,
    Status,
    decode_derived,
    decode_trigger,
    encode_status,
    encode_tick,
)
from sniff.capture.ipc_sender import IpcSender
from sniff.capture.run_watch import RunWatch
from sniff.capture.trigger_ring import TriggerRing
from sniff.capture.waiting import Waiting
from sniff.engine.session import Item, LineEvent, LineEventKind, Session, SettingsChange, refusal
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
_FAR = 1 << 62


@dataclass
class _Bus:
    """A source and what the loop knows of it."""

    index: int
    source: Source
    recorder: Recorder | None = None
    ring: TriggerRing | None = None
    fd: int | None = None
    due: int = _FAR
    octets: int = 0
    ended: bool = False


@dataclass
class CaptureLoop:
    """Runs until somebody says `stop`. `commands`: the connection that the main process sends on, None for none.

    `sessions`: of the sources, in their order; where settings are searched for, the first item of a bus says so.
    `end_at`, `count`: its limits, ns on the clock and frames of all buses. `round_triggers`: ns before and after a
    trigger that are recorded, and nothing else is. `watched`: whether somebody looks at what
    comes as it comes.
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
    reason: str | None = None
    at_end: bool = False
    closing: bool = False
    _hurried: bool = False
    _offset: int = 0
    _due: int = _FAR
    _runs: RunWatch = field(default_factory=lambda: RunWatch(0))
    _heard: bool = False  # since the last step
    _buses: list[_Bus] = field(default_factory=list)

    def run(self) -> str:
        """Capture; why it ended, in words."""
        self.begin()
        while self.reason is None:
            self.step()
        return self.rest()

    def begin(self) -> None:
        """Take what is there at first; `step` does one turn from then on, until there is a `reason` to end."""
        self._waiting = Waiting()
        recorders: list[Recorder | None] = [*self.recorders] or [None] * len(self.sources)
        self._buses = [
            _Bus(index, source, recorder, self._ring(recorder))
            for index, (source, recorder) in enumerate(zip(self.sources, recorders, strict=True))
        ]
        self._splitter = MessageSplitter()
        self._counters = [FrameCounter(session) for session in self.sessions] if self.count is not None else []
        self._watches = [DiskWatch() for _ in self.recorders]
        self._seeking = {index for index, session in enumerate(self.sessions) if "line" in session.unknown}
        self._unknown = {index for index, session in enumerate(self.sessions) if session.unknown}
        self._beat_while_busy = BEAT if self.watched or self._unknown or self._counters else UNWATCHED_BEAT
        now = self.clock.now()
        self._beat_at = self._status_at = now
        self._runs = RunWatch(now)
        self._busy_until = now
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

    def _ring(self, recorder: Recorder | None) -> TriggerRing | None:
        return TriggerRing(recorder, *self.round_triggers) if self.round_triggers and recorder is not None else None

    def finish(self) -> int:
        """Close the files; a slow disk is waited for, and said. The exit code: LOSSY when not everything is in them."""
        self.closing = True
        for bus in self._buses:
            if bus.ring is not None:
                bus.ring.finish()
        for recorder in self.recorders:
            recorder.finish()
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
        until = time.monotonic() + SYNC_PATIENCE
        for recorder in self.recorders:
            recorder.give_up()
            if recorder.finished:
                recorder.synced(max(0.0, until - time.monotonic()))
        for bus in self._buses:
            for text in bus.recorder.notices if bus.recorder is not None else ():  # of the last look at the file
                self.outlet.item(bus.index, LineEvent(bus.source.now(), LineEventKind.NOTE, text))
            self.outlet.post(encode_status(self.status(bus.index)))
        return LOSSY if any(recorder.trouble or recorder.lost_octets for recorder in self.recorders) else 0

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
                self._keep(bus.index, LineEvent(bus.source.now(), LineEventKind.DROPPED, text, -1))

    def _take(self, bus: _Bus) -> bool:
        """One read of a source; whether it gave anything."""
        source = bus.source
        index = bus.index
        items = source.read()
        for item in items:
            self._keep(index, item)
            if isinstance(item, Chunk):
                bus.octets += len(item.octets)
        if items:
            self._heard = True
        fd = source.fileno()
        if fd != bus.fd:
            self._watch(bus, fd)
        deadline = source.deadline()
        if deadline != bus.due:
            self._set_due(bus, _FAR if deadline is None else deadline)
        if source.ended and not bus.ended:
            bus.ended = True
            self._set_due(bus, _FAR)
            self._watch(bus, None)
            if all(other.ended for other in self._buses):
                self.at_end = self.reason is None
                self.stop("nothing more to read")
        return bool(items)

    def _set_due(self, bus: _Bus, due: int) -> None:
        if bus.due != due:
            bus.due = due
            self._due = min(other.due for other in self._buses)

    def _keep(self, index: int, item: Item) -> None:
        recorder, ring = self._buses[index].recorder, self._buses[index].ring
        if ring is not None:
            ring.take(item)
        elif recorder is not None:
            if isinstance(item, Chunk):
                recorder.chunk(item)
            else:
                recorder.line(item)
        if self._counters:
            self._counters[index].item(item)
        self.outlet.item(index, item)

    def _watch(self, bus: _Bus, fd: int | None) -> None:
        if bus.fd is not None:
            self._waiting.unregister(bus.fd)
        bus.fd = fd
        if fd is not None:
            self._waiting.register(fd, partial(self._take, bus))

    # -- beats -------------------------------------------------------------------------------------------------

    def _beat(self, now: int) -> None:
        for recorder in self.recorders:
            recorder.tick(now)
        news = self._watch_disk(now)
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
        if self.count is not None:
            for counter, bus in zip(self._counters, self._buses, strict=True):
                counter.advance(bus.source.now())
            if sum(counter.frames for counter in self._counters) >= self.count:
                self.stop("the number of frames asked for is reached")
        if not self.recorders and not self.outlet.open:
            self.stop("nobody listens")

    def _watch_disk(self, now: int) -> bool:
        """Say, in the recording too, what is new about the files and the disk; whether anything is."""
        news = False
        for index, (recorder, watch) in enumerate(zip(self.recorders, self._watches, strict=True)):
            told = [recorder.notices.popleft() for _ in range(len(recorder.notices))]
            # trouble is said, and explains that nothing is written; so does that nobody ran
            runs = self._runs.runs_since(now)
            explained = recorder.trouble is not None or (runs is not None and runs < SLOW)
            slow = None
            if explained:
                watch.excuse(recorder.lost_octets)
            else:
                slow = watch.see(now, recorder.behind(now), recorder.syncing, recorder.lost_octets)
            for text in told + ([slow] if slow is not None else []):
                news = True
                self._keep(index, LineEvent(self._buses[index].source.now(), LineEventKind.NOTE, text))
        return news

    def _check_clock(self) -> None:
        offset = self.clock.drift()
        if abs(offset - self._offset) > STEP:
            self._offset = offset
            off = f"{offset / MS:+.3f} ms" if abs(offset) < NS_PER_S else f"{offset / NS_PER_S:+.3f} s"
            text = f"wall clock is {off} from the capture's"
            for bus in self._buses:
                self._keep(bus.index, LineEvent(bus.source.now(), LineEventKind.CLOCK, text, offset))

    def _send_status(self) -> None:
        for bus in self._buses:
            self.outlet.droppable(encode_status(self.status(bus.index)))

    def status(self, index: int) -> Status:
        """How one bus is doing."""
        octets, dropped = self._buses[index].octets, self.outlet.dropped[index]
        if not self.recorders:
            return Status(index, octets=octets, dropped=dropped, priority=self.priority)
        recorder, ring = self.recorders[index], self._buses[index].ring
        return Status(
            index,
            "" if recorder.gone else str(recorder.path),
            recorder.size,
            octets,
            dropped,
            recorder.lost_octets,
            self.priority,
            recorder.trouble or "",
            self._watches[index].behind / NS_PER_S,
            recorder.unwritten,
            self.closing,
            0 if ring is None else ring.omitted,
            recorder.taken_away,
        )

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
            elif self._seeking:
                self.stop("the main process is gone, which searched for the line settings")
            elif self.count is not None and self._unknown:
                self.stop("the main process is gone, which searched for the protocol whose frames are counted")

    def _command(self, kind: int, bus: int, body: bytes) -> None:
        if kind == IpcKind.STOP:
            self.stop("stopped")
        elif kind == IpcKind.FOUND and bus < len(self._buses):
            change = SettingsChange.parse(body.decode("utf-8", "replace"))
            self._seeking.discard(bus)
            self._unknown.discard(bus)
            self._take(self._buses[bus])
            self._settings(self._buses[bus], replace(change, searching=False, found=True))
        elif kind == IpcKind.TRIGGER and bus < len(self._buses):
            self._fire(bus, *decode_trigger(body))
        elif kind in (IpcKind.MARK, IpcKind.UNMARK) and bus < len(self._buses):
            self._mark(bus, LineEventKind.MARK if kind == IpcKind.MARK else LineEventKind.UNMARK, *decode_trigger(body))
        elif kind == IpcKind.DERIVED and bus < len(self.recorders):
            derived = decode_derived(body)
            ring = self._buses[bus].ring
            if ring is None or ring.keeps(derived.log_time):
                self.recorders[bus].derived(derived)
        elif kind == IpcKind.RECONFIGURE and bus < len(self._buses):
            source = self._buses[bus].source
            line = body.decode("ascii", "replace")
            self._take(self._buses[bus])  # what is there was heard with the settings before
            try:
                source.reconfigure(LineSettings.parse(line))
            except (PortError, ValueError) as error:
                self._keep(bus, LineEvent(source.now(), LineEventKind.REFUSED, refusal(line, str(error))))
            self._take(self._buses[bus])

    def _mark(self, bus: int, what: LineEventKind, time: int, text: str) -> None:
        """What a person wrote about a moment; events stand in order of time, so it says how long ago that was."""
        now = self._buses[bus].source.now()
        self._keep(bus, LineEvent(now, what, text, max(0, now - time)))

    def _fire(self, bus: int, time: int, text: str) -> None:
        """A trigger: of a recording that keeps only what surrounds such, that of all buses; else a mark on its own."""
        event = LineEvent(self._buses[bus].source.now(), LineEventKind.TRIGGER, text)
        if self._buses[bus].ring is None:
            self._keep(bus, event)
            return
        self.outlet.item(bus, event)
        for other in self._buses:
            if other.ring is not None:
                said = text if other.index == bus else f"on {self.sessions[bus].bus}: {text}"
                other.ring.fire(time, said)

    def _settings(self, bus: _Bus, change: SettingsChange) -> None:
        """Say in the recording and to the main process what the settings are from here on."""
        self._keep(bus.index, LineEvent(bus.source.now(), LineEventKind.SETTINGS, str(change)))
