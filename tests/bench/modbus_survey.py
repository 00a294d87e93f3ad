"""What the Modbus framers make of a bus in every condition: octets conserved, frames found, invented, told apart.

    python -m tests.bench.modbus_survey [EXCHANGES [SEEDS]]       (default 400 3)

For each condition one line: of the frames that reached the tap undamaged, how many per cent were found where they
stood; how many good frames were given that nobody sent; how many damaged ones were laid to a station that sent one,
or to another; whether the tracker gave the frames found their true direction.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Check, Chunk, Event, Frame, LineError, Mark, Role
from dissectors.framer import Framer
from dissectors.line import LineSettings, Timing
from dissectors.modbus import ascii_tracker
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.framing import RtuFramer
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.tracker import ModbusTracker
from tests.bus_delivery import FTDI_LATENCY, MS

VERBOSE = False
UNITS = (1, 2, 3, 7, 17)


@dataclass(slots=True)
class Sent:
    """A frame that was sent: what is to stand at the tap, and what became of it."""

    octets: bytes
    request: bool
    gap: int
    hurt: bool = False
    begin: int = 0  # of its first octet in all that was received


@dataclass(slots=True)
class Bus:
    """Octets received at the tap, each with its end, and its line error."""

    timing: Timing
    dice: random.Random
    now: int = 1000 * MS
    wire: list[tuple[int, int, LineError | None]] = field(default_factory=list)
    frames: list[Sent] = field(default_factory=list)

    def put(self, octets: Iterable[int], error: LineError | None = None) -> None:
        for octet in octets:
            self.now += self.timing.char
            self.wire.append((self.now, octet, error))


def words(*values: int) -> bytes:
    return b"".join(value.to_bytes(2, "big") for value in values)


def exchange(dice: random.Random) -> tuple[bytes, bytes]:
    """A request and its answer, without unit and check."""
    at = dice.randrange(0x10000)
    code = dice.choice([1, 2, 3, 3, 3, 3, 4, 5, 6, 6, 8, 15, 16, 17, 22, 23, 43])
    if code in (1, 2):
        count = dice.randint(1, 100)
        size = (count + 7) // 8
        return bytes([code]) + words(at, count), bytes([code, size]) + dice.randbytes(size)
    if code in (3, 4):
        count = dice.choice([1, 1, 2, 2, 2, 5, 10, 30, 60])
        return bytes([code]) + words(at, count), bytes([code, 2 * count]) + dice.randbytes(2 * count)
    if code == 5:
        return (asked := b"\x05" + words(at) + dice.choice([b"\0\0", b"\xff\0"])), asked
    if code in (6, 8):
        asked = bytes([code]) + (words(at) if code == 6 else b"\0\0") + dice.randbytes(2)
        return asked, asked
    if code == 15:
        return b"\x0f" + words(at, 10) + b"\x02" + dice.randbytes(2), b"\x0f" + words(at, 10)
    if code == 16:
        count = dice.randint(1, 20)
        return b"\x10" + words(at, count) + bytes([2 * count]) + dice.randbytes(2 * count), b"\x10" + words(at, count)
    if code == 17:
        return b"\x11", b"\x11\x09Drive007\xff"
    if code == 22:
        return (asked := b"\x16" + words(at) + dice.randbytes(4)), asked
    if code == 43:
        return b"\x2b\x0e\x01\x00", b"\x2b\x0e\x01\x81\x00\x00\x02\x00\x03ABC\x01\x02X9"
    return b"\x17" + words(at, 4, at, 2) + b"\4" + dice.randbytes(4), b"\x17\x08" + dice.randbytes(8)


def seal_rtu(body: bytes) -> bytes:
    return body + crc16_modbus(body).to_bytes(2, "little")


def seal_ascii(body: bytes) -> bytes:
    return b":" + (body + bytes([lrc(body)])).hex().upper().encode() + b"\r\n"


def traffic(dice: random.Random, timing: Timing, exchanges: int, seal: Callable[[bytes], bytes]) -> list[Sent]:
    """A poll: one answer in twenty is missing, one an exception."""
    sent: list[Sent] = []
    for _ in range(exchanges):
        unit = bytes([dice.choice(UNITS)])
        asked, answered = exchange(dice)
        fate = dice.random()
        if fate < 0.05:
            answered = bytes([asked[0] | 0x80, dice.choice([1, 2, 3, 4])])
        sent.append(Sent(seal(unit + asked), True, timing.t35 + dice.randint(1 * MS, 30 * MS)))
        if fate > 0.95:
            sent.append(Sent(b"", True, 150 * MS))
        else:
            sent.append(Sent(seal(unit + answered), False, timing.t35 + dice.randint(MS // 10, 8 * MS)))
    return sent


# --- conditions -------------------------------------------------------------------------------------------------------

Injure = Callable[[Bus, Sent], None]


def clean(bus: Bus, sent: Sent) -> None:
    bus.now += sent.gap
    _send(bus, sent, sent.octets)


def junk(bus: Bus, sent: Sent) -> None:
    """1 to 3 octets somewhere in the silence."""
    end, char = bus.now + sent.gap, bus.timing.char
    count = min(bus.dice.randint(1, 3), sent.gap // char)
    spare = sent.gap - count * char
    places = sorted(bus.dice.randint(0, spare) for _ in range(count))
    begin = bus.now
    for number, place in enumerate(places):
        bus.now = begin + place + number * char
        bus.put(bus.dice.randbytes(1))
    bus.now = end
    _send(bus, sent, sent.octets)


def bit_errors(chance: float) -> Injure:
    def injure(bus: Bus, sent: Sent) -> None:
        bus.now += sent.gap
        octets = bytearray(sent.octets)
        for at in range(len(octets)):
            for bit in range(8):
                if bus.dice.random() < chance:
                    octets[at] ^= 1 << bit
        _send(bus, sent, bytes(octets))

    return injure


def lost(bus: Bus, sent: Sent) -> None:
    """One octet in 200 is not there."""
    bus.now += sent.gap
    _begin(bus, sent)
    for octet in sent.octets:
        if bus.dice.random() < 0.005:
            bus.now += bus.timing.char
            sent.hurt = True
        else:
            bus.put((octet,))


def back_to_back(bus: Bus, sent: Sent) -> None:
    _send(bus, sent, sent.octets)


def truncated(bus: Bus, sent: Sent) -> None:
    """One frame in ten ends early."""
    bus.now += sent.gap
    octets = sent.octets
    if octets and bus.dice.random() < 0.1:
        octets = octets[: bus.dice.randrange(1, len(octets))]
    _send(bus, sent, octets)


def bursts(bus: Bus, sent: Sent) -> None:
    """In one gap of five 1 to 30 octets of anything."""
    if bus.dice.random() < 0.2:
        bus.now += 2 * bus.timing.t35
        bus.put(bus.dice.randbytes(bus.dice.randint(1, 30)))
    bus.now += sent.gap
    _send(bus, sent, sent.octets)


def breaks(bus: Bus, sent: Sent) -> None:
    """Before one frame in five a break, directly or well before."""
    if bus.dice.random() < 0.2:
        bus.now += bus.dice.choice([0, 2 * bus.timing.t35])
        bus.put(b"\0", LineError.BREAK)
        bus.now += bus.dice.choice([-sent.gap, 0])
    bus.now += sent.gap
    _send(bus, sent, sent.octets)


def _begin(bus: Bus, sent: Sent) -> None:
    sent.begin = len(bus.wire)
    bus.frames.append(sent)


def _send(bus: Bus, sent: Sent, octets: bytes) -> None:
    _begin(bus, sent)
    sent.hurt = octets != sent.octets
    bus.put(octets)


# --- delivery ---------------------------------------------------------------------------------------------------------


def deliver(bus: Bus, adapter: str) -> list[Chunk]:
    """An octet a read, reads by a 16 ms adapter, or by a host that comes round every 50 ms."""
    if adapter == "exact":
        return [_chunk(end, [(end, octet, error)]) for end, octet, error in bus.wire]
    timer, packet = (16 * MS, 62) if adapter == "16 ms" else (50 * MS, 4096)
    chunks: list[Chunk] = []
    held: list[tuple[int, int, LineError | None]] = []
    tick = (bus.wire[0][0] // timer + 1) * timer if bus.wire else 0
    for one in bus.wire:
        while one[0] > tick:
            if held:
                chunks.append(_chunk(tick, held))
                held = []
            tick += timer
        held.append(one)
        if len(held) == packet:
            chunks.append(_chunk(one[0], held))
            held, tick = [], one[0] + timer
    if held:
        chunks.append(_chunk(tick, held))
    return chunks


def _chunk(time: int, held: list[tuple[int, int, LineError | None]]) -> Chunk:
    marks = tuple(Mark(at, error) for at, (_, _, error) in enumerate(held) if error is not None)
    return Chunk(time, bytes(octet for _, octet, _ in held), marks)


LATENCY = {"exact": 0, "16 ms": FTDI_LATENCY, "50 ms": 51 * MS}

CONDITIONS: dict[str, tuple[Injure, str]] = {
    "clean": (clean, "exact"),
    "clean, 16 ms": (clean, "16 ms"),
    "junk in every gap": (junk, "exact"),
    "junk in every gap, 16 ms": (junk, "16 ms"),
    "bit errors 1e-4": (bit_errors(1e-4), "exact"),
    "bit errors 1e-3": (bit_errors(1e-3), "exact"),
    "bit errors 3e-3": (bit_errors(3e-3), "exact"),
    "bit errors 1e-3, 16 ms": (bit_errors(1e-3), "16 ms"),
    "bit errors 3e-3, 16 ms": (bit_errors(3e-3), "16 ms"),
    "lost octets": (lost, "exact"),
    "lost octets, 16 ms": (lost, "16 ms"),
    "merged reads, 50 ms": (clean, "50 ms"),
    "back to back": (back_to_back, "exact"),
    "back to back, 16 ms": (back_to_back, "16 ms"),
    "truncated": (truncated, "exact"),
    "truncated, 16 ms": (truncated, "16 ms"),
    "bursts": (bursts, "exact"),
    "bursts, 16 ms": (bursts, "16 ms"),
    "breaks": (breaks, "exact"),
    "breaks, 16 ms": (breaks, "16 ms"),
}


@dataclass(slots=True)
class Score:
    whole: int = 0  # frames that reached the tap undamaged
    found: int = 0
    invented: int = 0
    mended: int = 0  # good frames that say what was sent, though a character was hurt (ASCII: "a" for "A", CR alone)
    damaged: int = 0  # frames that were sent and damaged
    attributed: int = 0  # of them: a damaged frame, or its repair, of that station overlaps it
    accused: int = 0  # damaged frames laid to a station that sent nothing there
    directed: int = 0
    repaired: int = 0
    wrongly_repaired: int = 0
    conserved: bool = True

    def __str__(self) -> str:
        return (
            f"{self.whole:6} {100 * self.found / max(1, self.whole):7.2f} % {self.invented:5} "
            f"{100 * self.directed / max(1, self.found):7.2f} % {self.damaged:6} "
            f"{100 * self.attributed / max(1, self.damaged):6.1f} % {self.accused:5} "
            f"{self.repaired:5} {self.wrongly_repaired:4}  {'yes' if self.conserved else 'NO'}"
        )


def station(event: Frame) -> int | None:
    header = (peek_ascii if event.protocol == "modbus-ascii" else peek_rtu)(event)
    return header.source if header.source is not None else header.destination


def score(total: Score, bus: Bus, events: list[Event], tracker: ModbusTracker) -> None:
    """Count what the events say against what was sent."""
    sent = {frame.begin: frame for frame in bus.frames if frame.octets}
    ends = sorted(sent)
    reached = {begin: one for begin, one in sent.items() if not one.hurt}
    hurt = [one for one in sent.values() if one.hurt]
    spans = {
        begin: (following if following is not None else len(bus.wire))
        for begin, following in zip(ends, [*ends[1:], None], strict=True)
    }
    total.whole += len(reached)
    total.damaged += len(hurt)
    at, covered = 0, set()
    for number, event in enumerate(events, 1):
        if not isinstance(event, Frame):
            tracker.track(number, event, None)
            at += len(event.octets)
            continue
        sure = event
        if event.repair is not None:
            sure = replace(event, octets=event.repair.octets, expected=None, check=Check.GOOD, damage=None, repair=None)
        header = (peek_ascii if event.protocol == "modbus-ascii" else peek_rtu)(sure)
        if event.repair is not None:
            header = replace(header, ok=False)
        if event.repair is not None and VERBOSE and not any(o.octets == event.repair.octets for o in hurt):
            print("   wrongly", event.repair.flaw.value, event.octets.hex(" "), "|", event.repair.octets.hex(" "))
        placement = tracker.track(number, event, header).placement
        if event.ok:
            one = reached.get(at)
            if one is None and any(_same_message(event.octets, o.octets) for o in hurt):
                total.mended += 1
                total.damaged -= 1
            elif one is not None and one.octets == event.octets:
                total.found += 1
                if placement is not None:
                    total.directed += (placement.role is Role.REQUEST) is one.request
            else:
                total.invented += 1
        else:
            over = [one for begin, one in sent.items() if begin < at + len(event.octets) and at < spans[begin]]
            mine = [one for one in over if one.hurt]
            unit = placement.source if placement is not None else None
            unit = unit if unit is not None else placement.destination if placement is not None else station(event)
            if any(_unit(one.octets) == unit for one in mine):
                covered.update(one.begin for one in mine if _unit(one.octets) == unit)
            else:
                total.accused += 1
            if event.repair is not None:
                total.repaired += 1
                total.wrongly_repaired += not any(one.octets == event.repair.octets for one in mine)
        at += len(event.octets)
    total.attributed += len(covered)
    total.conserved &= b"".join(e.octets for e in events) == bytes(octet for _, octet, _ in bus.wire)


def _same_message(read: bytes, sent: bytes) -> bool:
    plain = bytes(octet & 0x7F for octet in read)  # a line of 7 data bits
    return plain[:1] == b":" and plain.upper().rstrip(b"\r\n") == sent.rstrip(b"\r\n")


def _unit(octets: bytes) -> int:
    return int(octets[1:3], 16) if octets[:1] == b":" else octets[0]


def survey(condition: str, protocol: str, line: str, exchanges: int, seeds: int) -> Score:
    """One line of the table."""
    injure, adapter = CONDITIONS[condition]
    total = Score()
    for seed in range(seeds):
        timing = Timing(LineSettings.parse(line), LATENCY[adapter])
        dice = random.Random(f"{condition} {line} {seed}")
        bus = Bus(timing, dice)
        seal: Callable[[bytes], bytes] = seal_rtu if protocol == "rtu" else seal_ascii
        for sent in traffic(dice, timing, exchanges, seal):
            injure(bus, sent)
        framer: Framer = RtuFramer(timing) if protocol == "rtu" else AsciiFramer(timing)
        events: list[Event] = []
        for chunk in deliver(bus, adapter):
            events += framer.feed(chunk)
        events += framer.close()
        score(total, bus, events, ModbusTracker(timing) if protocol == "rtu" else ascii_tracker(timing))
    return total


def main(exchanges: int, seeds: int) -> None:
    """Print the table."""
    for protocol, line in (("rtu", "19200,8E1"), ("rtu", "9600,8N1"), ("rtu", "115200,8N1"), ("ascii", "19200,7E1")):
        print(f"\n{protocol} {line}")
        print(f"{'':26}frames   found     inv.  direction damaged  attrib. wrong  rep. wrong conserved")
        for condition in CONDITIONS:
            print(f"{condition:26}{survey(condition, protocol, line, exchanges, seeds)}", flush=True)


if __name__ == "__main__":
    numbers = [int(argument) for argument in sys.argv[1:]]
    main(*(numbers + [400, 3][len(numbers) :]))
