"""A log without times: what its octets take on the line stands for times, and proves nothing of waits or shares."""

from __future__ import annotations

from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.tracker import Verdict
from tests.dissectors.bacnet.ring_script import Step, data, found, poll, rounds, script, token

READ = "010400030 10c0c020004d2194d".replace(" ", "")
PAUSE = 18.0  # ms, as a log without times is laid out
LATENCY = 50


def _timeless(steps: list[Step]) -> list[Step]:
    return [(PAUSE, octets) for _, octets in steps]


def test_a_station_that_is_off_is_not_taken_for_one_that_the_tap_does_not_hear():
    """Whoever asked went on at once, or after 300 ms: the log does not say."""
    steps = rounds(5, 1, 5)
    for _ in range(6):
        steps += [(2, data(1, 7, READ, expects=True)), (262, token(1, 5)), (2, token(5, 1))]
    read = script(_timeless(steps), LATENCY, has_times=False)
    assert read.graves() == {("MS301", "1 → 7")}
    assert script(_timeless(steps), LATENCY).graves() == {("MS406", "MAC 7")}


def test_who_polls_out_of_turn_may_have_made_the_token_anew():
    steps: list[Step] = []
    for _ in range(4):
        steps += [*rounds(8, 1, 5, 9), (2, token(1, 5)), (2, token(5, 9)), (515, poll(1, 2)), (25, poll(1, 3))]
        steps += [(25, poll(1, 5)), (3, found(5, 1)), (2, token(1, 5)), (2, token(5, 9)), (2, token(9, 1))]
    read = script(_timeless(steps), LATENCY, has_times=False)
    assert not read.graves()
    assert not any(what is RingEventKind.UNHEARD for what, _ in read.ring.happened)


def test_no_shares_of_time_and_no_durations_are_told():
    """Three stations that poll with every third token."""
    steps: list[Step] = []
    for at in range(300):
        steps += [(2, token(1, 5)), (2, token(5, 9))]
        steps += [(2, poll(9, 10 + at % 20)), (25, token(9, 1))] if at % 3 == 0 else [(2, token(9, 1))]
    told = script(_timeless(steps), LATENCY).of("MS201").seen
    assert "of the time" in told
    untold = script(_timeless(steps), LATENCY, has_times=False)
    assert "of the time" not in untold.of("MS201").seen
    assert not any(one.code in ("MS108", "MS601", "MS603") for one in untold.findings)


def test_an_answer_that_fills_a_long_line_is_not_late():
    """A log lays its lines further apart than their octets last: 0.8 s for an extended frame."""
    answer = npdu_frame(1, 7, bytes.fromhex("010030010c0c020004d2191c3e75fe02bc00") + bytes(700) + b"\x3f", False)
    steps = rounds(5, 1, 7)
    for _ in range(6):
        steps += [(20, data(1, 7, READ, expects=True)), (650, answer), (20, token(1, 7)), (20, token(7, 1))]
    read = script(steps, 850, has_times=False)
    assert [one.verdict for one in read.transactions if one.kind == "read-property"] == [Verdict.ANSWERED] * 6
