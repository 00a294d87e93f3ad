"""What the MS/TP kernel says is what framer and peek say, frame by frame."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.kernel import kernel
from dissectors.checksums import crc8_mstp
from dissectors.columns import Reads
from dissectors.frame import Chunk
from dissectors.line import Timing
from tests.bench import bulk_mstp
from tests.property import mstp_buses as buses
from tests.property.kernel_equality import assert_equal, reads_of
from tests.seeds import examples, in_turn, seeds

MS = buses.MS
LATENCIES = (0, 16 * MS)


@pytest.mark.parametrize("path", buses.OURS, ids=lambda path: path.name)
def test_our_captures(path: Path) -> None:
    chunks, timing = buses.chunks_of(path)
    for latency in in_turn(LATENCIES, buses.OURS.index(path), 2):  # the pairing is tried with the other
        assert_equal(MSTP, chunks, Timing(timing.line, latency))


@pytest.mark.parametrize("name", buses.THEIRS)
def test_captures_of_others(name: str) -> None:
    chunks, timing = buses.chunks_of(buses.others(name), most=20_000)
    by_columns, total = assert_equal(MSTP, chunks, timing)
    assert by_columns >= total - 20


@pytest.mark.parametrize("latency", LATENCIES)
def test_a_clean_bus_is_nearly_all_columns(latency: int) -> None:
    chunks = buses.chunks_of_reads(bulk_mstp.reads(8_000))
    by_columns, total = assert_equal(MSTP, chunks, Timing(bulk_mstp.LINE, latency))
    assert by_columns > 0.99 * total


def test_a_clean_bus_in_merged_and_torn_reads_is_nearly_all_columns() -> None:
    chunks = buses.chunks_of_reads(bulk_mstp.reads(6_000, seed=2))
    torn = buses.recut(chunks, bulk_mstp.TIMING.char, random.Random(1))
    by_columns, total = assert_equal(MSTP, torn, bulk_mstp.TIMING)
    assert by_columns > 0.99 * total


def test_a_bus_with_some_damage_is_mostly_columns() -> None:
    chunks = buses.chunks_of_reads(bulk_mstp.reads(10_000, seed=3, damaged=0.005, answered=0.9))
    by_columns, total = assert_equal(MSTP, chunks, bulk_mstp.TIMING)
    assert by_columns > 0.97 * total


@pytest.mark.parametrize("seed", range(4))
def test_headers_of_data_of_any_form(seed: int) -> None:
    frames = buses.data_of_any_form(random.Random(seed), 3_000)
    frames = [one for one in frames if not (32 <= one[2] <= 127 and len(one) < 15)]
    chunks = [Chunk(buses.START + at * 10**9, one) for at, one in enumerate(frames)]
    by_columns, total = assert_equal(MSTP, chunks, Timing(buses.LINE))
    assert by_columns > 0.99 * total


@pytest.mark.parametrize("seed", seeds(12, 4))
def test_damage_of_any_kind(seed: int) -> None:
    dice = random.Random(seed)
    assert_equal(MSTP, buses.spoilt_bus(dice, 800), Timing(buses.LINE, dice.choice(LATENCIES)))


def test_a_good_header_behind_a_pause_ends_the_frame_around_it() -> None:
    token = frame(0, 1, 2)
    around = frame(6, 1, 2, b"\x01\x00" + token + b"\x05")
    for pause, whole in ((0, True), (30 * MS, False), (99 * MS, False)):
        first = Chunk(buses.START, token + around[:10])
        chunks = [first, Chunk(buses.START + pause + 40 * MS * bool(pause), around[10:] + token + token)]
        by_columns, _ = assert_equal(MSTP, chunks, Timing(buses.LINE))
        assert (by_columns >= 2) == whole, pause


def test_a_header_at_the_end_of_a_block_may_end_the_damaged_frame_before_it() -> None:
    """What is said of a block must hold whatever follows."""
    token = frame(0, 1, 2)
    damaged = frame(6, 1, 2, b"\x01\x00\x10\x08\x00\x55")
    bad_header = damaged[:4] + b"\x03" + damaged[5:]
    for octets in (damaged[:-2] + token, damaged[:-1] + token, bad_header[:-1] + token, bad_header[:-3] + token):
        whole = token + octets + token + token
        for cut in range(1, len(whole)):
            known = kernel(reads_of([Chunk(buses.START, whole[:cut])]), Timing(buses.LINE))
            later = kernel(reads_of([Chunk(buses.START, whole)]), Timing(buses.LINE))
            for offset, length in zip(known.offset.tolist(), known.length.tolist(), strict=True):
                assert (offset, length) in set(zip(later.offset.tolist(), later.length.tolist(), strict=True))


def test_a_bad_header_with_a_length_over_the_limit_is_eight_octets() -> None:
    for kind, length in ((6, 502), (6, 600), (32, 2044)):
        header = bytes((0x55, 0xFF, kind, 1, 2, length >> 8, length & 255))
        bad = header + bytes((crc8_mstp(header[2:]) ^ 1,))
        octets = frame(0, 1, 2) * 2 + bad + bytes(length + 2) + frame(0, 1, 2) * 2
        assert_equal(MSTP, [Chunk(buses.START, octets)], Timing(buses.LINE))


def test_a_process_id_may_look_like_an_object() -> None:
    asked = bytes.fromhex("010400050c05")
    for process in ("0912", "0c12345678", "0c0000001c"):
        for behind in ("", "1c", "1c00000009", "1c000000092900", "2c000000090900", "190d", "1c1c00000009"):
            octets = asked + bytes.fromhex(process + behind)
            chunks = [Chunk(buses.START, frame(5, 1, 2, octets) + frame(0, 1, 2) + frame(5, 1, 2, octets))]
            assert_equal(MSTP, chunks, Timing(buses.LINE))


@settings(max_examples=examples(200), deadline=None)
@given(st.data(), buses.timings)
def test_any_traffic(data: st.DataObject, timing: Timing) -> None:
    assert_equal(MSTP, data.draw(buses.captures(timing)), timing)


@settings(max_examples=examples(150), deadline=None)
@given(st.data(), buses.timings)
def test_any_good_frames(data: st.DataObject, timing: Timing) -> None:
    pieces = st.lists(buses.good_frames, min_size=1, max_size=20)
    assert_equal(MSTP, data.draw(buses.captures(timing, pieces)), timing)


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(buses.good_frames, min_size=2, max_size=12), st.sampled_from(LATENCIES))
def test_good_frames_back_to_back_are_all_columns(frames: list[bytes], latency: int) -> None:
    """But those of damaged form; a preamble among the data keeps nothing out."""
    frames = [one for one in frames if len(one) <= 511 and not (32 <= one[2] <= 127 and len(one) < 15)]
    chunks = [Chunk(buses.START, frame(0, 1, 2) + b"".join(frames) + frame(0, 2, 1))]
    by_columns, total = assert_equal(MSTP, chunks, Timing(buses.LINE, latency))
    assert by_columns >= total - 2


@settings(max_examples=examples(150), deadline=None)
@given(st.binary(max_size=300), st.lists(st.integers(-(2**40), 2**40), min_size=1, max_size=5))
def test_any_octets_at_any_times(octets: bytes, times: list[int]) -> None:
    size = max(1, len(octets) // len(times))
    chunks = [Chunk(time, octets[at * size : (at + 1) * size]) for at, time in enumerate(times)]
    assert_equal(MSTP, chunks, Timing(buses.LINE))


@settings(max_examples=examples(60), deadline=None)
@given(st.data(), st.integers(0, 40))
def test_blocks_that_know_the_time_before_them(data: st.DataObject, cut: int) -> None:
    """A capture in two blocks: what both say is what one says, the last octets of the first block aside."""
    timing = Timing(buses.LINE)
    chunks = [chunk for chunk in data.draw(buses.captures(timing)) if chunk.octets]
    whole = kernel(reads_of(chunks), timing)
    cut = min(cut, len(chunks))
    reads = reads_of(chunks[cut:])
    if not cut or not len(reads):
        return
    before = max(chunk.time for chunk in chunks[:cut])
    behind = kernel(Reads(reads.octets, reads.times, reads.lengths, reads.marked, before), timing)
    ahead = sum(len(chunk.octets) for chunk in chunks[:cut])
    known = {int(offset): row for row, offset in enumerate(whole.offset)}
    for row, offset in enumerate((behind.offset + ahead).tolist()):
        if offset in known:
            same = known[offset]
            assert behind.length[row] == whole.length[same]
            assert (behind.start[row], behind.end[row]) == (whole.start[same], whole.end[same])


def test_nothing_at_all() -> None:
    nothing = Reads(np.zeros(0, np.uint8), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, bool))
    assert len(kernel(nothing, Timing())) == 0
