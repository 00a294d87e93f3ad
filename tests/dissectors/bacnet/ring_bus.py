"""A ring of simulated nodes in simulated time, and everything that listens to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from dissectors.bacnet import MSTP
from dissectors.bacnet.findings import judge
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.bacnet.simulated import SimulatedNode
from dissectors.findings import Finding
from dissectors.frame import Chunk, Event, Frame, Header
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Transaction
from sniff.simulation.wire import Burst, Party, Wire

S = 1_000_000_000
MS = 1_000_000
LINE = LineSettings(38400)
TIMING = Timing(LINE)


@dataclass(slots=True)
class Heard:
    """What a listener made of a run."""

    events: list[Event] = field(default_factory=list)
    headers: list[Header | None] = field(default_factory=list)
    transactions: list[Transaction] = field(default_factory=list)
    bursts: list[Burst] = field(default_factory=list)
    ring: Ring = field(default_factory=Ring)

    @property
    def findings(self) -> tuple[Finding, ...]:
        return judge(self.ring)

    @property
    def codes(self) -> set[str]:
        return {finding.code for finding in self.findings}

    def finding(self, code: str) -> Finding:
        found = [finding for finding in self.findings if finding.code == code]
        assert found, f"no {code} among {sorted(self.codes)}"
        return found[0]


def run(
    nodes: Sequence[SimulatedNode],
    seconds: float,
    *,
    line: LineSettings = LINE,
    after: Sequence[tuple[float, Callable[[], None]]] = (),
    keep: bool = True,
    latency: int = 0,
) -> Heard:
    """Let the nodes run; `after` (seconds, what to do) changes them on the way."""
    timing = Timing(line, latency)
    wire = Wire(line, [Party(f"{n}: {node.mac}", node) for n, node in enumerate(nodes)])
    framer, tracker, observer, heard = MSTP.framer(timing), MSTP.tracker(timing), MstpRingObserver(timing), Heard()
    no = 0

    def listen(bursts: list[Burst], end: bool) -> None:
        nonlocal no
        for burst in [*bursts, None]:
            if burst is not None:
                events = framer.feed(Chunk(burst.end, burst.octets, burst.marks))
            else:
                events = framer.close() if end else []
            for event in events:
                header = MSTP.peek(event) if isinstance(event, Frame) else None
                observer.see(no, event, header)
                closed = tracker.track(no, event, header).closed
                no += 1
                if keep:
                    heard.events.append(event)
                    heard.headers.append(header)
                    heard.transactions.extend(closed)

    for moment, change in after:
        listen(list(wire.run(int(moment * S))), end=False)
        change()
    for burst in wire.run(int(seconds * S)):
        listen([burst], end=False)
    listen([], end=True)
    heard.transactions.extend(tracker.close())
    heard.ring = observer.ring()
    return heard
