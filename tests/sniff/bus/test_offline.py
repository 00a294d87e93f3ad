"""Rows wait for their verdict, keep their order, and leave nothing behind: a recorder runs for weeks."""

from __future__ import annotations

from dissectors import registry
from dissectors.frame import Chunk
from sniff.engine.engine import Engine
from sniff.engine.verdict_join import REMEMBERED, JudgedRow, VerdictJoin
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import EXACT


def test_every_row_once_in_order_with_its_verdict_and_nothing_kept() -> None:
    plan = scenario("modbus-rtu-busy", seed=3)
    session, items = simulate(plan, 90, EXACT)
    engine, settling = Engine(registry.get(plan.protocol), session.timing), VerdictJoin()
    rows: list[JudgedRow] = []
    most = 0
    for item in items:
        if isinstance(item, Chunk):
            rows += settling.add(engine.feed(item))
            most = max(most, len(settling._closed))
    rows += settling.add(engine.close())
    rows += settling.flush()
    assert [each.row.no for each in rows] == list(range(1, len(rows) + 1))
    assert len(rows) > 8 * REMEMBERED
    assert all((each.transaction is None) == (each.row.placement is None) for each in rows)
    for each in rows:
        if each.transaction is not None and each.row.placement is not None:
            assert each.transaction.id == each.row.placement.tx
    assert most < 1.2 * REMEMBERED
    assert len(settling._closed) == len(settling._in_order) < 1.2 * REMEMBERED
