"""The tracker for plain protocols: what becomes of a request, in each of the ways it can go."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk, Frame, Noise, Place, Reason
from dissectors.line import MS, LineSettings, Timing
from dissectors.plain_tracker import PATIENCE, Polling
from dissectors.tracker import Announcements, Transaction, Verdict
from tests.dissectors.gong import framer, peek, seal

LATENCY = 16 * MS
TIMING = Timing(LineSettings.parse("9600,7E1"), LATENCY)
READ, READ_6, ALL, ANSWER, ANSWER_6 = (
    seal(body) for body in (b"05r07", b"06r07", b"00r07", b"05R070001", b"06R070001")
)
BROKEN = ANSWER[:-3] + b"00\r"


def heard(*talk: tuple[int, bytes], until: int = 0) -> list[Transaction]:
    """The transactions of what is said (ms, octets), in the order of closing, without what the end closes."""
    framing, tracker, closed, no = framer(TIMING), Polling(TIMING), [], 0
    for time, octets in talk:
        for event in framing.feed(Chunk(time * MS, octets)):
            no += 1
            header = peek(event) if isinstance(event, Frame) else None
            closed += tracker.track(no, event, header).closed
    closed += tracker.advance(until * MS) if until else ()
    return closed


@pytest.mark.parametrize(
    ("talk", "verdicts"),
    [
        (((100, READ), (120, ANSWER)), ["answered"]),
        (((100, READ), (120, BROKEN)), ["damaged-answer"]),
        (((100, READ), (120, b"!0zR07\r"), (400, READ_6)), ["damaged-answer"]),
        (((100, READ), (400, READ_6), (420, ANSWER_6)), ["no-response", "answered"]),
        (((100, READ), (400, READ), (420, ANSWER)), ["no-response", "retry"]),
        (((100, READ), (1900, ANSWER)), ["no-response", "late"]),
        (((100, READ), (120, ANSWER), (140, ANSWER)), ["answered", "unsolicited"]),
        (((100, READ), (120, ANSWER_6)), ["unsolicited"]),  # the one that was asked may still speak
        (((100, ALL),), ["broadcast"]),
        (((100, READ[:-3] + b"00\r"), (400, READ_6)), ["damaged-request"]),
    ],
)
def test_what_becomes_of_a_request(talk: tuple[tuple[int, bytes], ...], verdicts: list[str]) -> None:
    closed = heard(*talk)
    assert [one.verdict.value for one in closed] == verdicts
    assert len({one.id for one in closed}) == len(closed)


def test_an_answer_says_how_long_it_took_within_what_the_adapter_allows() -> None:
    (one,) = heard((100, READ), (140, ANSWER))
    assert one.latency is not None
    gap = 40 * MS - len(ANSWER) * TIMING.char
    assert (one.latency.nominal, one.latency.low, one.latency.high) == (gap, gap - LATENCY, gap + LATENCY)
    assert (one.station, one.request, one.response) == (5, 1, 2)


def test_a_repeat_names_the_first_try_and_a_late_answer_what_it_answers() -> None:
    _, retry = heard((100, READ), (400, READ), (420, ANSWER))
    assert (retry.attempt, retry.of) == (2, 1)
    _, late = heard((100, READ), (1900, ANSWER))
    assert (late.of, late.request) == (1, None)


def test_silence_is_no_answer_only_when_the_adapter_cannot_hold_one_any_more() -> None:
    patience = (PATIENCE + LATENCY) // MS
    assert heard((100, READ), until=100 + patience) == []
    assert [one.verdict for one in heard((100, READ), until=101 + patience)] == [Verdict.NO_RESPONSE]


def test_the_end_leaves_a_request_open_and_noise_is_placed_nowhere() -> None:
    tracker = Polling(TIMING)
    (event,) = framer(TIMING).feed(Chunk(100 * MS, READ))
    assert isinstance(event, Frame)
    tracker.track(1, event, peek(event))
    assert tracker.track(2, Noise(b"x", 200 * MS, 201 * MS, Place.BETWEEN, Reason.NO_FRAME), None).placement is None
    assert [one.verdict for one in tracker.close()] == [Verdict.OPEN]
    assert tracker.close() == ()


def test_what_is_told_to_everybody_is_a_transaction_of_its_own() -> None:
    tracker, framing = Announcements(TIMING), framer(TIMING)
    events = [event for time in (100, 200) for event in framing.feed(Chunk(time * MS, READ))]
    made = [tracker.track(no, event, peek(event)) for no, event in enumerate(events, 1) if isinstance(event, Frame)]
    assert [one.id for each in made for one in each.closed] == [1, 2]
    assert [(each.placement.no, each.placement.tx) for each in made if each.placement] == [(1, 1), (2, 2)]
    assert {one.verdict for each in made for one in each.closed} == {Verdict.DATA}
    assert tracker.track(3, Noise(b"x", 0, 1, Place.BETWEEN, Reason.NO_FRAME), None).placement is None
    assert (tracker.advance(10**12), tracker.close()) == ((), ())
