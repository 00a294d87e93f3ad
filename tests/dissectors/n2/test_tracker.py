"""Pairing by order: who answered what, and how a lost, late or double answer is told."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Check, Chunk, Damage, FoundBy, Frame, Noise, Place, Reason, Role
from dissectors.line import Timing
from dissectors.n2 import N2Framer, N2Tracker, peek
from dissectors.n2.commands import parse_command
from dissectors.n2.forms import fits
from dissectors.n2.framing import judge
from dissectors.n2.tracker import GIVE_UP
from dissectors.tracker import Tracked, Transaction, Verdict

relaxed = settings(deadline=None)
MS = 1_000_000
TIMING = Timing()
READ, READ_OTHER, POLL = b">0111010387\r", b">1011010387\r", b">0104C5\r"
WRITE = b">012602FFF633\r"
VALUE, ACK = b"A0042910000F0\r", b"A\r"


class Bus:
    """Frames on a clock, straight into a tracker."""

    def __init__(self, timing: Timing = TIMING) -> None:
        self.tracker = N2Tracker(timing)
        self.now, self.no = 10**18, 0
        self.closed: list[Transaction] = []

    def say(self, octets: bytes, after: int = 10 * MS, damage: Damage | None = None) -> Tracked:
        """A frame that begins `after` ns after the end of the one before."""
        start = self.now + after
        self.now = start + len(octets) * TIMING.char
        self.no += 1
        check, judged = judge(octets)
        frame = Frame("n2", octets, start, self.now, check, FoundBy.DELIMITER, damage or judged)
        return self._take(self.tracker.track(self.no, frame, peek(frame)))

    def noise(self, octets: bytes, reason: Reason = Reason.NO_DELIMITER) -> Tracked:
        start = self.now + 10 * MS
        self.now = start + len(octets) * TIMING.char
        self.no += 1
        return self._take(self.tracker.track(self.no, Noise(octets, start, self.now, Place.BETWEEN, reason), None))

    def _take(self, tracked: Tracked) -> Tracked:
        self.closed += tracked.closed
        return tracked

    def end(self) -> list[Transaction]:
        self.closed += self.tracker.close()
        return self.closed

    def verdicts(self) -> list[Verdict]:
        return [t.verdict for t in self.end()]


def test_an_answer_belongs_to_the_open_command():
    bus = Bus()
    asked = bus.say(READ_OTHER).placement
    answered = bus.say(VALUE).placement
    assert (asked.role, asked.source, asked.destination) == (Role.REQUEST, None, 16)
    assert (answered.role, answered.source, answered.destination) == (Role.RESPONSE, 16, None)
    assert asked.tx == answered.tx
    (done,) = bus.end()
    assert (done.station, done.kind, done.request, done.response) == (16, "read-attribute", 1, 2)
    assert (done.verdict, done.latency.nominal) == (Verdict.ANSWERED, 10 * MS)


def test_latency_has_the_bounds_that_the_adapter_leaves():
    bus = Bus(Timing(latency=17 * MS))
    bus.say(READ)
    bus.say(VALUE, after=30 * MS)
    (done,) = bus.end()
    assert (done.latency.low, done.latency.nominal) == (13 * MS, 30 * MS)


def test_a_lost_answer_inverts_nothing():
    bus = Bus()
    for octets in (READ, VALUE, READ):
        bus.say(octets)
    bus.say(POLL, after=300 * MS)
    bus.say(ACK)
    assert bus.verdicts() == [Verdict.ANSWERED, Verdict.NO_RESPONSE, Verdict.ANSWERED]


def test_a_repeat_is_a_retry_and_points_to_the_first():
    bus = Bus()
    for after in (0, 260 * MS, 260 * MS):
        bus.say(READ, after=after)
    bus.say(VALUE)
    first, second, third = bus.end()
    assert [t.verdict for t in (first, second, third)] == [Verdict.NO_RESPONSE, Verdict.NO_RESPONSE, Verdict.RETRY]
    assert [(t.attempt, t.of) for t in (first, second, third)] == [(1, None), (2, first.id), (3, first.id)]


def test_the_same_command_after_an_answer_or_much_later_is_no_retry():
    bus = Bus()
    bus.say(POLL)
    bus.say(ACK)
    bus.say(POLL)
    bus.say(POLL, after=GIVE_UP + MS)
    bus.say(ACK)
    assert [t.attempt for t in bus.end()] == [1, 1, 1]


def test_an_echo_is_neither_command_nor_answer():
    bus = Bus()
    bus.say(READ)
    bus.say(READ, after=0)
    bus.say(VALUE)
    bus.say(VALUE, after=0)
    assert bus.verdicts() == [Verdict.ECHO, Verdict.ANSWERED, Verdict.ECHO]


def test_a_refusal_is_an_exception_with_its_name():
    bus = Bus()
    bus.say(READ)
    bus.say(b"N11\r")
    (done,) = bus.end()
    assert (done.verdict, done.error) == (Verdict.EXCEPTION, "N11 undefined or reserved field")


def test_a_damaged_answer_is_attributed_and_the_repeat_is_a_retry():
    bus = Bus()
    bus.say(READ)
    assert bus.say(b"A0042910000F1\r").placement.source == 1
    bus.say(READ, after=250 * MS)
    bus.say(VALUE)
    assert bus.verdicts() == [Verdict.DAMAGED_ANSWER, Verdict.RETRY]


def test_octets_that_are_no_frame_are_a_damaged_answer_filler_is_none():
    bus = Bus()
    bus.say(READ)
    bus.noise(b"\xc1\r")
    bus.say(POLL, after=250 * MS)
    bus.noise(b"\n", Reason.PAD)
    bus.say(POLL, after=250 * MS)
    assert bus.verdicts() == [Verdict.DAMAGED_ANSWER, Verdict.NO_RESPONSE, Verdict.OPEN]


def test_a_damaged_command_need_not_be_answered():
    bus = Bus()
    bus.say(b">0111010388\r")
    bus.say(READ, after=250 * MS)
    bus.say(VALUE)
    assert bus.verdicts() == [Verdict.DAMAGED_REQUEST, Verdict.ANSWERED]


def test_a_second_answer_means_a_second_station():
    bus = Bus()
    bus.say(READ)
    bus.say(VALUE)
    bus.say(VALUE, after=20 * MS)
    assert bus.verdicts() == [Verdict.ANSWERED, Verdict.ANSWERED_TWICE]


def test_a_second_answer_after_a_retry_is_the_late_one():
    bus = Bus()
    bus.say(READ)
    bus.say(READ, after=250 * MS)
    bus.say(VALUE)
    bus.say(VALUE, after=40 * MS)
    closed = bus.end()
    assert [t.verdict for t in closed] == [Verdict.NO_RESPONSE, Verdict.RETRY, Verdict.LATE]
    assert closed[2].of == closed[0].id


def test_a_late_answer_is_told_by_its_form():
    bus = Bus()
    bus.say(READ_OTHER)
    bus.say(WRITE, after=250 * MS)
    late = bus.say(VALUE)
    own = bus.say(ACK)
    closed = bus.end()
    assert [t.verdict for t in closed] == [Verdict.NO_RESPONSE, Verdict.LATE, Verdict.ANSWERED]
    assert late.placement.source == 16
    assert own.placement.source == 1


def test_an_answer_after_the_longest_wait_is_late_or_nobodys():
    bus = Bus()
    bus.say(READ)
    bus.say(VALUE, after=GIVE_UP + MS)
    bus.say(VALUE, after=3 * GIVE_UP)
    assert bus.verdicts() == [Verdict.NO_RESPONSE, Verdict.LATE, Verdict.UNSOLICITED]
    alone = Bus()
    assert alone.say(VALUE).placement.source is None
    assert alone.verdicts() == [Verdict.UNSOLICITED]


def test_silence_closes_a_command():
    bus = Bus()
    bus.say(READ)
    assert bus.tracker.advance(bus.now + GIVE_UP) == ()
    (done,) = bus.tracker.advance(bus.now + GIVE_UP + 300 * MS)
    assert done.verdict is Verdict.NO_RESPONSE
    assert bus.end() == []


def test_nobody_need_answer_a_broadcast_but_one_may():
    bus = Bus()
    assert bus.say(b">0004C4\r").placement.role is Role.BROADCAST
    bus.say(POLL, after=250 * MS)
    bus.say(ACK)
    bus.say(b">0004C4\r")
    bus.say(ACK)
    assert bus.verdicts() == [Verdict.BROADCAST, Verdict.ANSWERED, Verdict.ANSWERED]


@pytest.mark.parametrize(
    ("command", "answer", "expected"),
    [
        (READ, b"A0042910000F0\r", True),
        (READ, b"A4291000090\r", True),
        (READ, ACK, False),
        (b">01120A0297\r", b"A4064\r", True),
        (b">01120A0297\r", b"A0042910000F0\r", False),
        (WRITE, ACK, True),
        (WRITE, b"A4064\r", False),
        (b">01FA7\r", b"A1061\r", True),
        (POLL, b"A4064\r", None),
        (READ, b"N11\r", None),
        (b">11Z66L015842\r", ACK, None),
    ],
)
def test_the_form_of_an_answer(command, answer, expected):
    assert fits(parse_command(command), answer) is expected


pieces = st.one_of(
    st.sampled_from([READ, READ_OTHER, POLL, WRITE, VALUE, ACK, b"N00\r", b"A4065\r", b"\xff", b">01"]),
    st.binary(max_size=6),
)


@relaxed
@given(st.lists(st.tuples(pieces, st.sampled_from([0, 2 * MS, 10 * MS, 300 * MS, 4000 * MS, 10**11])), max_size=25))
def test_every_frame_has_a_place_and_every_transaction_one_end(parts):
    framer, tracker, now = N2Framer(TIMING), N2Tracker(TIMING), 10**18
    events = []
    for octets, pause in parts:
        now += pause + len(octets) * TIMING.char
        events += framer.feed(Chunk(now, octets))
    events += framer.close()
    placed, closed = {}, []
    for no, event in enumerate(events, 1):
        tracked = tracker.track(no, event, peek(event) if isinstance(event, Frame) else None)
        assert (tracked.placement is not None) == isinstance(event, Frame)
        if tracked.placement is not None:
            placed[no] = tracked.placement.tx
        closed += tracked.closed
    closed += tracker.close()
    assert sorted(t.id for t in closed) == sorted(set(placed.values())) == list(range(1, len(closed) + 1))
    for t in closed:
        assert all(placed[no] == t.id for no in (t.request, t.response) if no is not None)
        assert t.request is not None or t.response is not None
    answers = [t for t in closed if t.verdict is Verdict.ANSWERED]
    assert all(t.request < t.response and t.latency is not None for t in answers)


@relaxed
@given(st.lists(st.tuples(pieces, st.integers(-(10**12), 10**12)), max_size=15))
def test_any_times(parts):
    tracker = N2Tracker(TIMING)
    for no, (octets, time) in enumerate(parts, 1):
        if octets:
            frame = Frame("n2", octets, time, time + 1, Check.GOOD, FoundBy.DELIMITER)
            tracker.track(no, frame, peek(frame))
            tracker.advance(time)
    tracker.close()


# --- whose it is, where two readings stand ----------------------------------------------------------------------------

STATUS, ASK_STATUS, ASK_OTHER_STATUS = b"A4064\r", b">01120A0297\r", b">10120A0297\r"


def test_a_good_answer_behind_a_damaged_one_is_the_answer():
    bus = Bus()
    bus.say(READ)
    bus.say(b"A00429\r")
    bus.say(VALUE)
    bus.say(POLL)
    closed = bus.end()
    assert [t.verdict for t in closed] == [Verdict.ANSWERED, Verdict.OPEN]
    assert closed[0].response == 3


def test_damage_behind_an_answer_is_no_second_answer():
    bus = Bus()
    bus.say(READ)
    bus.say(VALUE)
    assert bus.say(b"A00429\r", after=2 * MS).placement.source == 1
    assert bus.verdicts() == [Verdict.ANSWERED, Verdict.UNSOLICITED]


def test_an_answer_behind_octets_that_may_have_been_a_command_is_no_second_answer():
    bus = Bus()
    bus.say(READ)
    bus.say(VALUE)
    bus.noise(b"\x81\xfe\x00\x9e\xc5\r")
    bus.say(b"A4291000090\r")
    assert bus.verdicts() == [Verdict.ANSWERED, Verdict.UNSOLICITED]


def test_a_few_stray_octets_are_no_answer():
    bus = Bus()
    bus.say(READ)
    bus.noise(b"\x81\xfe")
    bus.noise(b"7")
    bus.say(POLL, after=250 * MS)
    assert bus.verdicts() == [Verdict.NO_RESPONSE, Verdict.OPEN]


def test_a_late_answer_in_the_turn_of_another_is_told_by_its_form():
    bus = Bus()
    bus.say(READ_OTHER)
    bus.say(ASK_STATUS, after=250 * MS)
    late, own = bus.say(VALUE), bus.say(STATUS)
    closed = bus.end()
    assert (late.placement.source, own.placement.source) == (16, 1)
    assert [t.verdict for t in closed] == [Verdict.NO_RESPONSE, Verdict.LATE, Verdict.ANSWERED]
    assert closed[1].of == closed[0].id


def test_a_late_answer_of_the_same_form_accuses_nobody_else():
    bus = Bus()
    bus.say(ASK_OTHER_STATUS)
    bus.say(ASK_STATUS, after=250 * MS)
    bus.say(STATUS)
    bus.say(b"A0060\r")
    assert {(t.station, t.verdict) for t in bus.end()} == {
        (16, Verdict.NO_RESPONSE),
        (1, Verdict.ANSWERED),
        (16, Verdict.LATE),
    }


def test_two_answers_that_crossed_are_no_second_answer():
    # the value is the late one of station 16; a poll might have been answered so too
    bus = Bus()
    bus.say(READ_OTHER)
    bus.say(POLL, after=250 * MS)
    bus.say(VALUE)
    bus.say(ACK)
    assert [t.verdict for t in bus.end()] == [Verdict.NO_RESPONSE, Verdict.ANSWERED, Verdict.LATE]


def test_an_answer_sooner_than_its_station_ever_answered_is_the_late_one():
    bus = Bus()
    for _ in range(20):
        bus.say(ASK_STATUS)
        bus.say(STATUS, after=80 * MS)
    bus.say(ASK_OTHER_STATUS)
    bus.say(ASK_STATUS, after=250 * MS)
    late, own = bus.say(b"A0060\r", after=5 * MS), bus.say(STATUS, after=60 * MS)
    assert (late.placement.source, own.placement.source) == (16, 1)


@pytest.mark.parametrize(
    ("damaged", "station"),
    [
        (b">0q11010387\r", 1),
        (b">9111010387\r", 1),
        (b">2011010387\r", 16),  # 01 and 10 have the same sum: the likeness decides
        (b">1\x1011010387\r", 16),
        (b">0111010388\r", 1),
        (b">7711010399\r", None),
    ],
)
def test_a_damaged_command_stands_at_the_known_station_that_it_fits(damaged, station):
    bus = Bus()
    for command in (READ, READ_OTHER):
        bus.say(command)
        bus.say(VALUE)
    assert bus.say(damaged).placement.destination == station


def test_each_try_of_a_slow_station_has_its_answer_even_where_there_was_room_for_a_command():
    bus = Bus()
    for _ in range(4):
        bus.say(READ_OTHER, 60 * MS)
        bus.say(VALUE)
    for _ in range(3):
        bus.say(READ, 60 * MS)
        bus.say(READ, 250 * MS)
        bus.say(VALUE, 16 * MS)
        bus.say(VALUE, 220 * MS)
    assert bus.verdicts()[4:] == [Verdict.NO_RESPONSE, Verdict.RETRY, Verdict.LATE] * 3
    assert {one.station for one in bus.closed if one.verdict is Verdict.LATE} == {1}
