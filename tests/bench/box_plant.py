"""A plant in simulated time for the box: buses that talk, plugs, power, a disk, a clock that is set. Seeded.

The box, the capture loop, the recorder and the models are the real ones; the time, the ports, the disk's room and the
way between the two processes are made here.
"""

from __future__ import annotations

import errno
import io
import random
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from sniff.bus.live import LiveBus
from sniff.bus.router import Router
from sniff.capture import loop as capture_loop
from sniff.capture.config import RecordSpec
from sniff.capture.ipc import Batch, Ended, MessageSplitter, decode_message
from sniff.capture.ipc_sender import IpcSender
from sniff.capture.loop import CaptureLoop
from sniff.capture.process import session_of
from sniff.cli import UNREADABLE, Failure
from sniff.cli.targets import Target
from sniff.engine.capture import CaptureError
from sniff.engine.event_texts import gone
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.rotation import Rotation
from sniff.recording.writer import SharedFile
from sniff.recording.writer_thread import SYNC, Keeper
from sniff.sources import PortError
from sniff.sources.awaited import AwaitedSource

S, MS = 1_000_000_000, 1_000_000
BASE = 1_772_359_200 * S
POLL = seal_rtu(b"\1\3\0\0\0\2")
EXCHANGE = len(POLL) + 9


class Killed(Exception):
    """The capture process stops where it is."""


class PowerCut(Exception):
    """Everything stops where it is."""


def answer(number: int) -> bytes:
    """The answer of this number: its registers are it."""
    return seal_rtu(b"\1\3\4" + number.to_bytes(4, "big"))


@dataclass
class Wire:
    """A bus that talks whether anybody listens or not: an exchange each `every` ns."""

    name: str
    every: int
    due: int
    number: int = 0
    plugged: bool = True
    unplugged_at: int = 0  # or plugged in again
    down_from: int = 0
    heard: set[int] = field(default_factory=set)
    sent_at: list[int] = field(default_factory=list)


@dataclass
class World:
    """`now`: true time, ns. `clock_wrong`: by how much the machine's wall clock is ahead of it. `capacity`: octets of
    the disk; `others`: those that other files take. `calls`: what happens when, (time, call), in order."""

    folder: Path
    dice: random.Random
    wires: list[Wire]
    now: int = BASE
    clock_wrong: int = 0
    capacity: int = 4_000_000
    others: int = 0
    calls: list[tuple[int, Callable[[], None]]] = field(default_factory=list)
    on: bool = True
    links: list[SimLink] = field(default_factory=list)

    def at(self, time: int, call: Callable[[], None]) -> None:
        self.calls.append((time, call))
        self.calls.sort(key=lambda one: one[0])

    def pass_time(self, until: int) -> None:
        """Let time pass; raises whatever happens meanwhile."""
        while self.calls and self.calls[0][0] <= until:
            time, call = self.calls.pop(0)
            self.now = max(self.now, time)
            call()
        self.now = max(self.now, until)

    @property
    def wall(self) -> int:
        return self.now + self.clock_wrong

    def used(self) -> int:
        return sum(part.stat().st_size for part in self.folder.glob("*.mcap"))

    def free(self) -> int:
        return max(0, self.capacity - self.others - self.used())


class SimClock:
    """The capture's clock: monotonic from its anchor."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.wall, self.monotonic = world.wall, world.now

    def now(self) -> int:
        return self.wall + self._world.now - self.monotonic

    def at(self, monotonic: int) -> int:
        return self.wall + monotonic - self.monotonic

    def drift(self) -> int:
        return self._world.wall - self.now()


class SimTime:
    """The module `time` of the box."""

    def __init__(self, world: World) -> None:
        self._world = world

    def monotonic(self) -> float:
        return self._world.now / S

    def monotonic_ns(self) -> int:
        return self._world.now

    def sleep(self, seconds: float) -> None:
        self._world.pass_time(self._world.now + max(MS, int(seconds * S)))


class SimPort:
    """An open port at a wire."""

    session_adapter = Adapter("a simulated adapter", "sim", 0, "exact", ("parity",))

    def __init__(self, world: World, wire: Wire, clock: SimClock) -> None:
        if not wire.plugged:
            raise PortError(f"{wire.name}: no such port")
        self._world, self._wire, self._clock, self.ended = world, wire, clock, False
        self._miss()

    def fileno(self) -> int | None:
        return None

    def deadline(self) -> int | None:
        due = self._clock.at(self._wire.due)
        return min(due, self._clock.now() + 5 * S)

    def now(self) -> int:
        return self._clock.now()

    def _miss(self) -> None:
        """What the wire said while nobody listened."""
        while self._wire.due <= self._world.now:
            self._say()

    def _say(self) -> tuple[int, int]:
        wire = self._wire
        time, number = wire.due, wire.number
        wire.sent_at.append(time)
        wire.number += 1
        wire.due += wire.every
        return time, number

    def read(self) -> list[Item]:
        if not self._wire.plugged and not self.ended:
            self.ended = True
            return [LineEvent(self._clock.now(), LineEventKind.UNPLUGGED, gone(self._wire.name, "hung up"))]
        items: list[Item] = []
        while self._wire.due <= self._world.now and not self.ended:
            time, number = self._say()
            self._wire.heard.add(number)
            items.append(Chunk(self._clock.at(time - 20 * MS), POLL))
            items.append(Chunk(self._clock.at(time), answer(number)))
        return items

    def reconfigure(self, line: LineSettings) -> None:
        pass

    def close(self) -> None:
        self.ended = True


class SimWaiting:
    """Waits by letting the world's time pass."""

    def __init__(self, world: World) -> None:
        self._world = world

    def register(self, fd: int, call: object) -> None:
        pass

    def unregister(self, fd: int) -> None:
        pass

    def wait(self, seconds: float) -> list[tuple[int, Callable[[], object]]]:
        self._world.pass_time(self._world.now + int(seconds * S))
        return []


class SimFile(SharedFile):
    """A file that is written at once; remembers how much of it a disk surely has."""

    def __init__(self, record: RecordSpec, sessions: Sequence[Session]) -> None:
        rotation = None if record.rotation is None else Rotation.parse(record.rotation)
        self.keeper = Keeper(Path(record.path), sessions, rotation, record.keep, record.keep_free, record.keep_of_all)
        self._sessions = sessions
        self.synced: dict[Path, int] = {}
        self.keeper.orders = self  # type: ignore[assignment]

    def put(self, order: Any) -> None:
        self.keeper.do(order)
        if order is SYNC:
            path = self.keeper.paths[-1]
            self.synced[path] = path.stat().st_size

    @property
    def finished(self) -> bool:
        return self.keeper.closed

    def join(self, patience: float) -> None:
        pass


class SimLink:
    """Both ends of the way between a capture and its box: whoever receives lets the capture go on."""

    pid, priority = 0, "simulated"

    def __init__(self, world: World, targets: Sequence[Target], record: RecordSpec) -> None:
        self.world = world
        clock: Any = SimClock(world)
        self.clock = clock
        wires = {wire.name: wire for wire in world.wires}

        def opened(spec: str, line: LineSettings, clock: object) -> SimPort:
            return SimPort(world, wires[spec], clock)

        sources: list[Any] = [AwaitedSource(one.source.spec, one.source.line, clock, opened) for one in targets]
        self.sessions = [session_of(one.source, each, clock) for one, each in zip(targets, sources, strict=True)]
        self.file = SimFile(record, self.sessions)
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        self._ours, self._splitter = ours, MessageSplitter()
        capture_loop.Waiting = lambda: SimWaiting(world)  # type: ignore[misc,assignment]
        recorders = self.file.recorders()
        outlet = IpcSender(theirs, len(sources))
        self.loop = CaptureLoop(self.clock, list(sources), recorders, outlet, sessions=self.sessions, watched=False)  # type: ignore[arg-type]
        theirs.close()
        self.loop.begin()
        self.paths = [str(recorder.path) for recorder in recorders]
        self.dropped: dict[int, int] = {}
        self.closing = False
        self.over_since: float | None = None
        self.ended: Ended | None = None
        self.killed = False
        self._messages: list[Batch] = []
        world.links.append(self)

    def session(self, bus: int) -> Session:
        return self.sessions[bus]

    def receive_batches(self, timeout: float = 0.0) -> list[Batch]:
        if self.ended is not None:
            return []
        if timeout and self.loop.reason is None:
            try:
                self.loop.step()
            except Killed:
                self.killed = True
                self._messages += self._received()
                self.abandon(cut=False)
        elif timeout and self.loop.reason is not None:
            self.loop.rest()
            self.loop.finish()
            self.loop.outlet.flush()
            self.closing = True
        if not self.killed:
            self._messages += self._received()
        given, self._messages = self._messages, []
        if self.killed or self.closing:
            how = Ended("capture process was ended by SIGKILL", clean=False) if self.killed else Ended("stopped")
            self.ended = how
            given.append(how)
        return given

    def _received(self) -> list[Batch]:
        found: list[Batch] = []
        while True:
            try:
                data = self._ours.recv(1 << 20)
            except BlockingIOError:
                return found
            if not data:
                return found
            found += [one for one in (decode_message(*each) for each in self._splitter.feed(data)) if one is not None]

    def look(self, timeout: float = 0.0) -> bool:
        return True

    def insist(self) -> Ended | None:
        return None

    def let_go(self) -> None:
        pass

    def ask_to_stop(self) -> None:
        self.loop.stop("stopped")

    def trigger(self, bus: int, time: int, text: str) -> None:
        pass

    def derived(self, bus: int, one: DerivedMessage) -> bool:
        self.loop.recorders[bus].derived(one)
        return True

    def abandon(self, cut: bool) -> None:
        """The process is gone; with `cut` the power is: what the disk had not synced may be there or not."""
        part = self.file.keeper._part
        self.file.keeper._syncer.end()
        self.file.keeper._syncer.wait(10)
        part.stream.close()
        for one in (self._ours, self.loop.outlet._connection):
            if one is not None:
                one.close()
        path = self.file.keeper.paths[-1]
        if cut and path.exists():
            size = path.stat().st_size
            with path.open("r+b") as stream:
                stream.truncate(self.world.dice.randint(min(self.file.synced.get(path, 0), size), size))


def starter(world: World) -> Callable[..., list[LiveBus]]:
    """What begins a capture in this world, as `listening.start_all` does."""

    def start_all(targets: Sequence[Target], record: RecordSpec, watched: bool = True) -> list[LiveBus]:
        try:
            link = SimLink(world, targets, record)
        except CaptureError as error:
            raise Failure(str(error), UNREADABLE) from None
        router = Router(link)  # type: ignore[arg-type]
        return [LiveBus(link, bus, one.devices, None, router, watched) for bus, one in enumerate(targets)]  # type: ignore[arg-type]

    return start_all


def open_on(world: World) -> Callable[..., io.FileIO]:
    """`open` of the recorder: a file on a disk that may be full."""

    class File(io.FileIO):
        def write(self, octets: Any) -> int:
            if world.free() < len(octets):
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(octets)

    def opened(path: Path, mode: str, buffering: int = 0) -> io.FileIO:
        return File(path, "xb")

    return opened
