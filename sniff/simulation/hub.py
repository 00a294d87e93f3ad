"""The process behind a virtual bus: one line in real time, its pseudo-terminals, its simulated stations.

Pacing. An octet is written to a listener when its line time has passed: in slices of about `slice` ns, and always at
the end of a burst, which is the moment that everything measures from. Where the host is late, the octets of a burst
come in a larger batch, and when the *last* one is late by more than TOLERANCE the bus's clock stands still for that
long: so a silence between bursts is never shorter than it should be by more than TOLERANCE plus what the
pseudo-terminal itself takes; it may be longer. `Report.slipped` says by how much the bus ran behind the host's clock.

A pseudo-terminal carries octets only: line errors reach memory ports and the ground truth, and a break is an octet 00.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import time
from bisect import bisect_right
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection

from dissectors.frame import Chunk, Mark
from dissectors.line import LineSettings, Timing
from dissectors.simulated_faults import Fault
from sniff.capture.priority import raise_priority
from sniff.simulation.collision import ReceivedOctets
from sniff.simulation.ports import HAS_PTY, GatewayPort, MemoryPort, Port, PtyPort
from sniff.simulation.wire import Burst, Factory, Sent, Wire

TOLERANCE = 200_000
TRUTHS = 200_000  # transmissions remembered
POLL_EVERY = 0.002  # s between looks at the control connection where it cannot be waited for
NO_STATIONS: Factory = tuple


@dataclass(frozen=True, slots=True)
class HubPlan:
    """Everything the process needs to know to begin; see `VirtualBus`."""

    line: LineSettings
    stations: Factory = NO_STATIONS
    faults: tuple[Fault, ...] = ()
    seed: int = 0
    gap: int = 0
    slice: int = 1_000_000


@dataclass(frozen=True, slots=True)
class HubReport:
    """What a bus did so far.

    `written`: octets that each attached party wrote. `delivered`: octets written to each port. `unread`: octets that a
    port lost because nobody read it. `tap_octets`: octets that taps wrote: not put on the line, and 0 for anything that
    only listens; `tap_first`: the first of them. `struck`: transmissions by fault ("collision" among them).
    `slipped`: ns by which the bus ran behind the host's clock. `latest`: ns, worst delay of a burst's last octet.
    `priority`: what the system granted to the bus's process.
    """

    written: dict[str, int]
    delivered: dict[str, int]
    unread: dict[str, int]
    tap_octets: int
    tap_first: bytes
    bursts: int
    transmissions: int
    struck: dict[str, int]
    slipped: int
    latest: int
    priority: str


class Hub:
    """The loop: wait for the next moment of the line or for octets from outside, and do what is due."""

    def __init__(self, plan: HubPlan, control: Connection, priority: str = "") -> None:
        self._plan = plan
        self._control = control
        self._priority = priority
        self._wire = Wire(plan.line, plan.stations(), plan.faults, plan.seed, plan.gap)
        self._linger = Timing(plan.line).t15
        self._batch = max(1, plan.slice // plan.line.char)
        self._origin: int | None = None  # the host's clock at bus time 0, None before the start
        self._began = 0
        self._ports: dict[str, Port] = {}
        self._given = 0  # octets of the burst on the line that listeners have
        self._truths: deque[Sent] = deque(maxlen=TRUTHS)
        self._struck: Counter[str] = Counter()
        self._bursts = self._transmissions = self._tap_octets = self._latest = 0
        self._tap_first = b""
        self._running = True

    def run(self) -> None:
        """Until told to stop, or until the other end of the control connection is gone."""
        try:
            while self._running:
                due = self._due()
                now = self._now()
                if due is not None and due <= now:
                    self._happen(now)
                else:
                    self._wait(due)
        finally:
            for port in self._ports.values():
                port.close()
            self._control.close()

    def _now(self) -> int:
        """Bus time, ns; 0 until the start."""
        return 0 if self._origin is None else time.monotonic_ns() - self._origin

    def _due(self) -> int | None:
        """Bus time of the next thing to do by itself."""
        if self._origin is None:
            return None
        event = self._wire.next_event()
        received = self._wire.on_line()
        if received is None or self._given >= len(received.octets):
            return event
        place = min(self._given + self._batch, len(received.octets)) - 1
        octet = received.ends[place]
        return octet if event is None else min(octet, event)

    def _happen(self, now: int) -> None:
        """Octets that have ended go out, then the line moves on, by one event at most."""
        event = self._wire.next_event()
        until = now if event is None else min(now, event)
        received = self._wire.on_line()
        if received is not None:
            self._deliver(received, until)  # may set the clock back
        for burst in self._wire.advance(min(until, self._now())):
            self._finish(burst)

    def _deliver(self, received: ReceivedOctets, until: int) -> None:
        ready = bisect_right(received.ends, until)
        if ready <= self._given:
            return
        begin, self._given = self._given, ready
        assert self._origin is not None
        marks = tuple(Mark(m.offset - begin, m.error) for m in received.marks if begin <= m.offset < ready)
        chunk = Chunk(received.ends[ready - 1] + self._origin, received.octets[begin:ready], marks)
        senders = self._wire.senders()
        for port in self._ports.values():
            if port.echo or port.name not in senders:
                port.put(chunk)
        if ready == len(received.octets):
            late = self._now() - received.ends[-1]
            self._latest = max(self._latest, late)
            if late > TOLERANCE:
                self._origin += late

    def _finish(self, burst: Burst) -> None:
        origin = self._origin or 0
        if burst.octets:
            self._given = 0
            self._bursts += 1
        for sent in burst.sent:
            self._transmissions += 1
            self._struck.update(sent.faults)
            self._truths.append(replace(sent, start=sent.start + origin, end=sent.end + origin))

    def _wait(self, due: int | None) -> None:
        """Until `due`, or until somebody outside has octets or a request."""
        timeout = None if due is None else max(0.0, (due - self._now()) / 1e9)
        ports = {descriptor: port for port in self._ports.values() for descriptor in port.descriptors()}
        if not ports:
            if self._control.poll(timeout):
                self._obey()
            return
        control = [self._control.fileno()]
        if os.name == "nt":  # `select` knows sockets only
            control, timeout = [], min(POLL_EVERY, POLL_EVERY if timeout is None else timeout)
        for descriptor in select.select([*control, *ports], [], [], timeout)[0]:
            if descriptor in control:
                self._obey()
            else:
                self._put_on_line(ports[descriptor], ports[descriptor].take(descriptor))
        if not control and self._control.poll(0):
            self._obey()

    def _put_on_line(self, port: Port, octets: bytes) -> None:
        if not octets:
            return
        port.written += len(octets)
        if port.tap:
            self._tap_octets += len(octets)
            self._tap_first = (self._tap_first + octets)[:64]
        elif self._origin is not None:
            now = self._now()
            silent = self._wire.silent_since(now)
            if silent is not None and port.name not in self._wire.senders():
                now = max(now, silent + self._plan.gap)  # a driver outside keeps to the silence that a device owes
            self._wire.send(port.name, now, octets, port.answers, self._linger)

    def _obey(self) -> None:
        """One request of the other side, one reply: ("ok", value) or ("error", text)."""
        try:
            name, *arguments = self._control.recv()
        except (EOFError, ConnectionResetError):
            self._running = False
            return
        try:
            reply = ("ok", getattr(self, f"do_{name}")(*arguments))
        except (OSError, ValueError, KeyError) as trouble:
            reply = ("error", str(trouble))
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self._control.send(reply)

    def do_begin(self) -> None:
        """Start the clock of the bus."""
        if self._origin is None:
            self._origin = self._began = time.monotonic_ns()

    def do_attach(self, kind: str, link: str, port: Port) -> str:
        """Take a party or a tap on the bus; give what a program opens.

        `kind`: "pty", "gateway" or "memory". `link`: a symbolic link for a pseudo-terminal, empty for none.
        """
        if port.name in self._ports:
            raise ValueError(f"port {port.name!r} is on the bus already")
        who = (port.name, port.tap, port.echo, port.answers)
        if kind == "pty" and not HAS_PTY:
            raise OSError("this system has no pseudo-terminals; use a gateway or a port in memory")
        if kind == "pty":
            port = PtyPort(*who, link=link).open()
        else:
            port = GatewayPort(*who).open() if kind == "gateway" else MemoryPort(*who)
        self._ports[port.name] = port
        return port.address

    def do_detach(self, name: str) -> None:
        """Take a port off the bus."""
        self._ports.pop(name).close()

    def do_read(self, name: str) -> list[Chunk]:
        """What a memory port has got since the last call."""
        port = self._ports[name]
        return port.fetch() if isinstance(port, MemoryPort) else []

    def do_write(self, name: str, octets: bytes) -> None:
        """Octets from a memory port."""
        self._put_on_line(self._ports[name], octets)

    def do_switch(self, faults: Sequence[Fault]) -> None:
        """Other faults from now on."""
        self._wire.switch(faults)

    def do_truth(self) -> list[Sent]:
        """The transmissions since the last call, times on the host's monotonic clock."""
        truths = list(self._truths)
        self._truths.clear()
        return truths

    def do_report(self) -> HubReport:
        """Counts so far."""
        ports = self._ports.values()
        return HubReport(
            written={port.name: port.written for port in ports},
            delivered={port.name: port.delivered for port in ports},
            unread={port.name: port.unread for port in ports},
            tap_octets=self._tap_octets,
            tap_first=self._tap_first,
            bursts=self._bursts,
            transmissions=self._transmissions,
            struck=dict(self._struck),
            slipped=(self._origin or 0) - self._began,
            latest=self._latest,
            priority=self._priority,
        )


def main(plan: HubPlan, control: Connection) -> None:
    """Entry of the process. Interrupts from the keyboard are the parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Hub(plan, control, raise_priority()).run()
