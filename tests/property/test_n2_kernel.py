"""The N2 kernel held against the reference framer and peek: captures, buses, noise, any cut, any times."""

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
from dissectors.n2 import N2
from dissectors.n2.envelope import make_answer, make_command
from dissectors.n2.kernel import kernel
from sniff import formats
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi, laid_out, with_noise
from tests.property.kernel_equality import assert_equal, cut_anyhow, reads_of

EXACT = Timing(LineSettings.parse("9600,8N1"))
TIMINGS = (EXACT, replace(EXACT, latency=FTDI_LATENCY), replace(EXACT, latency=MS))
_OWN = Path(__file__).parents[2] / "captures"


@pytest.mark.parametrize("path", sorted(_OWN.rglob("*n2*.cap.txt")), ids=lambda path: path.name)
def test_of_our_captures(path: Path) -> None:
    capture = formats.read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    for latency in {capture.session.timing.latency, 0, FTDI_LATENCY}:
        assert_equal(N2, chunks, replace(capture.session.timing, latency=latency))


def bus(dice: random.Random, exchanges: int) -> list[bytes]:
    """Polls, reads, writes and identifies of eight stations; some are refused, some never answered."""
    made: list[bytes] = []
    for _ in range(exchanges):
        address, kind = dice.randint(1, 8), dice.random()
        if kind < 0.3:
            asked, answered = f"{address:02X}04", dice.choice(("", f"{dice.randrange(1 << 16):04X}"))
        elif kind < 0.7:
            asked = f"{address:02X}1{dice.randint(1, 4)}{dice.randint(1, 9):02X}03"
            answered = f"{dice.randrange(1 << 32):08X}"
        elif kind < 0.8:
            asked, answered = f"{address:02X}72{dice.randint(1, 4):02X}01{dice.randrange(1 << 32):08X}", ""
        else:
            asked, answered = f"{address:02X}F", "10"
        made.append(make_command(asked))
        if dice.random() < 0.03:
            continue
        made.append(
            b"N%s\r" % dice.choice((b"00", b"01", b"11", b"77")) if dice.random() < 0.05 else make_answer(answered)
        )
    return made


@pytest.mark.parametrize("timing", TIMINGS)
@pytest.mark.parametrize("seed", range(3))
def test_of_a_bus(timing: Timing, seed: int) -> None:
    frames = bus(random.Random(seed), 400)
    found, total = assert_equal(N2, exact(laid_out(frames, timing, 3 * MS)), timing)
    assert found >= total - 2
    found, total = assert_equal(N2, ftdi(laid_out(frames, timing, MS)), timing)
    if timing.latency >= FTDI_LATENCY:  # without, reads that come late prove silence
        assert found >= total - 2


@pytest.mark.parametrize("timing", TIMINGS)
def test_of_a_noisy_bus(timing: Timing) -> None:
    dice = random.Random(485)
    for gap in (3 * MS, 30 * MS):
        wire, _ = with_noise(laid_out(bus(dice, 300), timing, gap), timing, dice, gap)
        for chunks in (exact(wire), ftdi(wire)):
            assert_equal(N2, chunks, timing)


def test_a_frame_with_line_errors_is_doubtful() -> None:
    frame = make_command("0104")
    marked = Chunk(10**9, frame, (Mark(2, LineError.PARITY),))
    clean = Chunk(2 * 10**9, frame)
    assert [int(at) for at in kernel(reads_of([marked, clean, marked]), EXACT).offset] == [len(frame)]


pieces = st.one_of(
    st.sampled_from(
        [make_command("0104"), make_command("01F"), make_answer(), make_answer("3F800000"), b"N11\r", b"n11\r"]
    ),
    st.binary(max_size=6),
    st.lists(st.sampled_from([b">", b"A", b"N", b"\r", b"\n", b"0", b"F", b"a", b"\x00"]), max_size=9).map(b"".join),
)


@given(
    st.sampled_from(TIMINGS),
    st.lists(pieces, max_size=30),
    st.lists(st.integers(1, 12), min_size=1, max_size=8),
    st.lists(st.sampled_from([0, 1_000, MS, 3 * MS, 120 * MS, 2_000 * MS, -5 * MS]), min_size=1, max_size=8),
)
def test_of_any_octets(timing: Timing, pieces: list[bytes], cuts: list[int], pauses: list[int]) -> None:
    chunks = cut_anyhow(b"".join(pieces), timing, cuts, pauses)
    if chunks and min(pauses) >= 0:
        assert_equal(N2, chunks, timing)
    elif chunks:
        assert isinstance(kernel(reads_of(chunks), timing), FrameColumns)
