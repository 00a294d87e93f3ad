"""The rules of a Modbus line remember the same from columns as from rows, whatever happens on it."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from dissectors import stretches
from dissectors.modbus.judging_columns import BulkModbusFindings
from dissectors.row_columns import in_turn
from sniff.engine.blocks import Block
from sniff.engine.bulk import tables
from sniff.engine.table import Table
from tests.property.judge_memory import memory
from tests.property.modbus_buses import TROUBLES, bus
from tests.property.test_judging_tables import cut
from tests.seeds import seeds


@pytest.mark.parametrize("is_ascii", [False, True], ids=["rtu", "ascii"])
@pytest.mark.parametrize("seed", seeds(12, 5))
def test_what_is_remembered_is_the_same_wherever_tables_are_cut(seed: int, is_ascii: bool) -> None:
    session, reads = bus(seed, is_ascii, exchanges=500)
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    by_rows = BulkModbusFindings(session.timing)
    for table in made:
        in_turn(by_rows, table)
    dice, expected = random.Random(seed), memory(by_rows)
    found = by_rows.findings()
    for most in (1 << 30, 200, stretches.LEAST + 8):
        by_columns = BulkModbusFindings(session.timing)
        for table in made:
            for part in cut(table, dice, most):
                by_columns.take(part)
        assert memory(by_columns) == expected
        assert by_columns.findings() == found


@pytest.mark.parametrize("trouble", TROUBLES)
def test_each_trouble_alone_leaves_the_same(trouble: str) -> None:
    session, reads = bus(99, trouble == "bare", exchanges=300, troubles=(trouble,))
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    by_rows, by_columns = BulkModbusFindings(session.timing), BulkModbusFindings(session.timing)
    for table in made:
        in_turn(by_rows, table)
        by_columns.take(table)
    assert memory(by_columns) == memory(by_rows)
    assert by_columns.findings() == by_rows.findings()


@pytest.mark.parametrize("trouble", ["silent", "repeat", "unasked"])
def test_long_silences_anywhere_leave_the_same(trouble: str) -> None:
    session, reads = bus(5, exchanges=300, troubles=(trouble,))
    part = np.arange(len(reads)) // 40
    reads = replace(reads, times=reads.times + part * (part + 1) * 2_000_000_000)  # 4, 8, 12 … s
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    by_rows, by_columns = BulkModbusFindings(session.timing), BulkModbusFindings(session.timing)
    for table in made:
        in_turn(by_rows, table)
        by_columns.take(table)
    assert memory(by_columns) == memory(by_rows)
    assert by_columns.findings() == by_rows.findings()


def test_a_second_answer_is_compared_with_a_first_that_went_by_columns() -> None:
    session, reads = bus(7, exchanges=600, troubles=("twice",))
    judge = BulkModbusFindings(session.timing)
    for table in tables([Block(reads)], session):
        if isinstance(table, Table):
            judge.take(table)
    stations = [one for one in judge.seen.stations.values() if one.twice.count]
    assert [(one.twice.count, one.same_twice) for one in stations] == [(1, 0)]  # two that say different things


def test_of_a_quiet_bus_no_row_becomes_an_object_but_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    session, reads = bus(3, exchanges=400, troubles=())
    looked_at: list[int] = []
    view = Table.row
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    monkeypatch.setattr(Table, "row", lambda table, place: looked_at.append(place) or view(table, place))
    judge = BulkModbusFindings(session.timing)
    for table in made:
        judge.take(table)
    assert len(looked_at) < 10
    assert judge.seen.answers > 390


def test_exchanges_within_one_instant_leave_the_same() -> None:
    """Of times in steps an answer may end when its request begins: that is a turn, too."""
    session, reads = bus(3, exchanges=150, troubles=())
    reads = replace(reads, times=-(-reads.times // 300_000_000) * 300_000_000)
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    by_rows, by_columns = BulkModbusFindings(session.timing), BulkModbusFindings(session.timing)
    for table in made:
        in_turn(by_rows, table)
        by_columns.take(table)
    assert any(not answer for _, answer in by_rows.seen.rhythm.turns)
    assert memory(by_columns) == memory(by_rows)
