"""Pairing MS/TP by columns is what the tracker does, row by row, and leaves it where it would be."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.line import Timing
from tests.bench import bulk_mstp
from tests.property import mstp_buses as buses
from tests.property.pairing_equality import assert_paired_alike

MS = buses.MS
LATENCIES = (0, 16 * MS)


@pytest.mark.parametrize("path", buses.OURS, ids=lambda path: path.name)
def test_our_captures(path: Path) -> None:
    chunks, timing = buses.chunks_of(path)
    for latency in LATENCIES:
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


@pytest.mark.parametrize("seed", range(40))
def test_any_conversation(seed: int) -> None:
    """Few stations and invoke ids that say anything, so that repeats and late answers abound."""
    dice = random.Random(seed)
    timing = Timing(buses.LINE, dice.choice(LATENCIES))
    assert_paired_alike(buses.conversation(dice, 400), timing)


@settings(max_examples=150, deadline=None)
@given(st.data(), buses.timings)
def test_any_traffic(data: st.DataObject, timing: Timing) -> None:
    assert_paired_alike(data.draw(buses.captures(timing)), timing)
