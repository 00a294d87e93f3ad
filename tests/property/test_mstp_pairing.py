"""Pairing MS/TP by columns is what the tracker does, row by row, and leaves it where it would be."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.bacnet import past_exchanges
from dissectors.bacnet.envelope import frame
from dissectors.frame import Chunk
from dissectors.line import Timing
from tests.bench import bulk_mstp
from tests.property import mstp_buses as buses
from tests.property.pairing_equality import assert_paired_alike
from tests.seeds import examples, in_turn, seeds

MS = buses.MS
LATENCIES = (0, 16 * MS)


@pytest.mark.parametrize("path", buses.OURS, ids=lambda path: path.name)
def test_our_captures(path: Path) -> None:
    chunks, timing = buses.chunks_of(path)
    for latency in in_turn(LATENCIES, buses.OURS.index(path) + 1, 2):
        assert_paired_alike(chunks, Timing(timing.line, latency))


@pytest.mark.parametrize("name", buses.THEIRS)
def test_captures_of_others(name: str) -> None:
    chunks, timing = buses.chunks_of(buses.others(name), most=20_000)
    by_columns, total = assert_paired_alike(chunks, timing)
    if total > 100:
        assert by_columns > 0.9 * total


@pytest.mark.parametrize("latency", LATENCIES)
def test_a_clean_bus_is_nearly_all_columns(latency: int) -> None:
    chunks = buses.chunks_of_reads(bulk_mstp.reads(8_000))
    by_columns, total = assert_paired_alike(chunks, Timing(bulk_mstp.LINE, latency))
    assert by_columns > 0.99 * total


def test_a_bus_with_dead_stations_and_damage() -> None:
    chunks = buses.chunks_of_reads(bulk_mstp.reads(12_000, seed=4, damaged=0.01, answered=0.8))
    by_columns, total = assert_paired_alike(chunks, bulk_mstp.TIMING)
    assert by_columns > 0.9 * total


def test_a_request_is_forgotten_behind_many_others() -> None:
    """Invoke ids come again after some hundred requests: no repeat, though soon and with the same octets."""
    chunks = buses.chunks_of_reads(bulk_mstp.reads(20_000, seed=5, answered=0.3))
    by_columns, total = assert_paired_alike(chunks, bulk_mstp.TIMING)
    assert by_columns > 0.98 * total


@pytest.mark.parametrize("seed", seeds(40, 12))
def test_any_conversation(seed: int) -> None:
    """Few stations and invoke ids that say anything, so that repeats and late answers abound."""
    dice = random.Random(seed)
    timing = Timing(buses.LINE, dice.choice(LATENCIES))
    assert_paired_alike(buses.conversation(dice, 400), timing)


def test_blocks_that_are_no_longer_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exchanges of columns are made before their rows go, and are the same."""
    monkeypatch.setattr(past_exchanges, "_KEPT_MOST", 0)
    timing = Timing(buses.LINE)
    chunks = [buses.conversation(random.Random(seed), 300) for seed in range(3)]
    for seed, one in enumerate(chunks):
        assert_paired_alike(one, timing, random.Random(seed), block=40)


@pytest.mark.parametrize("seed", seeds(12, 4))
def test_frames_of_late_reads(seed: int) -> None:
    """Each frame has a slack of its own."""
    dice = random.Random(seed)
    timing = Timing(buses.LINE, dice.choice(LATENCIES))
    assert_paired_alike(buses.conversation(dice, 300), timing, dice)


@settings(max_examples=examples(150), deadline=None)
@given(st.data(), buses.timings)
def test_any_traffic(data: st.DataObject, timing: Timing) -> None:
    assert_paired_alike(data.draw(buses.captures(timing)), timing)


def _bus(*said: tuple[int, bytes]) -> list[Chunk]:
    """Frames, each after so many ms of silence."""
    now, chunks = buses.START, []
    for pause, octets in said:
        now += pause * MS + len(octets) * Timing(buses.LINE).char
        chunks.append(Chunk(now, octets))
    return chunks


def _request(invoke: int, client: int = 1, server: int = 2) -> bytes:
    return frame(5, server, client, bytes((1, 4, 0, 5, invoke, 12)) + b"\x0c\x00\xc0\x00\x07\x19\x55")


def _answer(invoke: int, first: bytes, client: int = 1, server: int = 2) -> bytes:
    return frame(6, client, server, b"\x01\x00" + first[:1] + bytes((invoke,)) + first[1:] + b"\x0c\x11\x22")


TOKENS = [(5, frame(0, 2, 1)), (5, frame(0, 1, 2))] * 3


@pytest.mark.parametrize("seconds", [50, 59, 60, 61, 70])
def test_a_request_is_tried_again_within_a_minute(seconds: int) -> None:
    tried = [*TOKENS, (5, _request(1)), (400, frame(0, 1, 2)), *TOKENS]
    chunks = _bus(*tried, (1000 * seconds - 480, _request(1)), (30, _answer(1, b"\x30")), *TOKENS)
    by_columns, total = assert_paired_alike(chunks, Timing(buses.LINE))
    assert by_columns > total - 4


@pytest.mark.parametrize("others", [100, 254, 255, 256, 257, 300])
def test_a_request_is_tried_again_unless_too_many_came_between(others: int) -> None:
    between = [
        (5, octets)
        for at in range(others)
        for octets in (_request(at % 200, 3 + at // 200, 2), _answer(at % 200, b"\x30", 3 + at // 200, 2))
    ]
    tried = [*TOKENS, (5, _request(1)), (400, frame(0, 2, 1)), *TOKENS]
    assert_paired_alike(_bus(*tried, *between, (5, _request(1)), *TOKENS), Timing(buses.LINE))


def test_a_request_ends_the_answer_in_segments_before_it() -> None:
    """The same segments again are another message, of other frames."""
    in_segments = [
        *TOKENS,
        (5, _request(1)),
        (5, _answer(1, b"\x3c\x00\x02")),
        (5, frame(6, 2, 1, b"\x01\x00\x40\x01\x00\x02")),
        (5, _answer(1, b"\x38\x01\x02")),
        *TOKENS,
    ]
    chunks = _bus(*in_segments, (5, _request(1)), (5, _answer(1, b"\x30")), *in_segments)
    assert_paired_alike(chunks, Timing(buses.LINE))
