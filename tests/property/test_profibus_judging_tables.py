"""The rules and the watch of a PROFIBUS line remember the same from columns as from rows, whatever happens on it."""

from __future__ import annotations

import random
from typing import Any

import pytest

from dissectors import stretches
from dissectors.profibus.bulk_watch import BulkBusWatch
from dissectors.profibus.judging_columns import BulkProfibusFindings
from dissectors.row_columns import in_turn
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.session import Session
from sniff.engine.table import Table
from tests.property.judge_memory import memory
from tests.property.profibus_buses import TROUBLES, bus
from tests.property.test_judging_tables import cut
from tests.seeds import seeds


def in_any_order(value: Any) -> Any:
    """Stations are asked for by address: who was seen first says nothing."""
    if isinstance(value, list | tuple):
        return sorted((in_any_order(one) for one in value), key=repr)
    return value


def assert_alike(seed: int, turns: int, troubles: tuple[str, ...], share: float) -> None:
    session, chunks = bus(seed, turns, troubles, share)
    made = [one for one in tables(blocks_of(chunks), session) if isinstance(one, Table)]
    judge, watch = BulkProfibusFindings(session.timing), BulkBusWatch(session.timing)
    for table in made:
        in_turn(judge, table)
        for place in range(len(table)):
            row = table.row(place)
            watch.see(row.no, row.event, row.header)
    dice, expected, watched = random.Random(seed), in_any_order(memory(judge)), in_any_order(memory(watch))
    for most in (1 << 30, stretches.LEAST + 8):
        by_columns, bulk_watch = BulkProfibusFindings(session.timing), BulkBusWatch(session.timing)
        for table in made:
            for part in cut(table, dice, most):
                by_columns.take(part)
                bulk_watch.take(part)
        assert in_any_order(memory(bulk_watch)) == watched
        assert in_any_order(memory(by_columns)) == expected
        assert by_columns.findings() == judge.findings()
        assert by_columns.ring() == judge.ring() == bulk_watch.ring()


@pytest.mark.parametrize("share", [0.02, 0.3])
@pytest.mark.parametrize("seed", seeds(8))
def test_what_is_remembered_is_the_same_wherever_tables_are_cut(seed: int, share: float) -> None:
    assert_alike(seed, 120, TROUBLES, share)


@pytest.mark.parametrize("trouble", TROUBLES)
def test_each_trouble_alone_leaves_the_same(trouble: str) -> None:
    assert_alike(99, 60, (trouble,), 0.1)


def test_of_a_quiet_line_few_rows_become_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    session, chunks = bus(3, 300, ())
    session = Session("x", session.line, "profibus")
    made = [one for one in tables(blocks_of(chunks), session) if isinstance(one, Table)]
    looked_at: list[int] = []
    view = Table.row
    monkeypatch.setattr(Table, "row", lambda table, place: looked_at.append(place) or view(table, place))
    judge = BulkProfibusFindings(session.timing)
    for table in made:
        judge.take(table)
    assert len(looked_at) < 40
