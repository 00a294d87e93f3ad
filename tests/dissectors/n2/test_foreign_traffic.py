"""Other protocols' traffic: N2 claims none of it, and Modbus ASCII claims none of N2's."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.checksums import lrc
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.n2 import N2Framer

relaxed = settings(deadline=None)
MS = 1_000_000
CAPTURES = Path(__file__).parents[3] / "../shared/captures"
FOREIGN = sorted(p for p in CAPTURES.glob("*/frames.txt") if "n2" not in p.parent.name) if CAPTURES.exists() else []
N2_FRAMES = [b">0111010387\r", b"A0042910000F0\r", b">0104C5\r", b"A\r", b">FE130103B3\r", b"N11\r", b"A4064\r"]


def frames_of(path: Path) -> list[bytes]:
    frames = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        match = re.match(r"^\s*\S+\s+((?:[0-9A-Fa-f]{2}[ \t]?)+)", line)
        if match and not line.startswith("#"):
            frames.append(bytes.fromhex(match[1]))
    return frames


def listen(framer, parts, timing: Timing, pause: int) -> list:
    events, now = [], 10**18
    for octets in parts:
        now += pause + len(octets) * timing.char
        events += framer.feed(Chunk(now, octets))
    return events + framer.close()


def good(events: list) -> list[bytes]:
    return [e.octets for e in events if isinstance(e, Frame) and e.ok]


@pytest.mark.parametrize("path", FOREIGN, ids=[p.parent.name for p in FOREIGN])
@pytest.mark.parametrize("pause", [0, 5 * MS])
def test_no_capture_of_another_protocol_holds_an_n2_frame(path, pause):
    frames = frames_of(path)
    assert frames, "the capture was not read"
    frames = frames[:5000]
    assert good(listen(N2Framer(Timing()), frames, Timing(), pause)) == []


if not FOREIGN:

    def test_captures():
        pytest.skip("no captures of others here")


def ascii_line(body: bytes) -> bytes:
    return b":%s%02X\r\n" % (body.hex().upper().encode(), lrc(body))


bodies = st.binary(min_size=2, max_size=30).map(ascii_line)
lines = st.tuples(bodies, st.lists(st.integers(1, 60), max_size=3))


@relaxed
@given(st.lists(lines, min_size=1, max_size=6), st.sampled_from([0, 20 * MS, 300 * MS]))
def test_modbus_ascii_is_no_n2(lines, pause):
    """Also when a read ends inside a line and the rest comes after a pause."""
    timing = Timing(LineSettings.parse("9600,7E1"))
    parts = []
    for line, cuts in lines:
        bounds = [0, *sorted(c for c in set(cuts) if c < len(line)), len(line)]
        parts += [line[low:high] for low, high in pairwise(bounds)]
    assert good(listen(N2Framer(timing), parts, timing, pause)) == []


def test_a_modbus_ascii_line_with_a_pause_before_an_a_is_no_answer():
    # 1 s between the characters of a line is allowed there; its rest happens to sum up like an N2 answer
    events = listen(N2Framer(Timing()), [b":0103", b"A4064\r\n"], Timing(), 300 * MS)
    assert not any(isinstance(e, Frame) for e in events)
    events = listen(N2Framer(Timing()), [b":0103", b"A4064\r\n"], Timing(), 1100 * MS)
    assert good(events) == [b"A4064\r"]


@relaxed
@given(st.lists(st.sampled_from(N2_FRAMES), min_size=1, max_size=12), st.sampled_from([0, 20 * MS, 1500 * MS]))
def test_n2_is_no_modbus_ascii(frames, pause):
    framing = pytest.importorskip("dissectors.modbus.ascii_framing")
    timing = Timing(LineSettings.parse("9600,8N1"))
    assert good(listen(framing.AsciiFramer(timing), frames, timing, pause)) == []
