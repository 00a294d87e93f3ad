"""Freeze, marks and filter apart from any screen."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import pytest

from sniff.bus.rows import Store
from sniff.engine.session import NO_TIMES, LineEvent, LineEventKind
from sniff.filter import FilterError
from sniff.tui.times import clock
from sniff.tui.view_state import Viewing


def test_freeze_stops_the_view_and_counts(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store)
    viewing.freeze(True)
    shown = (viewing.last_row, viewing.last_closed)
    busy_bus.ask(1)
    busy_bus.noise()
    assert (viewing.last_row, viewing.last_closed) == shown == (13, 6)
    assert viewing.came_since == 3
    viewing.freeze(False)
    assert (viewing.last_row, viewing.last_closed, viewing.came_since) == (16, 7, 0)


def test_a_filter_of_time_where_nothing_has_any(busy_bus: Any) -> None:
    known = busy_bus.store.session
    timeless = replace(known, adapter=replace(known.adapter, latency_from=NO_TIMES))
    store = Store(timeless, busy_bus.store.dissector)
    viewing = Viewing(store)
    with pytest.raises(FilterError, match="does not say when anything came"):
        viewing.set_filter('frame.time > "10:02"')
    viewing.colour_rules({"red": "latency_ms > 5ms"})  # a saved one is for other captures, too
    assert viewing.colour_of(busy_bus.store.by_no(1), None) == ""


def test_times_are_those_that_the_lists_show(busy_bus: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "XST-5:30")
    time.tzset()
    viewing, begin = Viewing(busy_bus.store), busy_bus.store.by_no(1).event.start
    assert clock(begin) == "15:30:00.000"
    for text in ('frame.time == "15:30:00.000"', 'frame.time == "2026-03-01 15:30:00.000"'):
        viewing.set_filter(text)
        assert [no for no in range(1, 14) if viewing.accepts_row(no)] == [1]
    assert ('"15:30:00"', 13) in viewing.counts("frame.time")
    viewing.set_filter('frame.time == "2026-03-01T10:00:00.000Z"')
    assert viewing.accepts_row(1)


def test_marks_go_round(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store)
    assert viewing.next_mark() is None
    begins = {no: busy_bus.store.by_no(no).event.start for no in (3, 9)}
    for no in (9, 3):
        busy_bus.store.add_mark(LineEvent(begins[no], LineEventKind.MARK, f"row {no}"))
    assert viewing.take_marks()
    assert not viewing.take_marks()
    assert viewing.marks == {3: "row 3", 9: "row 9"}
    viewing.row = 3
    assert viewing.next_mark() == 9
    viewing.row = 9
    assert viewing.next_mark() == 3
    late = LineEvent(begins[3] + 10**12, LineEventKind.UNMARK, count=10**12)  # of a live bus: said long after
    busy_bus.store.add_mark(late)
    viewing.take_marks()
    assert viewing.next_mark() == 9


def test_a_mark_waits_for_its_row(make_bus: Any) -> None:
    bus = make_bus()
    viewing = Viewing(bus.store)
    bus.store.add_mark(LineEvent(bus.now, LineEventKind.MARK, "here"))
    assert not viewing.take_marks()
    bus.ask(1)
    assert viewing.take_marks()
    assert viewing.marks == {1: "here"}


def test_marks_of_dropped_rows_are_passed_over(make_bus: Any) -> None:
    bus = make_bus(keep=20)
    bus.ask(1)
    viewing = Viewing(bus.store)
    viewing.marks[1] = ""
    for _ in range(20):
        bus.ask(1)
    assert bus.store.first_no > 1
    assert viewing.next_mark() is None


def test_filter_on_rows_and_transactions(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store)
    viewing.set_filter("verdict == no-response || noise")
    assert [no for no in range(1, 14) if viewing.accepts_row(no)] == [5, 6]
    assert [no for no in range(1, 8) if viewing.accepts_closed(no)] == [3]
    assert not viewing.accepts_row(99)
    assert not viewing.accepts_closed(99)


def test_a_bad_filter_changes_nothing(busy_bus: Any) -> None:
    viewing = Viewing(busy_bus.store)
    viewing.set_filter(" dst == 1 ")
    version = viewing.filter_version
    with pytest.raises(FilterError):
        viewing.set_filter("dst ==")
    assert (viewing.filter, viewing.filter_version) == ("dst == 1", version)
