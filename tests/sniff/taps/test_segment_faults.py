"""Faults of a stretch between two taps: the right side is named, and nothing on a clean one; exact times and 16 ms."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings, Timing
from sniff.bus.offline import survey
from sniff.engine.blocks import blocks_of
from sniff.engine.session import Adapter, Session
from sniff.taps.frames import TapEar, TapFrames
from sniff.taps.matching import matched
from sniff.taps.verdict import FaultPlace, SegmentFault, SegmentFaultKind, TapSide, Traffic, faults, traffic
from sniff.taps.words import sentence
from tests.bus_delivery import FTDI_LATENCY, MS, Wire, exact, ftdi
from tests.seeds import in_turn, some
from tests.sniff.taps.segment import (
    Segment,
    bit_errors,
    dead,
    lost,
    rewritten,
    ring,
    without_begin,
    without_end,
)

LINE = LineSettings.parse("19200,8E1")
ADAPTERS = {"exact": 0, "16 ms": FTDI_LATENCY}
BEHIND_A, BEHIND_B = {-1, 1, 2, 3, 4}, {5, 6, 7, 8}

FAULTS: dict[str, tuple[Callable[[], Segment], set[tuple[FaultPlace, int, SegmentFaultKind]]]] = {
    "bit errors onward": (lambda: Segment(onward=bit_errors(0.05)), {(FaultPlace.BETWEEN, 1, SegmentFaultKind.BITS)}),
    "few bit errors onward": (
        lambda: Segment(onward=bit_errors(0.015)),
        {(FaultPlace.BETWEEN, 1, SegmentFaultKind.BITS)},
    ),
    "bit errors back": (lambda: Segment(back=bit_errors(0.05)), {(FaultPlace.BETWEEN, 0, SegmentFaultKind.BITS)}),
    "bit errors both ways": (
        lambda: Segment(onward=bit_errors(0.05), back=bit_errors(0.08)),
        {(FaultPlace.BETWEEN, 1, SegmentFaultKind.BITS), (FaultPlace.BETWEEN, 0, SegmentFaultKind.BITS)},
    ),
    "back is dead": (lambda: Segment(back=dead), {(FaultPlace.BETWEEN, 0, SegmentFaultKind.DEAD)}),
    "first octet onward": (
        lambda: Segment(onward=without_begin(0.1)),
        {(FaultPlace.BETWEEN, 1, SegmentFaultKind.BEGIN)},
    ),
    "first octets back": (
        lambda: Segment(back=without_begin(0.2, 3)),
        {(FaultPlace.BETWEEN, 0, SegmentFaultKind.BEGIN)},
    ),
    "last octets onward": (lambda: Segment(onward=without_end(0.1)), {(FaultPlace.BETWEEN, 1, SegmentFaultKind.END)}),
    "last octet back": (lambda: Segment(back=without_end(0.1, 1)), {(FaultPlace.BETWEEN, 0, SegmentFaultKind.END)}),
    "frames lost onward": (lambda: Segment(onward=lost(0.05)), {(FaultPlace.BETWEEN, 1, SegmentFaultKind.LOST)}),
    "frames lost back": (lambda: Segment(back=lost(0.05)), {(FaultPlace.BETWEEN, 0, SegmentFaultKind.LOST)}),
    "a gateway rewrites": (
        lambda: Segment(back=rewritten(0.1), delay=40 * MS),
        {(FaultPlace.BETWEEN, 0, SegmentFaultKind.CHANGED)},
    ),
    "a gateway loses onward": (
        lambda: Segment(onward=lost(0.05), delay=30 * MS, jitter=10 * MS),
        {(FaultPlace.BETWEEN, 1, SegmentFaultKind.LOST)},
    ),
    "bit errors behind a gateway": (
        lambda: Segment(back=bit_errors(0.05), delay=25 * MS, jitter=5 * MS),
        {(FaultPlace.BETWEEN, 0, SegmentFaultKind.BITS)},
    ),
    "the tap at B reads badly": (
        lambda: Segment(at_b=bit_errors(0.05)),
        {(FaultPlace.EITHER, 1, SegmentFaultKind.BITS)},
    ),
    "the tap at A reads badly": (
        lambda: Segment(at_a=bit_errors(0.05)),
        {(FaultPlace.EITHER, 0, SegmentFaultKind.BITS)},
    ),
    "the tap at B reads badly behind a gateway": (
        lambda: Segment(at_b=bit_errors(0.05), delay=40 * MS),
        {(FaultPlace.TAP, 1, SegmentFaultKind.BITS)},
    ),
    "the tap at B hears nothing for a while": (
        lambda: Segment(at_b=lost(0.1)),
        {(FaultPlace.EITHER, 1, SegmentFaultKind.LOST)},
    ),
}
CLEAN = {
    "cable": Segment,
    "repeater": lambda: Segment(delay=600_000),
    "gateway": lambda: Segment(delay=40 * MS, jitter=20 * MS),
    "slow gateway": lambda: Segment(delay=300 * MS, jitter=100 * MS),
}


def tap(wire: Wire, latency: int, line: LineSettings = LINE, protocol: str = "modbus-rtu") -> TapFrames:
    session = Session("tap", line, protocol, adapter=Adapter(latency=latency))
    chunks: list[Chunk] = ftdi(wire) if latency else exact(wire)
    ear = TapEar()
    survey(_Capture(chunks), session, ear)
    return ear.frames()


class _Capture:
    def __init__(self, chunks: list[Chunk]) -> None:
        self._chunks = chunks

    def items(self):
        return iter(self._chunks)

    def blocks(self):
        return blocks_of(iter(self._chunks))


@cache
def wires_of(name: str) -> tuple[Wire, Wire]:
    """What passes the two taps, once for all adapters."""
    make = FAULTS[name][0] if name in FAULTS else CLEAN[name]
    return make().run(Timing(LINE))


def judged(wires: tuple[Wire, Wire], latency: int) -> tuple[dict[int, Traffic], list[SegmentFault]]:
    return compared([tap(wire, latency) for wire in wires], 2 * (latency + LINE.char))


def compared(taps: list[TapFrames], doubt: int) -> tuple[dict[int, Traffic], list[SegmentFault]]:
    first, second = taps
    senders = traffic(first, second, matched(first, second, doubt))
    return senders, faults(senders, doubt)


@pytest.mark.parametrize(
    ("name", "adapter"),
    [(name, one) for place, name in enumerate(some(tuple(FAULTS), 2)) for one in in_turn(tuple(ADAPTERS), place, 2)],
)
def test_the_right_side_is_named(name: str, adapter: str) -> None:
    expected = FAULTS[name][1]
    _, found = judged(wires_of(name), ADAPTERS[adapter])
    assert {(fault.place, fault.tap, fault.kind) for fault in found} == expected
    for fault in found:
        if fault.place is FaultPlace.BETWEEN:
            hit, spared = (BEHIND_A, BEHIND_B) if fault.tap == 1 else (BEHIND_B, BEHIND_A)
            assert set(fault.senders) <= hit
            assert set(fault.spared) & spared
            assert name.startswith("few") or set(fault.spared) <= spared
        assert sentence(fault)


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize("name", CLEAN)
def test_of_a_clean_stretch_nothing_is_said(name: str, adapter: str) -> None:
    senders, found = judged(wires_of(name), ADAPTERS[adapter])
    assert found == []
    assert sum(one.both for one in senders.values()) == sum(one.heard for one in senders.values()) == 2400


def test_without_one_common_frame_nothing_is_said() -> None:
    apart = {name: Traffic(missing=[0, 50]) for name in (1, 2, 3)} | {5: Traffic(missing=[50, 0])}
    assert faults(apart, 2 * LINE.char) == []
    assert faults({**apart, -1: Traffic(both=200)}, 2 * LINE.char)


@pytest.mark.parametrize("delay", [0, 3 * MS, 40 * MS])
def test_delays_are_those_of_the_stretch(delay: int) -> None:
    senders, _ = judged(Segment(delay=delay).run(Timing(LINE)), 0)
    for name, one in senders.items():
        usual = sorted(one.delays)[len(one.delays) // 2]
        assert usual == (delay if name in BEHIND_A else -delay)
        side = TapSide.UNKNOWN if not delay else TapSide.FIRST if name in BEHIND_A else TapSide.SECOND
        assert one.side(2 * LINE.char) is side


@pytest.mark.parametrize("adapter", ADAPTERS)
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("clean", set()),
        ("onward", {(FaultPlace.BETWEEN, 1, SegmentFaultKind.BITS)}),
        ("back", {(FaultPlace.BETWEEN, 0, SegmentFaultKind.LOST)}),
        ("tap", {(FaultPlace.EITHER, 0, SegmentFaultKind.BITS)}),
    ],
)
def test_on_a_token_ring_whose_frames_are_all_alike(
    name: str, adapter: str, expected: set[tuple[FaultPlace, int, SegmentFaultKind]]
) -> None:
    segment = {
        "clean": Segment(delay=100_000),
        "onward": Segment(onward=bit_errors(0.06)),
        "back": Segment(back=lost(0.06)),
        "tap": Segment(at_a=bit_errors(0.06)),
    }[name]
    line, latency = LineSettings.parse("38400,8N1"), ADAPTERS[adapter]
    taps = [tap(wire, latency, line, "mstp") for wire in ring(segment, Timing(line))]
    senders, found = compared(taps, 2 * (latency + line.char))
    assert {(fault.place, fault.tap, fault.kind) for fault in found} == expected
    if name == "clean":
        assert sum(one.both for one in senders.values()) == 2400


def test_of_a_million_frames_who_is_hit_hardly_less_is_not_spared() -> None:
    hit, hardly_less = (Traffic(both=1_000_000 - count, damaged=[0, count]) for count in (4_100, 3_950))
    (fault,) = faults({1: hit, 2: hardly_less}, 0)
    assert (fault.place, fault.spared) == (FaultPlace.EITHER, ())
    whole = Traffic(both=1_000_000)
    (fault,) = faults({1: hit, 2: whole}, 0)
    assert (fault.place, fault.spared) == (FaultPlace.BETWEEN, (2,))
