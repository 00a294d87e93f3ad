"""Load and trouble by parts of the time: nothing is lost when parts are drawn together."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Noise, Place, Reason
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Row
from sniff.reporting.timeline import FIRST_WIDTH, MOST_PARTS, Timeline

CHAR = 1_000_000


def noise(end: int, octets: int) -> Row:
    return Row(1, Noise(b"x" * octets, end - octets * CHAR, end, Place.BETWEEN, Reason.NO_FRAME))


@given(st.lists(st.tuples(st.integers(0, 10**14), st.integers(1, 500)), min_size=1, max_size=50))
def test_every_octet_and_its_time_is_in_some_part(events: list[tuple[int, int]]) -> None:
    timeline = Timeline(CHAR)
    for end, octets in events:
        timeline.add_row(noise(end, octets))
    parts = timeline.listed()
    assert len(parts) <= MOST_PARTS
    assert sum(part.noise for part in parts) == sum(octets for _, octets in events)
    assert sum(part.busy for part in parts) == sum(octets * CHAR for _, octets in events)
    assert timeline.width % FIRST_WIDTH == 0


def test_an_octet_run_over_an_edge_is_shared() -> None:
    timeline = Timeline(CHAR)
    timeline.add_row(noise(FIRST_WIDTH + 30 * CHAR, 50))
    assert [part.busy for part in timeline.listed()] == [20 * CHAR, 30 * CHAR]


def test_trouble_stands_where_the_exchange_began() -> None:
    timeline = Timeline(CHAR)
    for verdict in Verdict:
        start = 1000 + FIRST_WIDTH
        timeline.add_transaction(Transaction(1, 1, "read", 1, None, verdict, start, start))
    (part,) = timeline.listed()
    assert (timeline.origin, part.failed, part.exceptions) == (FIRST_WIDTH, 4, 1)
