"""Exchanges whose CRC has octets that are 00, for every function: what a clean bus sends now and then.

A frame that ends with a zero is good without it too, and its first octets may look like another frame. Here such
frames are made on purpose, laid on a bus and read back.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk, Event, Frame, Role
from dissectors.line import LineSettings, Timing
from dissectors.modbus.candidates import is_text
from dissectors.modbus.framing import RtuFramer
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT
from dissectors.modbus.header import peek_rtu
from dissectors.modbus.tracker import ModbusTracker
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi

Exchange = tuple[bytes, bytes]
"""Request and answer, without unit and CRC; an empty answer where nobody answers."""

CODES: Final = (1, 2, 3, 4, 5, 6, 7, 8, 0x0B, 0x0C, 0x0F, 0x10, 0x11, 0x14, 0x15, 0x16, 0x17, 0x18, 0x2B)
VENDOR_CODES: Final = (0x41, 0x42, 0x64, 0x6E)


def sealed(body: bytes) -> bytes:
    return body + crc16_modbus(body).to_bytes(2, "little")


def _words(*values: int) -> bytes:
    return b"".join(value.to_bytes(2, "big") for value in values)


def exchange(code: int, dice: random.Random) -> Exchange:
    """One exchange of a function: the commonest sizes and addresses, and those that look like something else."""
    at = dice.choice([dice.randrange(0x100), 0x200 + dice.randrange(0x100), 0x400 + dice.randrange(0x100),
                      dice.randrange(0x10000)])  # fmt: skip
    head = bytes([code])
    if code in (1, 2):
        count = dice.choice([1, 8, 16, 17, 20, 24, 32, 40, dice.randint(1, 200)])
        size = (count + 7) // 8
        return head + _words(at, count), head + bytes([size]) + dice.randbytes(size)
    if code in (3, 4):
        count = dice.choice([1, 2, 2, 2, 3, 4, dice.randint(1, 30)])
        return head + _words(at, count), head + bytes([2 * count]) + _registers(count, dice)
    if code == 5:
        return _copied(head + _words(at) + dice.choice([b"\0\0", b"\xff\0"]))
    if code == 6:
        return _copied(head + _words(at, dice.randrange(0x10000)))
    if code == 7:
        return head, head + dice.randbytes(1)
    if code == 8:
        return _copied(head + b"\0\0" + dice.randbytes(2))
    if code == 0x0B:
        return head, head + dice.choice([b"\0\0", b"\xff\xff"]) + dice.randbytes(2)
    if code == 0x0C:
        size = 6 + dice.randint(0, 20)
        return head, head + bytes([size]) + dice.randbytes(size)
    if code == 0x0F:
        count = dice.choice([1, 8, 10, 16])
        size = (count + 7) // 8
        return head + _words(at, count) + bytes([size]) + dice.randbytes(size), head + _words(at, count)
    if code == 0x10:
        count = dice.choice([1, 2, 2, 4])
        return head + _words(at, count) + bytes([2 * count]) + _registers(count, dice), head + _words(at, count)
    if code == 0x11:
        size = dice.randint(2, 20)
        return head, head + bytes([size]) + dice.randbytes(size)
    if code == 0x14:
        size = dice.choice([2, 4, 8])
        return head + b"\x07\x06" + _words(1, at & 0xFFF, size // 2), head + bytes(
            [size + 2, size + 1, 6]
        ) + dice.randbytes(size)
    if code == 0x15:
        return _copied(head + b"\x0b\x06" + _words(1, at & 0xFFF, 2) + dice.randbytes(4))
    if code == 0x16:
        return _copied(head + _words(at) + dice.randbytes(4))
    if code == 0x17:
        return head + _words(at, 4, at, 2) + b"\4" + dice.randbytes(4), head + b"\x08" + dice.randbytes(8)
    if code == 0x18:
        count = dice.randint(0, 5)
        return head + _words(at), head + _words(2 + 2 * count, count) + dice.randbytes(2 * count)
    if code == 0x2B:
        value = dice.randbytes(dice.randint(2, 9))
        return b"\x2b\x0e\x01" + bytes([dice.randrange(3)]), b"\x2b\x0e\x01\x81\0\0\1\0" + bytes([len(value)]) + value
    return head + dice.randbytes(dice.randint(1, 9)), head + dice.randbytes(dice.randint(1, 20))


def _registers(count: int, dice: random.Random) -> bytes:
    """Small numbers of 16 and 32 bits, and any."""
    kind = dice.randrange(3)
    if kind == 0:
        return _words(*(dice.choice([0, 0, dice.randrange(0x8000)]) for _ in range(count)))
    if kind == 1 and not count & 1:
        return b"".join(dice.randint(256, 32255).to_bytes(4, "big") for _ in range(count // 2))
    return dice.randbytes(2 * count)


def _copied(body: bytes) -> Exchange:
    return body, body


def zeros_of(octets: bytes) -> str:
    """Which CRC octets are 00: "low", "high", "both" or ""."""
    low, high = octets[-2] == 0, octets[-1] == 0
    return "both" if low and high else "low" if low else "high" if high else ""


def exchanges_with_zeros(code: int, dice: random.Random, count: int) -> Iterator[tuple[bytes, bytes]]:
    """`count` exchanges of a function with CRC octets that are 00 in one frame at least, as frames; units vary."""
    given = 0
    for tried in range(4000 * count):
        unit = bytes([dice.randint(1, 40)])
        asked, answered = exchange(code, dice)
        if tried % 8 == 0 and len(answered) > 6 and asked != answered:
            answered = _with_both(unit, answered)
        elif tried % 8 == 1 and (code in (6, 8, 0x16) or (code not in CODES and len(asked) > 4)):
            body = _with_both(unit, asked)
            asked, answered = body, body if asked == answered else answered
        elif tried % 8 == 2:
            answered = bytes([code | EXCEPTION_BIT, dice.choice([1, 2, 3, 4])])
        frames = sealed(unit + asked), sealed(unit + answered)
        if any(frame.endswith(b"\0\0\0") or is_text(frame) for frame in frames) and code not in CODES:
            continue  # nothing but a length could tell the former from zeros after a frame, the latter from text
        if zeros_of(frames[0]) or zeros_of(frames[1]):
            yield frames
            given += 1
            if given == count:
                return


def _with_both(unit: bytes, body: bytes) -> bytes:
    """The same with last data octets that make both CRC octets 00: the CRC of what stands before them."""
    return body[:-2] + crc16_modbus(unit + body[:-2]).to_bytes(2, "little")


# --- the bus ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a bus is: silences before an answer, before the next request, after a request nobody answers, ms."""

    answer: float
    pause: float
    patience: float


BRISK: Final = Pace(0.3, 1.5, 60)
USUAL: Final = Pace(6, 20, 300)
SLOW: Final = Pace(90, 250, 1000)
PACES: Final = {"brisk": BRISK, "usual": USUAL, "slow": SLOW}

ADAPTERS: Final[dict[str, tuple[int, Callable[[list[tuple[int, int]]], list[Chunk]]]]] = {
    "exact": (0, exact),
    "16 ms": (FTDI_LATENCY, ftdi),
}


def misread(sent: list[tuple[bytes, bytes]], line: str, pace: Pace, adapter: str) -> list[str]:
    """What is read wrongly of exchanges on a clean bus: limits of frames, or their direction."""
    latency, deliver = ADAPTERS[adapter]
    timing = Timing(LineSettings.parse(line), latency)
    now, wire, frames = 1_000 * MS, [], []
    for asked, answered in sent:
        for octets, gap, request in ((asked, pace.pause, True), (answered, pace.answer, False)):
            if not octets:
                now += int(pace.patience * MS)
                continue
            now += timing.t35 + int(gap * MS)
            frames.append((octets, request))
            for octet in octets:
                now += timing.char
                wire.append((now, octet))
    return differences(frames, drive(RtuFramer(timing), deliver(wire)), timing)


def differences(frames: list[tuple[bytes, bool]], events: list[Event], timing: Timing) -> list[str]:
    """Each frame that was sent (with whether it was a request) beside what was read in its place, where they differ."""
    wrong = []
    starts, at = {}, 0
    tracker = ModbusTracker(timing)
    for number, event in enumerate(events, 1):
        role = None
        if isinstance(event, Frame):
            placement = tracker.track(number, event, peek_rtu(event)).placement
            role = placement.role if placement is not None else None
        else:
            tracker.track(number, event, None)
        starts[at] = event, role
        at += len(event.octets)
    at = 0
    for octets, request in frames:
        event, role = starts.get(at, (None, None))
        right = Role.RESPONSE if not request else Role.BROADCAST if octets[0] == BROADCAST else Role.REQUEST
        if not isinstance(event, Frame) or event.octets != octets or not event.ok or event.flags:
            read = event.octets.hex(" ") if event is not None else "the middle of something"
            wrong.append(f"{'request' if request else 'answer'} {octets.hex(' ')} read as {read}")
        elif role is not right:
            wrong.append(f"{octets.hex(' ')} taken for a {role.value if role is not None else None}, a {right.value}")
        at += len(octets)
    return wrong
