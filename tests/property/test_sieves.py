"""What a sieve holds back holds no good frame, whatever was before it, however it was spoilt and cut into reads."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors import registry
from dissectors.frame import Chunk, Event, Frame
from dissectors.framer import Framer
from dissectors.line import LineSettings, Timing
from sniff.engine.engine import Engine
from sniff.formats import read

CAPTURES = Path(__file__).parents[2] / "captures"
CLEAN = {
    "modbus-rtu": "rtu-clean.cap.txt",
    "modbus-ascii": "ascii-clean.cap.txt",
    "n2": "n2-clean.cap.txt",
    "mstp": "mstp-clean.cap.txt",
    "profibus": "profibus-clean.cap.txt",
}
SECOND = 1_000_000_000


def frames_of(name: str) -> list[bytes]:
    """The good frames of a clean bus of that protocol, in their order."""
    capture = read(CAPTURES / CLEAN[name])
    dissector = registry.get(name)
    engine = Engine(dissector, Timing(capture.session.line), pairing=False)
    outputs = [engine.feed(item) for item in capture.items() if isinstance(item, Chunk)]
    events = [row.event for output in (*outputs, engine.close()) for row in output.rows]
    return [event.octets for event in events if isinstance(event, Frame) and event.ok]


FRAMES = {name: frames_of(name) for name in CLEAN}


def good(events: list[Event]) -> list[bytes]:
    return [event.octets for event in events if isinstance(event, Frame) and event.ok]


def heard(framer: Framer, pieces: list[bytes], now: int, char: int) -> tuple[list[bytes], int]:
    """The good frames of a stretch that is read in pieces and stands alone."""
    events: list[Event] = []
    for piece in pieces:
        now += len(piece) * char
        events += framer.feed(Chunk(now, piece))
    return good(events + framer.advance(now + 10 * SECOND)), now + 10 * SECOND


@st.composite
def stretches(draw: st.DrawFn, frames: list[bytes]) -> list[bytes]:
    """Octets in reads: rubbish, and frames whole or spoilt."""
    frame = st.sampled_from(frames).map(lambda octets: octets[:40])
    parts = draw(st.lists(st.one_of(frame, frame, st.binary(max_size=12)), min_size=1, max_size=3))
    octets = bytearray(b"".join(parts))
    for at, bit in draw(st.lists(st.tuples(st.integers(0, 99), st.integers(0, 7)), max_size=2)):
        if octets:
            octets[at % len(octets)] ^= 1 << bit
    begin, end = draw(st.integers(0, 3)), draw(st.integers(0, 3))
    left = bytes(octets[begin : len(octets) - end])
    cut = draw(st.integers(0, len(left)))
    return [piece for piece in (left[:cut], left[cut:]) if piece]


@pytest.mark.parametrize("name", CLEAN)
def test_what_is_held_back_holds_no_good_frame(name: str) -> None:
    dissector = registry.get(name)
    timing = Timing(LineSettings.parse(dissector.default_line))

    @given(st.data())
    def holds(data: st.DataObject) -> None:
        framer = dissector.framer(timing)
        now = 0
        for octets in FRAMES[name][: data.draw(st.sampled_from([0, 1, 20]))]:
            now += 5_000_000 + len(octets) * timing.char
            framer.feed(Chunk(now, octets))
        framer.advance(now + 10 * SECOND)
        now += 10 * SECOND
        for pieces in data.draw(st.lists(stretches(FRAMES[name]), min_size=1, max_size=3)):
            found, now = heard(framer, pieces, now, timing.char)
            assert not found or dissector.sieve(b"".join(pieces))

    holds()


@pytest.mark.parametrize("name", CLEAN)
def test_noise_is_held_back_and_every_frame_let_through(name: str) -> None:
    sieve = registry.get(name).sieve
    assert not sieve(b"\x00\xfe\x01\xfc")
    assert all(sieve(octets) for octets in FRAMES[name])
