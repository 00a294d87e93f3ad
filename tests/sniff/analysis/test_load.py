"""The load of a bus by second, where one frame takes several."""

from __future__ import annotations

import numpy as np
import pytest

from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.line import LineSettings
from sniff.analysis.line_use import LineUse
from sniff.analysis.load import Load
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent, LineEventKind
from sniff.engine.table import Table

SLOW = LineSettings.parse("1200,8E1")
S = 1_000_000_000
OCTETS = 360  # of 11 bits: 3.3 s


def rows(count: int, every: int) -> list[Row]:
    """Frames that long, from 10.5 s on."""
    made = []
    for no in range(1, count + 1):
        start = 10 * S + S // 2 + (no - 1) * every
        end = start + OCTETS * SLOW.char
        made.append(Row(no, Frame("modbus-rtu", bytes(OCTETS), start, end, Check.GOOD, FoundBy.GAP)))
    return made


@pytest.mark.parametrize("columns", [False, True])
def test_a_frame_of_several_seconds_is_the_load_of_each(columns: bool) -> None:
    load = Load(SLOW)
    some = rows(1, S)
    if columns:
        load.add_table(Table.of_outputs("modbus-rtu", 1, [Output(tuple(some))]))
    else:
        load.add(some[0])
    shares = [load.share_of(load.seconds[at], at * S, (at + 1) * S) for at in sorted(load.seconds)]
    assert sorted(load.seconds) == [10, 11, 12, 13]
    assert shares == pytest.approx([1, 1, 1, 1], abs=1e-6)
    assert load.seconds[13].busy + load.seconds[10].busy == OCTETS * SLOW.char - 2 * S


@pytest.mark.parametrize("columns", [False, True])
def test_no_ten_seconds_are_fuller_than_full(columns: bool) -> None:
    use, some = LineUse(SLOW), rows(14, 3_400_000_000)
    use.see(1, some[0].event, Role.REQUEST)
    if columns:
        use.take(Table.of_outputs("modbus-rtu", 2, [Output(tuple(some[1:]))]), np.zeros(0, np.int64))
    else:
        for row in some[1:]:
            use.see(row.no, row.event, Role.REQUEST)
    (full,) = use.findings()
    assert full.seen == "octets on the line in 97% of 30 s at the busiest, 97% of all time"


def test_a_bus_that_falls_silent_is_not_as_busy_as_it_was() -> None:
    load = Load(SLOW)
    for row in rows(6, 4 * S):
        load.add(row)
    assert load.last is not None
    busy = load.share()
    assert busy > 0.8
    assert load.share(now=load.last + S // 2) == busy  # more may be on its way
    assert load.share(now=load.last + 5 * S) < 0.6
    assert load.share(now=load.last + 20 * S) == 0
    assert load.share(now=load.last - 20 * S) == busy


def test_a_chart_shows_no_load_where_nobody_heard_the_bus() -> None:
    load = Load(SLOW)
    early, late = rows(2, 50 * S)
    load.add(early)
    load.add_line_event(LineEvent(55 * S, LineEventKind.OMITTED))
    load.add(late)
    drawn = [load.drawn(S, at * S, (at + 10) * S) for at in range(0, 70, 10)]
    assert [value and round(value, 2) for value in drawn] == [0.1, 0.26, None, None, None, 0.2, 0.1]
