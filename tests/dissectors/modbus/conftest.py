"""Making frames by hand, reading the shared captures, and a bus on paper for the tracker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Check, Damage, Event, FoundBy, Frame, Header, Noise, Place, Reason
from dissectors.line import LineSettings, Timing
from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.tracker import ModbusTracker
from dissectors.tracker import Placement, Transaction

CAPTURES = Path(__file__).parents[3] / "../shared/captures"
MS = 1_000_000
_7_BITS = bytes(value & 0x7F for value in range(256))
_CHARACTERS = set(b":0123456789ABCDEFabcdef\r\n;")


def make_frame(octets: bytes, start: int = 0, end: int | None = None, slack: int = 0) -> Frame:
    """A frame around octets as they were on the wire; its check is computed, and a wrong one is damage."""
    end = start + len(octets) * 573_000 if end is None else end
    is_ascii = octets[:1] == b":" and set(octets.translate(_7_BITS)) <= _CHARACTERS
    good = unseal(octets, True) is not None if is_ascii else crc16_modbus(octets) == 0
    return Frame(
        "modbus-ascii" if is_ascii else "modbus-rtu",
        octets,
        start,
        end,
        Check.GOOD if good else Check.BAD,
        FoundBy.DELIMITER if is_ascii else FoundBy.GAP,
        None if good else Damage.CHECK,
        slack=slack,
    )


def peek(frame: Frame) -> Header:
    return (peek_ascii if frame.protocol == "modbus-ascii" else peek_rtu)(frame)


@pytest.fixture(scope="session")
def frame_of() -> Callable[..., Frame]:
    """Octets (bytes, or hex as text) to a frame."""

    def frame(octets: bytes | str, **times: int) -> Frame:
        return make_frame(bytes.fromhex(octets) if isinstance(octets, str) else octets, **times)

    return frame


@pytest.fixture(scope="session")
def peek_any() -> Callable[[Frame], Header]:
    return peek


@dataclass(frozen=True)
class Line:
    """One line of a capture's frames.txt."""

    label: str
    octets: bytes
    note: str


@pytest.fixture(scope="session")
def shared() -> Callable[[str], list[Line]]:
    """The frames of a shared capture; skips where the folder is absent."""

    def read(name: str) -> list[Line]:
        path = CAPTURES / name / "frames.txt"
        if not path.exists():
            pytest.skip(f"no shared capture {name}")
        lines = []
        for text in path.read_text(encoding="utf-8").splitlines():
            if text.startswith("#") or not text.strip():
                continue
            head, _, note = text.partition(" ; ")
            label, _, octets = head.partition(" ")
            if octets.strip() != "-":
                lines.append(Line(label, bytes.fromhex(octets), note))
        return lines

    return read


@dataclass
class PaperBus:
    """Frames with times, as a framer would give them. Times in ms; each frame follows the one before."""

    line: str = "19200,8E1"
    latency: int = 0  # ns
    is_ascii: bool = False
    events: list[Event] = field(default_factory=list)
    end: int = 0

    @property
    def timing(self) -> Timing:
        return Timing(LineSettings.parse(self.line), self.latency)

    def say(self, adu: bytes | str, gap: float = 40.0) -> PaperBus:
        """A good frame of unit and PDU, `gap` ms after the one before."""
        adu = bytes.fromhex(adu) if isinstance(adu, str) else adu
        return self._put(seal_ascii(adu) if self.is_ascii else seal_rtu(adu), gap)

    def exchange(
        self, request: bytes | str, response: bytes | str, answer: float = 8.0, pause: float = 40.0
    ) -> PaperBus:
        """A request `pause` ms after the frame before, its response `answer` ms after it."""
        return self.say(request, pause).say(response, answer)

    def damage(self, adu: bytes | str, gap: float = 8.0, at: int = -1) -> PaperBus:
        """The frame with one octet changed."""
        self.say(adu, gap)
        good = self.events.pop()
        octets = bytearray(good.octets)
        octets[at] ^= 0x10
        assert isinstance(good, Frame)
        bad = replace(good, octets=bytes(octets), check=Check.BAD, damage=Damage.CHECK)
        self.events.append(bad)
        return self

    def cut(self, adu: bytes | str, left: int, gap: float = 8.0) -> PaperBus:
        """The frame with only its first `left` octets."""
        self.say(adu, gap)
        good = self.events.pop()
        assert isinstance(good, Frame)
        short = replace(
            good, octets=good.octets[:left], check=Check.ABSENT, damage=Damage.SHORT, expected=len(good.octets)
        )
        self.end = good.start + left * self.timing.char
        self.events.append(replace(short, end=self.end))
        return self

    def noise(self, octets: bytes, gap: float = 8.0, place: Place = Place.BETWEEN) -> PaperBus:
        start = self.end + round(gap * MS)
        self.end = start + len(octets) * self.timing.char
        self.events.append(Noise(octets, start, self.end, place, Reason.NO_FRAME))
        return self

    def _put(self, octets: bytes, gap: float) -> PaperBus:
        start = self.end + round(gap * MS)
        self.end = start + len(octets) * self.timing.char
        self.events.append(make_frame(octets, start, self.end, self.latency))
        return self

    def run(self, tracker: ModbusTracker | None = None) -> Reading:
        """Track it all, to the end of the capture."""
        tracker = tracker or ModbusTracker(self.timing)
        placements: list[Placement | None] = []
        closed: list[Transaction] = []
        for no, event in enumerate(self.events, 1):
            tracked = tracker.track(no, event, peek(event) if isinstance(event, Frame) else None)
            placements.append(tracked.placement)
            closed.extend(tracked.closed)
        closed.extend(tracker.close())
        return Reading(tracker, placements, sorted(closed, key=lambda transaction: transaction.id))


@dataclass
class Reading:
    tracker: ModbusTracker
    placements: list[Placement | None]
    transactions: list[Transaction]

    @property
    def verdicts(self) -> list[str]:
        return [transaction.verdict.value for transaction in self.transactions]

    @property
    def roles(self) -> list[str]:
        return [placement.role.value if placement else "noise" for placement in self.placements]

    @property
    def last(self) -> Transaction:
        return self.transactions[-1]


@pytest.fixture(scope="session")
def paper_bus() -> type[PaperBus]:
    return PaperBus
