"""The simulated line: what receivers get, and whether the ground truth tells it."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import LineError, Place
from dissectors.line import LineSettings
from dissectors.simulated import Send
from dissectors.simulated_faults import (
    NOISE,
    BitFlips,
    Break,
    CutShort,
    DuplicateAddress,
    EarlyRelease,
    Echo,
    Fault,
    LateResponse,
    LostResponse,
    MarkParity,
    NoiseInGaps,
)
from sniff.simulation.collision import low_times, receive
from sniff.simulation.wire import Burst, Party, Sent, Wire

LINE = LineSettings.parse("19200,8E1")
CHAR = LINE.char
MS = 1_000_000
QUESTION = b"\x01\x03\x00\x00\x00\x02\xc4\x0b"
ANSWER = bytes(range(12))


@dataclass
class Asker:
    """Sends QUESTION every `every` ns and keeps what it hears."""

    every: int = 50 * MS
    first: int = 0
    heard: list[tuple[int, bytes, bool]] = field(default_factory=list)

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        self.heard.append((now, octets, quiet))
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.first:
            return ()
        self.first += self.every
        return (Send(now, QUESTION),)

    def next_wake(self) -> int | None:
        return self.first


@dataclass
class Answerer:
    """Answers QUESTION with ANSWER after `delay` ns when the question stood alone."""

    delay: int = 5 * MS
    heard: list[tuple[int, bytes, bool]] = field(default_factory=list)

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        self.heard.append((now, octets, quiet))
        return (Send(now + self.delay, ANSWER),) if octets == QUESTION and quiet else ()

    def wake(self, now: int) -> tuple[Send, ...]:
        return ()

    def next_wake(self) -> int | None:
        return None


def poll(*faults: Fault, seconds: float = 10, seed: int = 0, gap: int = 2 * MS) -> tuple[list[Burst], Asker, Answerer]:
    asker, answerer = Asker(), Answerer()
    parties = [Party("master", asker, answers=False), Party("drive", answerer)]
    return list(Wire(LINE, parties, faults, seed, gap).run(int(seconds * 1e9))), asker, answerer


def sent(bursts: list[Burst]) -> list[Sent]:
    return [one for burst in bursts for one in burst.sent]


def test_a_clean_bus_carries_questions_and_answers_at_line_speed() -> None:
    bursts, asker, answerer = poll(seconds=1)
    assert [burst.octets for burst in bursts[:4]] == [QUESTION, ANSWER, QUESTION, ANSWER]
    question, answer = bursts[:2]
    assert (question.start, question.end) == (0, 8 * CHAR)
    assert list(question.ends) == [CHAR * (k + 1) for k in range(8)]
    assert answer.start == question.end + 5 * MS
    assert asker.heard[0] == (answer.end, ANSWER, True)
    assert answerer.heard[0] == (question.end, QUESTION, True)
    assert all(one.intact and not one.faults for one in sent(bursts))
    assert len(bursts) in (40, 41, 42)


@settings(deadline=None)
@given(
    st.binary(min_size=1, max_size=40), st.sampled_from(["19200,8E1", "9600,8N1", "9600,7E1", "300,8O2", "115200,8M1"])
)
def test_bits_and_arithmetic_agree_for_a_transmission_that_is_alone(octets: bytes, token: str) -> None:
    line = LineSettings.parse(token)
    received = receive(line, low_times(line, 1000, octets, {}))
    assert received.octets == bytes(octet & (1 << line.data_bits) - 1 for octet in octets)
    assert list(received.ends) == [1000 + line.char * (k + 1) for k in range(len(octets))]
    assert received.marks == ()


@settings(deadline=None)
@given(st.binary(min_size=1, max_size=20), st.data())
def test_bits_and_arithmetic_agree_on_flipped_bits(octets: bytes, data: st.DataObject) -> None:
    flips = data.draw(st.dictionaries(st.integers(0, len(octets) - 1), st.integers(1, 511), max_size=3))
    by_bits = receive(LINE, low_times(LINE, 0, octets, flips))
    wire = Wire(LINE, faults=[Flip(flips)])
    wire.send("a", 0, octets)
    (burst,) = wire.run(10**12)
    assert by_bits.octets == burst.octets
    parity = [mark for mark in by_bits.marks if mark.error is LineError.PARITY]
    assert parity == list(burst.marks)


@dataclass(frozen=True)
class Flip:
    flips: dict[int, int]
    name: str = "flip"

    def strike(self, sent, now, line, dice):  # type: ignore[no-untyped-def]
        return (sent.hit(self.name, flips=self.flips),)


@settings(deadline=None)
@given(st.binary(min_size=4, max_size=30), st.binary(min_size=4, max_size=30), st.integers(1, 3 * CHAR))
def test_a_collision_spares_what_came_before_it_and_is_told(first: bytes, second: bytes, after: int) -> None:
    wire = Wire(LINE)
    wire.send("a", 0, first)
    wire.send("b", after, second)
    (burst,) = wire.run(10**12)
    whole = after // CHAR  # octets of the first that had ended
    assert burst.octets[:whole] == first[:whole]
    assert [(one.party, one.faults) for one in burst.sent] == [("a", ("collision",)), ("b", ("collision",))]
    for one in burst.sent:  # a 0 wins: one of them may come through, and then it is not called damaged
        assert not one.intact or one.octets in burst.octets
    assert list(burst.ends) == sorted(burst.ends)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 20 * MS), st.sampled_from("abc"), st.binary(min_size=1, max_size=9)), max_size=12)
)
def test_every_transmission_stands_in_one_burst_and_bursts_do_not_overlap(sends: list[tuple[int, str, bytes]]) -> None:
    wire = Wire(LINE)
    for at, party, octets in sends:
        wire.send(party, at, octets)
    bursts = list(wire.run(10**12))
    assert sorted((one.party, one.octets) for one in sent(bursts)) == sorted(
        (party, octets) for _, party, octets in sends
    )
    assert all(before.end <= after.start for before, after in pairwise(bursts))
    for burst in bursts:
        if len(burst.sent) == 1:
            assert burst.sent[0].intact
            assert burst.octets == burst.sent[0].octets


def test_a_driver_sends_one_thing_after_the_other() -> None:
    wire = Wire(LINE)
    wire.send("a", 0, b"first")
    wire.send("a", CHAR, b"second")
    wire.send("a", 0, b"third")
    assert [(burst.start, burst.octets) for burst in wire.run(10**12)] == [
        (0, b"first"),
        (5 * CHAR, b"third"),
        (10 * CHAR, b"second"),
    ]


def test_what_comes_through_a_collision_is_not_called_damaged() -> None:
    wire = Wire(LINE)
    wire.send("a", 0, b"\x00\x00")
    wire.send("b", LINE.bits(2), b"\xfe")
    (burst,) = wire.run(10**12)
    assert burst.octets == b"\x00\x00"
    assert [(one.party, one.intact) for one in burst.sent] == [("a", True), ("b", False)]


def test_octets_already_received_do_not_change_when_somebody_else_begins() -> None:
    wire = Wire(LINE)
    wire.send("a", 0, bytes(range(10)))
    wire.advance(3 * CHAR + 10)
    early = wire.on_line()
    assert early is not None
    wire.send("b", 3 * CHAR + 20, b"\x00" * 10)
    wire.advance(4 * CHAR)
    late = wire.on_line()
    assert late is not None
    assert late.octets[:3] == early.octets[:3] == b"\x00\x01\x02"
    assert late.octets != early.octets
    assert wire.senders() == {"a", "b"}


def test_the_same_seed_gives_the_same_run_and_another_seed_another() -> None:
    faults = (
        BitFlips(0.01),
        NoiseInGaps(0.2),
        LostResponse(0.1),
        LateResponse(0.1, 20 * MS),
        Break(0.05),
        CutShort(0.05),
    )
    once, again, other = poll(*faults)[0], poll(*faults)[0], poll(*faults, seed=1)[0]
    assert once == again
    assert once != other


def test_switching_one_fault_off_leaves_the_others_alone() -> None:
    with_both = sent(poll(LostResponse(0.1), NoiseInGaps(0.2))[0])
    only_lost = sent(poll(LostResponse(0.1), NoiseInGaps(0.0))[0])

    def lost(truths: list[Sent]) -> list[int]:
        answers = [one for one in truths if one.party == "drive"]
        return [k for k, one in enumerate(answers) if "lost" in one.faults]

    assert lost(with_both)[:3] == lost(only_lost)[:3] != []


@pytest.mark.parametrize(
    ("fault", "name", "share"),
    [
        (BitFlips(0.01), "bit-flip", (0.05, 0.16)),
        (LostResponse(0.2), "lost", (0.12, 0.28)),
        (LateResponse(0.2, 7 * MS), "late", (0.12, 0.28)),
        (EarlyRelease(0.2), "early-release", (0.12, 0.28)),
        (CutShort(0.2), "cut-short", (0.12, 0.28)),
        (MarkParity(0.01), "parity", (0.05, 0.16)),
    ],
)
def test_a_fault_strikes_about_as_often_as_it_says(fault: Fault, name: str, share: tuple[float, float]) -> None:
    truths = sent(poll(fault, seconds=30)[0])
    whom = truths if name in ("bit-flip", "parity") else [one for one in truths if one.party == "drive"]
    struck = [one for one in whom if name in one.faults]
    assert share[0] < len(struck) / len(whom) < share[1]
    assert all(one.faults in ((), (name,)) for one in truths)
    assert all(one.intact is (not one.faults or name in ("late", "parity")) or name == "bit-flip" for one in truths)


def test_bit_flips_are_seen_as_parity_errors_unless_two_hide_each_other() -> None:
    bursts, _, answerer = poll(BitFlips(0.01), seconds=30)
    for burst in bursts:
        (one,) = burst.sent
        assert bool(burst.marks) or not one.faults or len(one.octets) > 1
        assert one.intact is (burst.octets == one.octets)
        if burst.marks:
            assert "bit-flip" in one.faults
            assert all(mark.error is LineError.PARITY for mark in burst.marks)
    assert any(octets != QUESTION for _, octets, _ in answerer.heard)


def test_without_parity_a_flipped_bit_leaves_no_mark() -> None:
    wire = Wire(LineSettings.parse("9600,8N1"), faults=[BitFlips(1.0)])
    wire.send("a", 0, bytes(50))
    (burst,) = wire.run(10**12)
    assert burst.octets != bytes(50)
    assert all(octet.bit_count() == 1 for octet in burst.octets)
    assert burst.marks == ()


def test_a_lost_answer_is_on_nobodys_line_but_in_the_truth() -> None:
    bursts, asker, _ = poll(LostResponse(1.0), seconds=1)
    assert asker.heard == []
    lost = [one for one in sent(bursts) if one.party == "drive"]
    assert len(lost) == 20
    assert all(one.start == one.end and not one.intact and one.octets == ANSWER for one in lost)
    assert all(burst.octets != ANSWER for burst in bursts)


def test_a_late_answer_comes_later_by_that_much() -> None:
    bursts, _, _ = poll(LateResponse(1.0, 20 * MS), seconds=1)
    assert bursts[1].start == bursts[0].end + 25 * MS
    assert bursts[1].sent[0].intact


def test_a_duplicate_address_collides_or_answers_twice() -> None:
    collided = poll(DuplicateAddress("drive", by=CHAR // 3), seconds=1)[0]
    twice = poll(DuplicateAddress("drive", by=20 * CHAR), seconds=1)[0]
    assert [one.faults for one in collided[1].sent] == [("collision",), ("duplicate", "collision")]
    assert [burst.octets for burst in twice[:3]] == [QUESTION, ANSWER, ANSWER]


def test_an_echo_is_an_exact_copy_directly_behind() -> None:
    bursts, _, answerer = poll(Echo(("master",)), seconds=1)
    assert [burst.octets for burst in bursts[:3]] == [QUESTION, QUESTION, ANSWER]
    assert bursts[1].start == bursts[0].end
    assert answerer.heard[1][2] is False  # no gap before it


@pytest.mark.parametrize("place", [Place.BEFORE, Place.AFTER, Place.BETWEEN])
def test_noise_lies_where_it_should(place: Place) -> None:
    wire = Wire(LINE, faults=[NoiseInGaps(1.0, most=3, places=(place,), values=b"\xff")])
    wire.send("a", 100 * MS, QUESTION)
    bursts = list(wire.run(10**12))
    noise = next(burst for burst in bursts if burst.sent[0].party == NOISE)
    frame = next(burst for burst in bursts if burst.sent[0].party == "a")
    assert set(noise.octets) == {0xFF}
    assert 1 <= len(noise.octets) <= 3
    assert frame.octets == QUESTION
    assert frame.sent[0].intact
    if place is Place.BEFORE:
        assert noise.end == frame.start
    elif place is Place.AFTER:
        assert noise.start == frame.end
    else:
        assert frame.end + 2 * CHAR <= noise.start <= frame.end + 8 * CHAR


def test_a_break_is_one_octet_00_marked_as_break() -> None:
    wire = Wire(LINE, faults=[Break(1.0, bits=30)])
    wire.send("a", 0, QUESTION)
    _, burst = wire.run(10**12)
    assert burst.octets == b"\0"
    assert [mark.error for mark in burst.marks] == [LineError.BREAK]
    assert burst.end - burst.start == LINE.bits(30)
    assert burst.ends == [burst.start + CHAR]


def test_noise_directly_before_a_question_makes_it_not_quiet() -> None:
    bursts, _, answerer = poll(NoiseInGaps(1.0, places=(Place.BEFORE,)), seconds=2)
    assert {quiet for _, octets, quiet in answerer.heard if octets == QUESTION} == {False}
    assert all(burst.octets != ANSWER for burst in bursts)
    assert sum(burst.octets == QUESTION and burst.sent[0].intact for burst in bursts) in (39, 40, 41)


def test_more_of_the_same_within_the_linger_time_is_one_burst() -> None:
    wire = Wire(LINE)
    wire.send("a", 0, b"\x01\x02", linger=MS)
    assert wire.advance(2 * CHAR + MS // 2) == []
    wire.send("a", wire.now, b"\x03", linger=MS)
    (burst,) = wire.run(10**12)
    assert burst.octets == b"\x01\x02\x03"
    assert burst.ends[2] - burst.ends[1] == MS // 2 + CHAR
    assert [one.octets for one in burst.sent] == [b"\x01\x02", b"\x03"]
    assert all(one.intact for one in burst.sent)


def test_somebody_else_within_the_linger_time_begins_a_new_burst() -> None:
    wire = Wire(LINE)
    wire.send("a", 0, b"\x01\x02", linger=MS)
    wire.send("b", 2 * CHAR + 10, b"\x03")
    first, second = wire.run(10**12)
    assert (first.octets, second.octets) == (b"\x01\x02", b"\x03")


def test_a_station_that_always_wants_to_wake_at_once_does_not_stop_the_line() -> None:
    class Restless(Asker):
        def wake(self, now: int) -> tuple[Send, ...]:
            return ()

        def next_wake(self) -> int | None:
            return -5

    wire = Wire(LINE, [Party("restless", Restless())])
    wire.send("a", 1000, b"\x01")
    assert len(wire.advance(1001)) == 0
    assert wire.now == 1001
