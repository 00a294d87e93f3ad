"""What is new in a ring is the same, asked for row by row while it is watched, or of many rows watched at once."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.bacnet.bulk_ring_observer import BulkRingObserver
from dissectors.bacnet.ring import order_of
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_window import Happening, MstpRingWindow, RingJournal
from dissectors.line import Timing
from sniff.engine.bulk import tables
from sniff.engine.engine import Row
from sniff.engine.table import Table, joined
from sniff.formats import read
from tests.seeds import examples

CAPTURES = Path(__file__).parents[3] / "captures"
NAMES = ("mstp-clean", "mstp-usual-faults", "mstp-noisy-ftdi")


@cache
def whole(name: str) -> tuple[Timing, Table, list[Row]]:
    capture = read(CAPTURES / f"{name}.cap.txt")
    parts = [table for table in tables(capture.blocks(), capture.session) if isinstance(table, Table) and len(table)]
    table = joined("mstp", 1, parts)
    return capture.session.timing, table, list(table.rows())


def told(windows: list[MstpRingWindow], table: Table) -> list[object]:
    stations = set(table.frames.source.tolist()) | set(table.frames.destination.tolist())
    return [(window.bus, {mac: window.of(mac) for mac in stations}) for window in windows]


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
@settings(deadline=None, max_examples=examples(20))
def test_windows_are_the_same_however_it_is_watched(name: str, data: st.DataObject) -> None:
    timing, table, rows = whole(name)
    one_by_one, many = BulkRingObserver(timing), BulkRingObserver(timing)
    places = st.lists(st.integers(0, len(table)), min_size=1, max_size=30)
    stops, cuts = sorted(data.draw(places)), sorted({0, *data.draw(places), len(table)})
    ends = [max((row.event.end for row in rows[:stop]), default=0) for stop in stops]
    expected: list[MstpRingWindow] = []
    one_by_one.windows([])
    at = 0
    for stop, end in zip(stops, ends, strict=True):
        for row in rows[at:stop]:
            one_by_one.see(row.no, row.event, row.header)
        at = stop
        expected += one_by_one.windows([(table.first + stop, end)])
    many.windows([])
    made: list[MstpRingWindow] = []
    left = list(zip(stops, ends, strict=True))
    for begin, beyond in pairwise(cuts):
        many.take(table.part(begin, beyond))
        now = [(table.first + stop, end) for stop, end in left if stop <= beyond]
        left = left[len(now) :]
        made += many.windows(now)
    assert told(made, table) == told(expected, table)


@pytest.mark.parametrize("name", NAMES)
def test_windows_add_up_to_the_ring(name: str) -> None:
    timing, table, _ = whole(name)
    observer = BulkRingObserver(timing)
    observer.windows([])
    observer.take(table)
    ring = observer.ring()
    stops = [(table.first + place, int(table.frames.end[place - 1])) for place in range(100, len(table), 100)]
    windows = [*observer.windows(stops), observer.window()]
    bus = [window.bus for window in windows]
    assert sum(int(one["tokens"]) for one in bus) == sum(edge.tokens for edge in ring.edges.values()) > 0
    assert sum(int(one["token_retries"]) for one in bus) == sum(edge.retries for edge in ring.edges.values())
    lost = sum(one.count for (what, _), one in ring.happened.items() if what is RingEventKind.LOST_TOKEN)
    assert sum(int(one["tokens_lost"]) for one in bus) == lost
    assert bus[-1]["ring_masters"] == len(ring.order)
    for mac, node in ring.nodes.items():
        assert sum(int(window.of(mac).get("tokens", 0)) for window in windows) == node.tokens_received
        assert sum(int(window.of(mac).get("polls_unanswered", 0)) for window in windows) == node.polls_unanswered
        longest = max((window.of(mac).get("loop_max_ms", 0) for window in windows), default=0)
        assert longest == (node.loop.most or 0) / 1_000_000
    assert observer.window().bus["tokens"] == 0


@pytest.mark.parametrize(
    ("newest", "order"),
    [
        ({}, ()),
        ({3: 3}, (3,)),
        ({3: 1, 1: 2, 2: 3}, (1, 2, 3)),
        ({0: 5, 5: 6, 6: 5}, (5, 6)),  # 0 has left: nobody passes it the token
        ({1: 2, 2: 1, 4: 7, 7: 9, 9: 4}, (4, 7, 9)),
        ({1: 2, 2: 1, 4: 7, 7: 4}, (1, 2)),
        ({1: 2, 2: 9}, ()),
    ],
)
def test_the_order_is_the_longest_ring(newest: dict[int, int], order: tuple[int, ...]) -> None:
    assert order_of(newest) == order


def test_times_further_apart_than_can_be_counted() -> None:
    """A damaged file may say so."""
    journal = RingJournal()
    for no, value in enumerate((-(1 << 64), 5, 1 << 64)):
        journal.note(Happening.LOOP, no, 3, value)
    (window,) = journal.windows([(3, 1 << 62)], -(1 << 62))
    assert (window.bus["loop_p50_ms"], window.bus["loop_max_ms"]) == (5 / 1_000_000, (1 << 62) / 1_000_000)
