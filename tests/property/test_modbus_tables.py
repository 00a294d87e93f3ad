"""Modbus lines with every kind of trouble: tables hold what the reference engine gives, row by row."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from sniff.bus.offline import outputs
from sniff.engine import framing
from sniff.engine.blocks import Block
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.table import Table
from tests.property.modbus_buses import TROUBLES, bus
from tests.seeds import seeds

PUT_RIGHT = 738
"""A write that is put right, its answer, and much later an answer to another write of which two octets are left."""


def assert_read_equally(seed: int, troubles: list[str] | None, is_ascii: bool, exchanges: int) -> None:
    session, reads = bus(seed, is_ascii, exchanges, troubles)
    octets, begins = reads.octets.tobytes(), reads.begins.tolist()
    limits = zip(reads.times.tolist(), begins[:-1], begins[1:], strict=True)
    chunks = [Chunk(time, octets[begin:end]) for time, begin, end in limits]
    expected = [one for one in outputs(chunks, session) if isinstance(one, Output)]
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    assert [row for table in made for row in table.rows()] == [row for one in expected for row in one.rows]
    closed = [table.transaction(place) for table in made for place in range(len(table.transactions))]
    assert closed == [one for output in expected for one in output.transactions]
    whole = Table.of_outputs(session.protocol, 1, expected)
    assert [number for table in made for number in _closers(table)] == _closers(whole)


def _closers(table: Table) -> list[int]:
    return [table.first + (len(table) - 1 if by < 0 else by) for by in table.closed_by.tolist()]


@pytest.fixture(autouse=True)
def _kernel_always(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(framing, "LEAST", 1)


@pytest.mark.parametrize("seed", seeds(60, 3))
@pytest.mark.parametrize("trouble", TROUBLES)
def test_of_damage_beside_one_more_trouble(trouble: str, seed: int) -> None:
    assert_read_equally(seed, ["damage", trouble], False, 150)


@pytest.mark.parametrize("is_ascii", [False, True], ids=["rtu", "ascii"])
@pytest.mark.parametrize("seed", seeds(300, 6))
def test_of_any_trouble(seed: int, is_ascii: bool) -> None:
    assert_read_equally(seed, None, is_ascii, 300)


def test_of_a_write_that_is_put_right() -> None:
    assert_read_equally(PUT_RIGHT, ["damage"], False, 100)
