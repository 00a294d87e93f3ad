"""The ASCII kernel held against the reference framer and peek: captures, buses, noise, any cut, any times."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.columns import FrameColumns
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings, Timing
from dissectors.modbus import ASCII
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.ascii_kernel import kernel
from dissectors.modbus.envelope import seal_ascii
from sniff import formats
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi, laid_out, with_noise
from tests.property.kernel_equality import assert_equal, cut_anyhow, reads_of
from tests.property.modbus_adus import ascii_frames
from tests.property.test_rtu_kernel import _exchange
from tests.seeds import seeds

EXACT = Timing(LineSettings.parse("9600,8N1"))
TIMINGS = (
    EXACT,
    Timing(LineSettings.parse("19200,7E1")),
    replace(EXACT, latency=FTDI_LATENCY),
    replace(EXACT, latency=MS),
)
_OWN = Path(__file__).parents[2] / "captures"


@pytest.mark.parametrize("path", sorted(_OWN.rglob("*ascii*.cap.txt")), ids=lambda path: path.name)
def test_of_our_captures(path: Path) -> None:
    capture = formats.read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    for latency in {capture.session.timing.latency, 0, FTDI_LATENCY}:
        assert_equal(ASCII, chunks, replace(capture.session.timing, latency=latency))


def bus(dice: random.Random, exchanges: int) -> list[bytes]:
    """Reads and writes of all usual functions, some refused."""
    codes = (1, 2, 3, 4, 5, 6, 15, 16, 23)
    return [seal_ascii(frame[:-2]) for _ in range(exchanges) for frame in _exchange(dice, codes)]


@pytest.mark.parametrize("timing", TIMINGS)
@pytest.mark.parametrize("seed", seeds(3))
def test_of_a_bus(timing: Timing, seed: int) -> None:
    frames = bus(random.Random(seed), 300)
    for chunks in (exact(laid_out(frames, timing, 3 * MS)), ftdi(laid_out(frames, timing, MS))):
        found, total = assert_equal(ASCII, chunks, timing)
        assert found >= 0.99 * total


@pytest.mark.parametrize("timing", TIMINGS)
def test_of_a_noisy_bus(timing: Timing) -> None:
    dice = random.Random(485)
    for gap in (3 * MS, 30 * MS):
        wire, _ = with_noise(laid_out(bus(dice, 200), timing, gap), timing, dice, gap)
        for chunks in (exact(wire), ftdi(wire)):
            assert_equal(ASCII, chunks, timing)


def test_a_frame_with_line_errors_is_doubtful() -> None:
    frame = seal_ascii(bytes.fromhex("010300000002"))
    marked = Chunk(10**9, frame, (Mark(2, LineError.PARITY),))
    clean = Chunk(2 * 10**9, frame)
    assert [int(at) for at in kernel(reads_of([marked, clean, marked]), EXACT).offset] == [len(frame)]


def test_what_a_station_made_of_its_end_character_stays() -> None:
    change = seal_ascii(bytes.fromhex("010800034100"))
    earlier, later = AsciiFramer(EXACT), AsciiFramer(EXACT)
    for number in (1, 2):
        earlier.feed(Chunk(number * 10**9, change))
    later.remember(earlier, kernel(reads_of([]), EXACT), reads_of([]).octets, 0, 0)
    answer = seal_ascii(bytes.fromhex("010302000A"))[:-1] + b"A"
    assert later.feed(Chunk(3 * 10**9, answer)) == earlier.feed(Chunk(3 * 10**9, answer)) != []


pieces = st.one_of(
    ascii_frames,
    ascii_frames.map(bytes.lower),
    ascii_frames.map(lambda frame: frame[:-2] + b"00\r\n"),
    st.sampled_from(
        [seal_ascii(bytes.fromhex("010800034100")), seal_ascii(bytes.fromhex("0103020000")), b"\r\n", b":"]
    ),
    st.binary(max_size=6),
    st.lists(st.sampled_from([b":", b"\r", b"\n", b"0", b"F", b"a", b"01", b"\x00"]), max_size=9).map(b"".join),
)


@given(
    st.sampled_from(TIMINGS),
    st.lists(pieces, max_size=20),
    st.lists(st.integers(1, 40), min_size=1, max_size=8),
    st.lists(st.sampled_from([0, 1_000, MS, 3 * MS, 120 * MS, 2_000 * MS, -5 * MS]), min_size=1, max_size=8),
)
def test_of_any_octets(timing: Timing, pieces: list[bytes], cuts: list[int], pauses: list[int]) -> None:
    chunks = cut_anyhow(b"".join(pieces), timing, cuts, pauses)
    if chunks and min(pauses) >= 0:
        assert_equal(ASCII, chunks, timing)
    elif chunks:
        assert isinstance(kernel(reads_of(chunks), timing), FrameColumns)
