"""RTU framing of long polls with every common function, silent stations and exceptions, through every adapter."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Check, Chunk, Event, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.framing import RtuFramer
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, Wire, exact, ftdi, stalled, with_noise

UNITS = (1, 2, 3, 7, 17)
ADAPTERS = {"exact": 0, "1 ms": 2 * MS, "16 ms": FTDI_LATENCY}


def words(*values: int) -> bytes:
    return b"".join(value.to_bytes(2, "big") for value in values)


def exchange(dice: random.Random) -> tuple[bytes, bytes]:
    """A request and its answer, without unit and CRC."""
    at = dice.randrange(0x10000)
    match dice.choice([1, 2, 3, 3, 3, 3, 4, 6, 6, 8, 16, 17, 23]):
        case (1 | 2) as code:
            count = dice.randint(1, 200)
            size = (count + 7) // 8
            return bytes([code]) + words(at, count), bytes([code, size]) + dice.randbytes(size)
        case (3 | 4) as code:
            count = dice.choice([1, 2, 5, 10, 30, 100, 125])
            return bytes([code]) + words(at, count), bytes([code, 2 * count]) + dice.randbytes(2 * count)
        case (6 | 8) as code:
            asked = bytes([code]) + (words(at) if code == 6 else b"\0\0") + dice.randbytes(2)
            return asked, asked
        case 16:
            count = dice.randint(1, 60)
            return b"\x10" + words(at, count) + bytes([2 * count]) + dice.randbytes(2 * count), b"\x10" + words(
                at, count
            )
        case 17:
            return b"\x11", b"\x11\x09Drive007\xff"
        case _:
            return b"\x17" + words(at, 4, at, 2) + b"\4" + dice.randbytes(4), b"\x17\x08" + dice.randbytes(8)


def poll(dice: random.Random, timing: Timing, exchanges: int) -> tuple[Wire, list[bytes]]:
    """A poll on the wire, silences as the standard asks; one answer in twenty is missing, one an exception."""
    now, wire, frames = 0, [], []
    for _ in range(exchanges):
        unit = bytes([dice.choice(UNITS)])
        asked, answered = exchange(dice)
        fate = dice.random()
        if fate < 0.05:
            answered = bytes([asked[0] | 0x80, dice.choice([1, 2, 3, 4])])
        parts = [(asked, dice.randint(1 * MS, 15 * MS)), (answered, dice.randint(MS // 10, 4 * MS))]
        for body, wait in parts[: 1 if fate > 0.95 else 2]:
            body = unit + body
            frames.append(body + crc16_modbus(body).to_bytes(2, "little"))
            now += timing.t35 + wait
            for octet in frames[-1]:
                now += timing.char
                wire.append((now, octet))
    return wire, frames


def deliver(wire: Wire, adapter: str) -> list[Chunk]:
    match adapter:
        case "exact":
            return exact(wire)
        case "1 ms":
            return ftdi(wire, timer=1 * MS)
        case _:
            return ftdi(wire)


def good(events: Iterable[Event]) -> Counter[bytes]:
    return Counter(e.octets for e in events if isinstance(e, Frame) and e.check is Check.GOOD)


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("line", ["9600", "19200,8E1", "115200"])
def test_a_clean_poll_is_read_without_a_fault(line: str, adapter: str) -> None:
    timing = Timing(LineSettings.parse(line), ADAPTERS[adapter])
    wire, frames = poll(random.Random(line), timing, 200)
    events = drive(RtuFramer(timing), deliver(wire, adapter))
    assert [e.octets for e in events] == frames
    assert all(isinstance(e, Frame) and e.ok and not e.flags for e in events)


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("line", ["9600", "19200,8E1", "115200"])
def test_noise_in_every_gap(line: str, adapter: str) -> None:
    """What may be lost are requests of four octets that nobody answers, and exceptions whose request was lost."""
    timing = Timing(LineSettings.parse(line), ADAPTERS[adapter])
    dice = random.Random(line)
    wire, frames = poll(dice, timing, 300)
    noisy, added = with_noise(wire, timing, dice, timing.t35)
    assert added > len(frames)
    found, sent = good(drive(RtuFramer(timing), deliver(noisy, adapter))), Counter(frames)
    assert not found - sent
    assert (sent - found).total() <= len(frames) // 100


@pytest.mark.parametrize("line", ["9600", "19200,8E1", "115200"])
def test_noise_in_every_gap_and_frames_cut_at_the_edges_of_reads(line: str) -> None:
    """Once each station was heard, nothing whose request is answered is lost, however reads cut the frames."""
    timing = Timing(LineSettings.parse(line), FTDI_LATENCY)
    lost = tried = 0
    for seed in range(4):
        dice = random.Random(f"{line} {seed}")
        wire, frames = poll(dice, timing, 40)
        first = len(b"".join(frames[:40]))
        noisy, added = with_noise(wire[first:], timing, dice, timing.t35)
        assert added > len(frames) // 3
        found = good(drive(RtuFramer(timing), ftdi(wire[:first] + noisy)))
        sent = Counter(frames)
        assert not found - sent
        short = sum(each for frame, each in (sent - found).items() if len(frame) <= 5)
        lost += (sent - found).total() - short
        tried += len(frames)
    assert tried > 250
    assert not lost


@pytest.mark.parametrize("line", ["9600", "19200,8E1", "115200"])
def test_a_host_that_reads_late_more_often_than_its_latency_says(line: str) -> None:
    """One read in ten comes up to 15 ms late on an adapter that promised 2 ms: silences are proved that never were."""
    timing = Timing(LineSettings.parse(line), ADAPTERS["1 ms"])
    dice = random.Random(line)
    wire, frames = poll(dice, timing, 300)
    chunks = stalled(deliver(wire, "1 ms"), dice, 0.1, 15 * MS)
    found, sent = good(drive(RtuFramer(timing), chunks)), Counter(frames)
    assert not found - sent
    assert (sent - found).total() <= len(frames) // 50


@pytest.mark.parametrize("latency", [0, FTDI_LATENCY])
def test_cuts_change_nothing_in_long_runs_without_silence(latency: int) -> None:
    """What the property suite checks on short wires, on long ones: the window fills, and is looked at, many times."""
    timing = Timing(LineSettings.parse("19200,8E1"), latency)
    for seed in range(40):
        dice = random.Random(seed)
        frames = poll(dice, timing, 40)[1]
        now, wire = 0, []
        for frame in frames:
            body = bytearray(frame)
            if dice.random() < 0.2:
                body[dice.randrange(len(body))] ^= 1 << dice.randrange(8)
            now += dice.choice([0, 0, timing.char, timing.t15, timing.t35 - 1, timing.t35])
            for octet in body + dice.randbytes(dice.choice([0, 0, 0, 1, 2, 40])):
                now += timing.char
                wire.append((now, octet))
        lumps: list[Chunk] = []
        for end, octet in wire:
            if lumps and len(lumps[-1].octets) < 200 and end - lumps[-1].time == timing.char:
                lumps[-1] = Chunk(end, lumps[-1].octets + bytes([octet]))
            else:
                lumps.append(Chunk(end, bytes([octet])))
        assert drive(RtuFramer(timing), lumps) == drive(RtuFramer(timing), exact(wire))
