"""The rules of an N2 bus remember the same from columns as from rows, whatever happens on it."""

from __future__ import annotations

import random

import pytest

from dissectors import stretches
from dissectors.n2.judging_columns import BulkN2Findings
from dissectors.row_columns import in_turn
from sniff.engine.blocks import Block
from sniff.engine.bulk import tables
from sniff.engine.table import Table
from tests.property.judge_memory import memory
from tests.property.n2_buses import TROUBLES, bus
from tests.property.test_judging_tables import cut
from tests.seeds import seeds


@pytest.mark.parametrize("seed", seeds(16, 6))
def test_what_is_remembered_is_the_same_wherever_tables_are_cut(seed: int) -> None:
    session, reads = bus(seed, exchanges=500)
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    by_rows = BulkN2Findings(session.timing)
    for table in made:
        in_turn(by_rows, table)
    dice, expected = random.Random(seed), memory(by_rows)
    for most in (1 << 30, 200, stretches.LEAST + 8):
        by_columns = BulkN2Findings(session.timing)
        for table in made:
            for part in cut(table, dice, most):
                by_columns.take(part)
        assert memory(by_columns) == expected
        assert by_columns.findings() == by_rows.findings()


@pytest.mark.parametrize("trouble", TROUBLES)
def test_each_trouble_alone_leaves_the_same(trouble: str) -> None:
    session, reads = bus(99, exchanges=300, troubles=(trouble,))
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    by_rows, by_columns = BulkN2Findings(session.timing), BulkN2Findings(session.timing)
    for table in made:
        in_turn(by_rows, table)
        by_columns.take(table)
    assert memory(by_columns) == memory(by_rows)
    assert by_columns.findings() == by_rows.findings()


def test_of_a_quiet_bus_few_rows_become_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    session, reads = bus(3, exchanges=400, troubles=())
    looked_at: list[int] = []
    view = Table.row
    made = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    commands = sum(int((table.frames.destination >= 0).sum()) for table in made)
    changing = sum(
        table.frames.names[kind] in ("identify", "override", "release-override")
        for table in made
        for kind in table.frames.kind.tolist()
    )
    monkeypatch.setattr(Table, "row", lambda table, place: looked_at.append(place) or view(table, place))
    judge = BulkN2Findings(session.timing)
    for table in made:
        judge.take(table)
    assert len(looked_at) < changing + 10
    assert judge.master.frames == commands == 400
