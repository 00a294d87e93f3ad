"""What nobody heard is neither silence nor a pause: holes of a capture, and what is told of the time beside them."""

from __future__ import annotations

import numpy as np
import pytest

from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.line import LineSettings
from sniff.analysis.holes import Holes
from sniff.analysis.line_use import LineUse
from sniff.analysis.load import Load
from sniff.engine.engine import Output, Row
from sniff.engine.session import LineEvent, LineEventKind
from sniff.engine.table import Table

LINE = LineSettings.parse("9600,8E1")
S = 1_000_000_000
OCTETS = 100
LASTS = OCTETS * LINE.char
UNPLUGGED, REPLUGGED = LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED
DROPPED, OMITTED = LineEventKind.DROPPED, LineEventKind.OMITTED

Item = Row | LineEvent


def row(no: int, end: int) -> Row:
    return Row(no, Frame("modbus-rtu", bytes(OCTETS), end - LASTS, end, Check.GOOD, FoundBy.GAP))


def heard(items: list[Item], columns: bool) -> Load:
    load = Load(LINE)
    held: list[Row] = []
    for item in [*items, None]:
        if isinstance(item, Row):
            held.append(item)
            continue
        if columns and held:
            load.add_table(Table.of_outputs("modbus-rtu", held[0].no, [Output(tuple(held))]))
        else:
            for one in held:
                load.add(one)
        held = []
        if item is not None:
            load.add_line_event(item)
    return load


def with_hole(*events: LineEvent) -> list[Item]:
    """Ten rows, one a second, as many behind a hole of a hundred seconds."""
    rows = [row(no, no * S) for no in range(1, 11)] + [row(no, (no + 100) * S) for no in range(11, 21)]
    return [*rows[:10], *events, *rows[10:]]


def without_hole() -> list[Item]:
    return [row(no, no * S) for no in range(1, 21)]


HOLES: dict[str, tuple[LineEvent, ...]] = {
    "a port that was away": (LineEvent(10 * S + 1, UNPLUGGED), LineEvent(111 * S - LASTS - 1, REPLUGGED)),
    "a port that does not say when it came back": (LineEvent(10 * S + 1, UNPLUGGED),),
    "not triggered": (LineEvent(111 * S, OMITTED, "", 5000),),
    "not written": (LineEvent(111 * S, DROPPED, "", -1),),
    "twice": (LineEvent(30 * S, DROPPED, "", -1), LineEvent(111 * S, DROPPED, "", -1)),
}


@pytest.mark.parametrize("columns", [False, True])
@pytest.mark.parametrize("of", HOLES)
def test_load_is_that_of_the_time_heard(of: str, columns: bool) -> None:
    load, usual = heard(with_hole(*HOLES[of]), columns), heard(without_hole(), columns)
    assert load.overall() == pytest.approx(usual.overall(), rel=0.06)
    assert load.heard_of(0, 10 * S) == usual.heard_of(0, 10 * S)
    assert load.heard_of(11 * S, 110 * S) == 0
    assert load.share() == pytest.approx(usual.share(), rel=0.2)


def test_lost_octets_that_were_counted_are_load() -> None:
    load = heard(with_hole(LineEvent(111 * S, DROPPED, "", 100 * OCTETS)), columns=False)
    assert load.overall() == pytest.approx(heard(without_hole(), columns=False).overall(), rel=0.06)
    assert load.holes.total == load.holes.counted == 100 * LASTS - LASTS  # a row begins while they come


def test_rows_that_a_hole_ended_may_come_behind_it() -> None:
    items = with_hole()
    items.insert(8, LineEvent(10 * S + 1, DROPPED, "", -1))
    for columns in (False, True):
        assert heard(items, columns).holes.ends == [10 * S + 1]


def test_a_port_that_is_away_says_nothing_of_now() -> None:
    load = heard([*with_hole()[:10], LineEvent(10 * S, UNPLUGGED)], columns=False)
    assert load.share(now=14 * S) == pytest.approx(load.share())


@pytest.mark.parametrize("cut", range(24))
def test_parts_make_the_same_holes(cut: int) -> None:
    items = with_hole(*HOLES["a port that was away"])
    parts = heard(items[:cut], False).merge(heard(items[cut:], True))
    if cut != 11:  # who begins with a port that is back does not know when it went
        assert parts.holes == heard(items, False).holes
    assert parts.overall() == pytest.approx(heard(items, False).overall())


def test_requests_around_a_hole_are_told_from_others() -> None:
    holes = heard(with_hole(LineEvent(111 * S, OMITTED)), False).holes
    starts = np.array([no * S - LASTS for no in (8, 9, 10, 111, 112)], np.int64)
    apart = [holes.lie_between(begin, end) for begin, end in zip(starts.tolist(), starts[1:].tolist(), strict=False)]
    assert apart == [False, False, True, False]
    assert holes.are_between(starts[:-1], starts[1:]).tolist() == apart
    assert Holes().are_between(starts[:-1], starts[1:]).tolist() == [False] * 4


@pytest.mark.parametrize("columns", [False, True])
def test_broadcasts_take_their_share_of_the_time_heard(columns: bool) -> None:
    use, some = LineUse(LINE), with_hole(*HOLES["a port that was away"])
    rows = [item for item in some if isinstance(item, Row)]
    use.see(1, rows[0].event, Role.BROADCAST)
    for begin, end in ((1, 10), (10, 20)):
        if columns:
            table = Table.of_outputs("modbus-rtu", begin + 1, [Output(tuple(rows[begin:end]))])
            use.take(table, np.arange(end - begin))
        else:
            for one in rows[begin:end]:
                use.see(one.no, one.event, Role.BROADCAST)
        for event in HOLES["a port that was away"] if end == 10 else ():
            use.add_line_event(event)
    use._broadcast.count += 20  # many enough to be told
    (told,) = use.findings()
    assert told.seen == "40 broadcasts, 100% of all octets, 13% of all time, 2.2 a second"
