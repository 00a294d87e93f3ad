"""A bus by hand: frames after so many ms of silence each, and what is made of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.findings import judge
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.bacnet.rules import RULES
from dissectors.findings import Finding, Severity, with_consequences
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import LineSettings, Timing
from dissectors.tracker import Placement, Transaction

MS = 1_000_000
LINE = LineSettings(38400)
Step = tuple[float, bytes]


def token(source: int, destination: int) -> bytes:
    return frame(0, destination, source)


def poll(source: int, destination: int) -> bytes:
    return frame(1, destination, source)


def found(source: int, destination: int) -> bytes:
    """A Reply To Poll For Master."""
    return frame(2, destination, source)


def data(source: int, destination: int, octets: str = "01001008", expects: bool = False) -> bytes:
    return npdu_frame(destination, source, bytes.fromhex(octets), expects)


def rounds(count: int, *macs: int, use: float = 2) -> list[Step]:
    """The token once round for each count."""
    pairs = list(zip(macs, macs[1:] + macs[:1], strict=True))
    return [(use, token(*pair)) for _ in range(count) for pair in pairs]


def spoil(octets: bytes, at: int, mask: int = 0x10) -> bytes:
    """The same octets with bits of one inverted."""
    at %= len(octets)
    return octets[:at] + bytes((octets[at] ^ mask,)) + octets[at + 1 :]


@dataclass
class Read:
    """What was made of it."""

    events: list[Event]
    placements: list[Placement | None]
    transactions: list[Transaction]
    ring: Ring

    @property
    def findings(self) -> tuple[Finding, ...]:
        return with_consequences(judge(self.ring), RULES)

    def graves(self) -> set[tuple[str, str]]:
        return {(one.code, one.subject) for one in self.findings if one.severity >= Severity.WARNING}

    def of(self, code: str) -> Finding:
        (finding,) = (one for one in self.findings if one.code == code)
        return finding


def script(
    steps: Iterable[Step],
    latency: float = 0,
    line: LineSettings = LINE,
    *,
    has_times: bool = True,
    timing: Timing | None = None,
) -> Read:
    """Each step is one read; steps of no silence at all come in one read with the one before."""
    timing = timing or Timing(line, int(latency * MS), has_times=has_times)
    framer, tracker, observer = MSTP.framer(timing), MSTP.tracker(timing), MstpRingObserver(timing)
    chunks: list[Chunk] = []
    now = 10**18
    for silence, octets in steps:
        now += int(silence * MS) + len(octets) * timing.char
        if not silence and chunks:
            chunks[-1] = Chunk(now, chunks[-1].octets + octets)
        else:
            chunks.append(Chunk(now, octets))
    events: list[Event] = []
    for chunk in chunks:
        events += framer.feed(chunk)
    events += framer.close()
    read = Read(events, [], [], Ring())
    for no, event in enumerate(events):
        header = MSTP.peek(event) if isinstance(event, Frame) else None
        observer.see(no, event, header)
        tracked = tracker.track(no, event, header)
        read.placements.append(tracked.placement)
        read.transactions += tracked.closed
    read.transactions += tracker.close()
    read.ring = observer.ring()
    return read
