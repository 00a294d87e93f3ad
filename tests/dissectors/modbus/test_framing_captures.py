"""RTU framing of traffic that others recorded: nothing lost, nothing invented, through every adapter."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Check, Chunk, Event, Frame, Noise, Reason
from dissectors.line import LineSettings, Timing
from dissectors.modbus.framing import RtuFramer
from sniff.testing.driving import drive
from tests.bus_delivery import FTDI_LATENCY, MS, Wire, exact, ftdi, laid_out, with_noise
from tests.captures_shared import listed, timed

TIMED = {
    "sigrok-flowmeter-graph_tool": ("9600,8N1", 18),
    "sigrok-flowmeter-target_0liter_per_min": ("9600,8N1", 112),
    "sigrok-flowmeter-target_20liter_per_min": ("9600,8N1", 66),
    "sigrok-brainchild-io16do": ("19200,8E1", 30),
}
LISTS = {
    "modbus-rtu-omega-cn7500": 28,
    "modbus-rtu-delta-dtb4824": 44,
    "modbus-rtu-daly-ess": 220,
    "modbus-rtu-daly-ble-responses": 11,
}
LATENCIES = {"exact": 0, "ftdi": FTDI_LATENCY}


def deliver(wire: Wire, adapter: str) -> list[Chunk]:
    return ftdi(wire) if adapter == "ftdi" else exact(wire)


def good(events: Iterable[Event]) -> Counter[bytes]:
    return Counter(e.octets for e in events if isinstance(e, Frame) and e.check is Check.GOOD)


def capture(name: str) -> tuple[Wire, list[bytes]]:
    return [(o.end, o.octet) for o in timed(name)], [f.octets for f in listed(name)]


@pytest.mark.parametrize("adapter", LATENCIES)
@pytest.mark.parametrize("name", TIMED)
def test_every_frame_of_a_timed_capture_and_nothing_else(name: str, adapter: str) -> None:
    line, count = TIMED[name]
    wire, frames = capture(name)
    assert len(frames) == count
    framer = RtuFramer(Timing(LineSettings.parse(line), LATENCIES[adapter]))
    events = drive(framer, deliver(wire, adapter))
    assert [e.octets for e in events] == frames
    assert all(isinstance(e, Frame) and e.ok for e in events)


@pytest.mark.parametrize("adapter", LATENCIES)
@pytest.mark.parametrize("name", TIMED)
def test_noise_in_every_gap_costs_at_most_one_frame_in_a_hundred_and_makes_none(name: str, adapter: str) -> None:
    line = LineSettings.parse(TIMED[name][0])
    wire, frames = capture(name)
    timing = Timing(line, LATENCIES[adapter])
    sent = Counter(frames)
    missed = 0
    seeds = range(8)
    for seed in seeds:
        noisy, added = with_noise(wire, timing, random.Random(seed), timing.t35)
        assert added > len(frames) // 2
        found = good(drive(RtuFramer(timing), deliver(noisy, adapter)))
        assert not found - sent
        missed += (sent - found).total()
    assert missed <= len(frames) * len(seeds) // 100


@pytest.mark.parametrize("adapter", LATENCIES)
def test_a_flipped_bit_damages_its_frame_and_no_other(adapter: str) -> None:
    attributed = tried = 0
    for name, (line, _) in TIMED.items():
        wire, frames = capture(name)
        timing = Timing(LineSettings.parse(line), LATENCIES[adapter])
        for seed in range(12):
            dice = random.Random(seed)
            hit = dice.randrange(len(frames))
            begin = sum(map(len, frames[:hit]))
            at = begin + dice.randrange(len(frames[hit]))
            flipped = list(wire)
            flipped[at] = (wire[at][0], wire[at][1] ^ 1 << dice.randrange(8))
            events = drive(RtuFramer(timing), deliver(flipped, adapter))
            assert good(events) == Counter(frames[:hit] + frames[hit + 1 :])
            wrong = bytes(octet for _, octet in flipped[begin : begin + len(frames[hit])])
            damaged = [e for e in events if isinstance(e, Frame) and not e.ok]
            attributed += [e.octets for e in damaged] == [wrong] and wrong[0] == frames[hit][0]
            tried += 1
    assert attributed >= 0.75 * tried


@pytest.mark.parametrize("gap", ["t35", "30 ms"])
@pytest.mark.parametrize("adapter", LATENCIES)
@pytest.mark.parametrize("name", LISTS)
def test_every_frame_of_an_untimed_list(name: str, adapter: str, gap: str) -> None:
    frames = [f.octets for f in listed(name)]
    assert len(frames) == LISTS[name]
    timing = Timing(LineSettings.parse("9600"), LATENCIES[adapter])
    wire = laid_out(frames, timing, timing.t35 + 100_000 if gap == "t35" else 30 * MS)
    events = drive(RtuFramer(timing), deliver(wire, adapter))
    assert [e.octets for e in events] == frames
    assert all(isinstance(e, Frame) and e.ok for e in events)


@pytest.mark.parametrize("gap", [4 * MS, 30 * MS])
def test_vectors_of_minimalmodbus_with_those_that_are_wrong_on_purpose(gap: int) -> None:
    """Twelve are bad; two of them are a good frame after another frame, which is found."""
    vectors = listed("vectors-minimalmodbus-rtu")
    right = [v.octets for v in vectors if "crc=ok" in v.note]
    wrong = [v.octets for v in vectors if "crc=BAD" in v.note]
    assert len(wrong) == 12
    timing = Timing(LineSettings.parse("9600"))
    events = drive(RtuFramer(timing), exact(laid_out([v.octets for v in vectors], timing, gap)))
    found = good(events)
    assert not Counter(right) - found
    glued = [w for w in wrong if w[:1] == b"\x14"]
    assert len(glued) == 2
    for octets in (found - Counter(right)).elements():
        assert any(octets in w for w in glued)
        assert crc16_modbus(octets) == 0
    assert not set(found) & set(wrong)
    odd = [e.octets for e in events if isinstance(e, Frame) and e.flags == ("odd-length",)]
    assert bytes.fromhex("0103020000098474") not in odd  # reads as a request
    assert bytes.fromhex("0103020930be") in odd


def test_vectors_of_several_suites() -> None:
    """One of them is a good frame and a zero."""
    frames = [f.octets for f in listed("vectors-modbus-suites") if f.octets[:1] != b":"]
    timing = Timing(LineSettings.parse("9600"))
    events = drive(RtuFramer(timing), exact(laid_out(frames, timing, 4 * MS)))
    zero = bytes.fromhex("fe0400030001d5c500")
    assert good(events) == Counter([*[f for f in frames if f != zero], zero[:-1]])
    assert [(e.octets, e.reason) for e in events if isinstance(e, Noise)] == [(b"\0", Reason.ZEROS)]


@pytest.mark.parametrize("adapter", LATENCIES)
@pytest.mark.parametrize(
    "name",
    ["vectors-n2open-digimat", "profibus-dp-excerpts", "negative-logo-td", "modbus-ascii-misc", "mstp-kargs-2009"],
)
def test_no_good_frame_in_the_traffic_of_other_protocols(name: str, adapter: str) -> None:
    frames = [f.octets for f in listed(name)]
    timing = Timing(LineSettings.parse("38400"), LATENCIES[adapter])
    for gap in (0, 2 * MS, 40 * MS):
        events = drive(RtuFramer(timing), deliver(laid_out(frames, timing, gap), adapter))
        assert not good(events)


@pytest.mark.parametrize("latency", LATENCIES.values())
def test_random_octets_make_no_frames(latency: int) -> None:
    """Predicted lengths alone would make about one in 350 000 octets; evidence beside the CRC makes it far less."""
    timing = Timing(LineSettings.parse("115200"), latency)
    framer, dice, now = RtuFramer(timing), random.Random(485), 0
    events: list[Event] = []
    for _ in range(1000):
        octets = dice.randbytes(300)
        now += len(octets) * timing.char
        events += framer.feed(Chunk(now, octets))
    events += framer.close()
    assert not good(events)
    assert sum(len(e.octets) for e in events) == 300_000
