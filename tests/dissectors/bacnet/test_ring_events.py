"""What happened, counted: what is said of all of it holds beyond the events that are kept."""

from __future__ import annotations

from functools import reduce

from hypothesis import given
from hypothesis import strategies as st

from dissectors.bacnet.findings import judge
from dissectors.bacnet.limits import T_ALL_SILENT
from dissectors.bacnet.ring import Edge, Ring
from dissectors.bacnet.ring_events import EVENTS_MAX, Happened, RingEvent, RingEventKind
from dissectors.bacnet.ring_remarks import of
from tests.dissectors.bacnet.ring_script import MS

LOST, TWO, NO_REPLY = RingEventKind.LOST_TOKEN, RingEventKind.TWO_TOKENS, RingEventKind.NO_REPLY


def happened(what: RingEventKind, mac: int | None, *others_and_values: tuple[int | None, int | None]) -> Happened:
    events = [RingEvent(what, 10 * no, no, mac, *each) for no, each in enumerate(others_and_values, 1)]
    return reduce(Happened.add, events, Happened())


EVENTS = st.lists(st.tuples(st.sampled_from((None, 3, 4)), st.one_of(st.none(), st.integers(0, 9))), max_size=80)


@given(EVENTS, st.integers(0, 80))
def test_it_counts_all_and_keeps_the_first(events: list[tuple[int | None, int | None]], cut: int) -> None:
    whole = happened(LOST, 5, *events)
    assert whole.count == len(events) == sum(whole.others.values())
    assert len(whole.events) == min(len(events), EVENTS_MAX)
    assert whole.parties == tuple(sorted({other for other, _ in events if other is not None}))
    if events:
        values = [value or 0 for _, value in events]
        assert (whole.least, whole.most) == (min(values), max(values))
        assert (whole.first, whole.last) == (10, 10 * len(events))
    first, second = happened(LOST, 5, *events[:cut]), Happened()
    for event in happened(LOST, 5, *events).events[cut:]:
        second = second.add(event)
    if len(events) <= EVENTS_MAX:
        assert first.merge(second) == whole


def test_what_is_taken_back_is_nobodys_any_more() -> None:
    both = happened(NO_REPLY, 5, (3, None), (4, None), (3, None))
    assert both.parties == (3, 4)
    left = both.without(2, 4)
    assert (left.count, left.parties, [event.no for event in left.events]) == (2, (3,), [1, 3])


def test_a_pair_is_one_only_where_all_are_of_the_same_other() -> None:
    often = [(3, None)] * 40
    assert of("MS301", 5, "", happened(NO_REPLY, 5, *often), pair=True).finding.subject == "3 → 5"
    assert of("MS301", 5, "", happened(NO_REPLY, 5, *often, (4, None)), pair=True).finding.subject == "MAC 5"
    assert of("MS301", 5, "", happened(NO_REPLY, 5, *often, (None, None)), pair=True).finding.subject == "MAC 5"


def test_the_longest_silence_and_who_ended_it_are_of_all() -> None:
    short = [(3, 520 * MS)] * 40
    ring = Ring(happened={(LOST, None): happened(LOST, None, *short, (9, 1900 * MS))})
    (lost,) = judge(ring)
    assert "41 times" in lost.seen
    assert "silence up to 1.90 s; begun anew by MAC 3, 9" in lost.seen
    assert "all stations were silent together" not in lost.seen
    ring = Ring(happened={(LOST, None): happened(LOST, None, *[(3, T_ALL_SILENT)] * 40, (9, 520 * MS))})
    (lost,) = judge(ring)
    assert "; or all stations were silent together" in lost.seen


def test_all_that_sent_beside_the_token_are_named() -> None:
    second = {(TWO, mac): happened(TWO, mac, *[(5, None)] * 40) for mac in (3, 9)}
    ring = Ring(frames=5000, edges={(3, 9): Edge(500)}, happened=second)
    (told,) = (one for one in judge(ring) if one.code == "MS104")
    assert told.seen == "MAC 3, 9 sent 80 times while another one had the token"
