"""Rows wait for their verdict, keep their order, and leave nothing behind: a recorder runs for weeks."""

from __future__ import annotations

import pytest

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from sniff.analysis import point_reader
from sniff.bus.offline import settled
from sniff.engine.engine import Engine
from sniff.engine.session import NO_TIMES, Adapter, Session
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


def test_what_many_exchanges_in_one_read_mean_is_asked_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """The request of an answer is forgotten some exchanges later, which may all be in the same read."""
    monkeypatch.setattr(point_reader, "MOST_ASKED", 1)
    exchange = bytes.fromhex("01 03 00 00 00 01 84 0A  01 03 02 00 07 F9 86")
    session = Session("x", LineSettings.parse("9600,8N1"), "modbus-rtu", adapter=Adapter(latency_from=NO_TIMES))
    judged = settled([Chunk(10**9, 3 * exchange)], session, Devices())
    values = [len(one.meaning.readings) for one in judged if one.meaning is not None]
    assert values == [0, 1, 0, 1, 0, 1]
