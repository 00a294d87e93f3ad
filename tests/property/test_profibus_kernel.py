"""The PROFIBUS kernel held against the reference framer and peek: captures, buses, noise, any cut, any times."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.columns import FrameColumns, Reads
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import Timing
from dissectors.profibus import PROFIBUS
from dissectors.profibus.kernel import kernel
from dissectors.profibus.telegram import telegram, token
from sniff import formats
from tests.bench import bulk_profibus
from tests.bus_delivery import FTDI_LATENCY, MS, exact, ftdi, laid_out, with_noise
from tests.property.kernel_equality import assert_equal, cut_anyhow, reads_of
from tests.seeds import in_turn

EXACT = bulk_profibus.TIMING
TIMINGS = (EXACT, replace(EXACT, latency=FTDI_LATENCY), replace(EXACT, latency=MS))
_OWN = Path(__file__).parents[2] / "captures"


OURS = sorted(_OWN.rglob("profibus*.cap.txt"))


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_of_our_captures(path: Path) -> None:
    capture = formats.read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)][:2000]
    for latency in {capture.session.timing.latency, *in_turn((0, FTDI_LATENCY), OURS.index(path), 2)}:
        assert_equal(PROFIBUS, chunks, replace(capture.session.timing, latency=latency))


def bus(dice: random.Random, count: int) -> list[bytes]:
    """Three masters, of which one never asks; all services, refusals, segments, acknowledgements, silent slaves."""
    made: list[bytes] = []
    while len(made) < count:
        for master, following in ((2, 4), (4, 7), (7, 2)):
            for _ in range(dice.randint(0, 4) if master != 7 else 0):
                made += _exchange(dice, master)
            made.append(token(following, master))
    return made


def _exchange(dice: random.Random, master: int) -> list[bytes]:
    slave, data = (
        dice.randint(8, 12),
        dice.choice((b"", b"\x32\1\0\0\0\1\0\2\0\0")) + dice.randbytes(dice.randint(0, 12)),
    )
    points = dice.choice(((None, None), (None, None), (60, 62), (61, 62), (51, 50), (12, 50), (0x41, 62), (None, 62)))
    control = dice.choice((0x5D, 0x7D, 0x6C, 0x49, 0x46, 0x43))
    asked = telegram(slave, master, control, data, *points)
    answer = telegram(master, slave, dice.choice((0x08, 0x0A, 0x00, 0x03)), data[::-1], *points[::-1])
    sd3 = bytes.fromhex("A208025D01020304050607088B16")
    return [asked, *dice.choice(([answer], [answer], [b"\xe5"], [], [b"\xe5", answer], [sd3, b"\xe5"]))]


@pytest.mark.parametrize("timing", TIMINGS)
def test_of_a_bus(timing: Timing) -> None:
    frames = bus(random.Random(485), 600)
    for chunks in (exact(laid_out(frames, timing, MS)), ftdi(laid_out(frames, timing, MS))):
        found, total = assert_equal(PROFIBUS, chunks, timing)
        assert found > 0.85 * total  # an acknowledgement with the answer behind it is none, and none is a stray one


def test_a_regular_bus_is_taken_whole() -> None:
    reads = bulk_profibus.reads(3000)
    chunks = [
        Chunk(time, reads.octets[begin:end].tobytes())
        for time, begin, end in zip(reads.times.tolist(), reads.begins[:-1], reads.begins[1:], strict=True)
    ]
    found, total = assert_equal(PROFIBUS, chunks, EXACT)
    assert total == len(reads)
    assert found >= total - 20


@pytest.mark.parametrize("timing", TIMINGS)
def test_of_a_noisy_bus(timing: Timing) -> None:
    dice = random.Random(485)
    for gap in (MS, 120 * MS):
        wire, _ = with_noise(laid_out(bus(dice, 300), timing, gap), timing, dice, gap)
        for chunks in (exact(wire), ftdi(wire)):
            assert_equal(PROFIBUS, chunks, timing)


def test_telegrams_with_line_errors_are_doubtful() -> None:
    whole = telegram(8, 2, 0x5D, b"\x01\x02")
    marked, clean = Chunk(10**9, whole, (Mark(2, LineError.PARITY),)), Chunk(2 * 10**9, whole)
    assert kernel(reads_of([marked, clean, marked]), EXACT).offset.tolist() == [len(whole)]


def test_nothing_in_nothing() -> None:
    empty = np.zeros(0, np.int64)
    assert not len(kernel(Reads(np.zeros(0, np.uint8), empty, empty, np.zeros(0, bool)), EXACT))


INNER = telegram(9, 3, 0x5D, b"\x01\x02")
pieces = st.one_of(
    st.sampled_from(
        [
            telegram(8, 2, 0x49),
            telegram(2, 8, 0x00),
            telegram(8, 2, 0x5D, b"\x10\xdc\xe5"),
            telegram(2, 8, 0x08, b"\xe5\x68"),
            telegram(8, 2, 0x5D, INNER + token(3, 9)),
            telegram(2, 3, 0x49),
            token(3, 2),
            token(2, 3),
            token(5, 3),
            token(16, 2),
            token(104, 3),
            b"\xe5",
            INNER,
            bytes.fromhex("A208025D01020304050607088B16"),
        ]
    ),
    st.binary(max_size=6),
    st.lists(st.sampled_from([b"\x10", b"\x68", b"\xdc", b"\xe5", b"\x16", b"\x02", b"\x03"]), max_size=9).map(
        b"".join
    ),
)


@given(
    st.sampled_from(TIMINGS),
    st.lists(pieces, max_size=30),
    st.lists(st.integers(1, 12), min_size=1, max_size=8),
    st.lists(st.sampled_from([0, 1_000, MS, 3 * MS, 130 * MS, 2_000 * MS, -5 * MS]), min_size=1, max_size=8),
)
def test_of_any_octets(timing: Timing, pieces: list[bytes], cuts: list[int], pauses: list[int]) -> None:
    chunks = cut_anyhow(b"".join(pieces), timing, cuts, pauses)
    if chunks and min(pauses) >= 0:
        assert_equal(PROFIBUS, chunks, timing)
    elif chunks:
        assert isinstance(kernel(reads_of(chunks), timing), FrameColumns)
