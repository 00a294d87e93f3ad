"""What the store counts for the screens, and that dropping old rows loses nothing else."""

from __future__ import annotations

from typing import Any

from dissectors.frame import LineError, Mark, Role
from dissectors.tracker import Passing, Transaction, Verdict
from sniff.bus.trouble import is_trouble
from sniff.engine.engine import Output


def test_numbers_of_rows_and_closings(busy_bus: Any) -> None:
    store = busy_bus.store
    assert (store.first_no, store.last_no, store.last_closed) == (1, 13, 6)
    assert [store.closed_by_no(no).id for no in range(1, 7)] == [1, 2, 3, 4, 5, 6]
    assert store.closed_by_no(0) is None
    assert store.closed_by_no(7) is None
    assert store.closed_number(4) == 4
    assert store.closed_number(7) is None


def test_totals_survive_dropping(make_bus: Any) -> None:
    bus = make_bus(keep=50)
    for _ in range(40):
        bus.ask(1)
        bus.ask(2, Verdict.NO_RESPONSE)
        bus.noise(b"\x00", (Mark(0, LineError.BREAK),))
    store = bus.store
    assert store.dropped_rows == 160 - len(store)
    assert 50 <= len(store) <= 55
    assert (store.first_no, store.last_no) == (store.dropped_rows + 1, 160)
    assert store.error_total == 80
    assert len(store.errors) < 40
    assert min(store.errors) >= store.first_no
    assert store.marks[LineError.BREAK] == 40
    assert store.gaps.count == 159
    assert store.load.total.frames == 120


def test_dropped_transactions_keep_the_numbers_of_the_others(make_bus: Any) -> None:
    bus = make_bus(keep=50)
    for _ in range(100):
        bus.ask(1)
    store = bus.store
    assert store.last_closed == 100
    assert store.dropped_transactions > 50
    assert store.closed_by_no(store.dropped_transactions) is None
    first = store.dropped_transactions + 1
    assert store.closed_by_no(first - 1) is None
    for no in range(first, 101):
        assert store.closed_by_no(no).id == no
        assert store.closed_number(no) == no
    for row in store.rows[2:]:
        assert store.transaction(row) is not None


def test_gaps_are_the_silences_between_rows(make_bus: Any) -> None:
    bus = make_bus()
    for _ in range(3):
        bus.ask(1, latency=7)
    assert bus.store.gaps.spread([5_000_000, 10_000_000, 50_000_000]) == [0, 3, 2, 0]


def test_looking_for_a_master_where_there_is_none_is_no_trouble(make_bus: Any) -> None:
    bus = make_bus()
    for kind, trouble in ((Passing.STATUS, 0), (Passing.POLL, 0), (Passing.TOKEN, 1), ("read", 2)):
        row = bus.row(bus.frame(b"\x01\x03\x00"), bus.tx + 1, Role.REQUEST)
        bus.tx += 1
        closed = Transaction(bus.tx, 1, kind, row.no, None, Verdict.NO_RESPONSE, row.event.start, row.event.end)
        bus.store.add(Output((row,), (closed,)))
        assert bus.store.error_total == trouble
        assert is_trouble(closed) == (kind not in (Passing.STATUS, Passing.POLL))
