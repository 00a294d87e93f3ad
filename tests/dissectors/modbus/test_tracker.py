"""Verdicts and roles, each scenario as it happens on a bus. Times in ms, 19200 8E1, exact unless said otherwise."""

from __future__ import annotations

import pytest

from dissectors.frame import Role
from dissectors.modbus.exchanges import GIVE_UP
from dissectors.tracker import Interval, Verdict

READ, VALUES = "010325200002", "01030425202521"
READ_2, VALUES_2 = "020325200001", "0203020007"
WRITE = "010625010001"
WRITE_OTHER = "010625021770"
RUN_ALL = "000625010001"
MS = 1_000_000


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


@pytest.fixture
def known(bus):
    """A bus on which the tracker has learnt: 10 reads and 3 sure writes, answered after 8 ms, pauses of 40 ms."""
    for _ in range(5):
        bus.exchange(READ, VALUES).exchange(READ_2, VALUES_2)
    for _ in range(3):
        bus.exchange("01100101000102 0007", "011001010001").exchange("02100101000102 0007", "021001010001")
    return bus


def fresh(reading, before):
    return reading.transactions[before:]


def test_a_request_and_its_answer_are_one_transaction(bus):
    reading = bus.exchange(READ, VALUES, answer=8).run()
    (transaction,) = reading.transactions
    assert transaction.verdict is Verdict.ANSWERED
    assert (transaction.id, transaction.station, transaction.kind) == (1, 1, "read-holding-registers")
    assert (transaction.request, transaction.response, transaction.attempt, transaction.of) == (1, 2, 1, None)
    assert transaction.latency == Interval(8 * MS, 8 * MS, 8 * MS)
    assert (transaction.start, transaction.end) == (bus.events[0].start, bus.events[1].end)
    request, response = reading.placements
    assert (request.role, request.source, request.destination) == (Role.REQUEST, None, 1)
    assert (response.role, response.source, response.destination) == (Role.RESPONSE, 1, None)
    assert request.tx == response.tx == 1


def test_the_latency_is_known_within_what_the_adapter_allows(paper_bus):
    reading = paper_bus(latency=16 * MS).exchange(READ, VALUES, answer=38).run()
    assert reading.last.latency == Interval(38 * MS, 22 * MS, 54 * MS)


def test_a_latency_is_never_negative(paper_bus):
    reading = paper_bus(latency=16 * MS).exchange(READ, VALUES, answer=2).run()
    assert reading.last.latency == Interval(2 * MS, 0, 18 * MS)


def test_an_exception_has_its_own_verdict_and_its_code_in_words(bus):
    reading = bus.exchange(READ, "018302").exchange(READ, "018352").run()
    assert reading.verdicts == ["exception", "exception"]
    assert [t.error for t in reading.transactions] == ["illegal data address", "vendor 0x52"]


def test_the_next_request_closes_an_unanswered_one(bus):
    reading = bus.say(READ).exchange(READ_2, VALUES_2, pause=500).run()
    assert reading.verdicts == ["no-response", "answered"]
    assert reading.transactions[0].response is None


def test_a_repeat_that_is_answered_is_a_retry_of_the_first_attempt(bus):
    reading = bus.say(READ).say(READ, 500).exchange(READ, VALUES, pause=500).run()
    assert reading.verdicts == ["no-response", "no-response", "retry"]
    assert [(t.attempt, t.of) for t in reading.transactions] == [(1, None), (2, 1), (3, 1)]


def test_an_exception_to_a_repeat_stays_an_exception(bus):
    reading = bus.say(READ).exchange(READ, "018302", pause=500).run()
    assert reading.last.verdict is Verdict.EXCEPTION
    assert reading.last.attempt == 2


def test_a_write_is_answered_by_its_copy(known):
    before = len(known.run().transactions)
    reading = known.exchange(WRITE, WRITE).run()
    (transaction,) = fresh(reading, before)
    assert transaction.verdict is Verdict.ANSWERED
    assert reading.roles[-2:] == ["request", "response"]


def test_a_copy_after_the_response_time_is_a_repeat_of_the_request(known):
    before = len(known.run().transactions)
    reading = known.say(WRITE).say(WRITE, 300).say(WRITE, 8).run()
    assert [t.verdict.value for t in fresh(reading, before)] == ["no-response", "retry"]
    assert reading.roles[-3:] == ["request", "request", "response"]


def test_a_copy_sooner_than_a_station_can_answer_is_an_echo(bus):
    reading = bus.say(WRITE).say(WRITE, 0.5).say(WRITE, 8).run()
    assert reading.verdicts == ["answered", "echo"]
    assert reading.transactions[1].of == 1
    assert reading.roles == ["request", "request", "response"]


def test_an_echoing_bus_is_learnt_from_reads(paper_bus):
    """With a 16 ms adapter an echo and an answer of 3 ms look alike; the reads tell that this bus echoes."""
    bus = paper_bus(latency=16 * MS)
    for _ in range(3):
        bus.say(READ).say(READ, 1).say(VALUES, 12)
    reading = bus.say(WRITE).say(WRITE, 1).say(WRITE, 12).run()
    assert reading.verdicts == ["answered", "echo"] * 4
    assert reading.roles[-3:] == ["request", "request", "response"]


def test_a_bus_without_echo_takes_a_fast_copy_for_the_answer(paper_bus):
    bus = paper_bus(latency=16 * MS)
    for _ in range(3):
        bus.exchange(READ, VALUES, answer=0)  # both in one read
    reading = bus.exchange(WRITE, WRITE, answer=0).run()
    assert reading.verdicts == ["answered"] * 4


def test_a_late_answer_names_the_request_it_is_late_for(bus):
    reading = bus.say(READ).say(READ_2, 500).say(VALUES, 3).say(VALUES_2, 8).run()
    assert reading.verdicts == ["no-response", "answered", "late"]
    late = reading.transactions[2]
    assert (late.request, late.response, late.of, late.station) == (None, 3, 1, 1)
    assert late.latency.nominal > 500 * MS
    assert reading.transactions[1].response == 4


def test_a_late_answer_may_come_after_the_retry_was_answered(bus):
    reading = bus.say(READ).exchange(READ, VALUES, pause=500).say(VALUES, 6).run()
    assert reading.verdicts == ["no-response", "retry", "late"]


def test_a_late_answer_directly_after_the_repeat_is_not_the_repeats(bus):
    """It began before the station can have seen the end of the repeat."""
    reading = bus.say(READ).say(READ, 500).say(VALUES, 0.2).say(VALUES, 8).run()
    assert reading.verdicts == ["no-response", "retry", "late"]
    assert reading.transactions[1].response == 4


def test_an_answer_that_nobody_asked_for_is_unsolicited(known):
    before = len(known.run().transactions)
    reading = known.say("030302 0001", 100).run()
    (transaction,) = fresh(reading, before)
    assert transaction.verdict is Verdict.UNSOLICITED
    assert (transaction.request, transaction.of, transaction.station) == (None, None, 3)


def test_a_second_answer_at_once_betrays_a_duplicate_address(known):
    before = len(known.run().transactions)
    reading = known.exchange(READ, VALUES).say("01030400000000", 3).exchange(READ_2, VALUES_2).run()
    assert [t.verdict.value for t in fresh(reading, before)] == ["answered", "answered-twice", "answered"]
    assert fresh(reading, before)[1].of == fresh(reading, before)[0].id


def test_a_second_copy_of_a_write_is_a_second_answer(known):
    before = len(known.run().transactions)
    reading = known.exchange(WRITE, WRITE).say(WRITE, 4).exchange(READ, VALUES).run()
    assert [t.verdict.value for t in fresh(reading, before)] == ["answered", "answered-twice", "answered"]


def test_an_answer_from_another_unit_is_unsolicited_and_says_so(bus):
    reading = bus.exchange(READ, VALUES_2).say(READ, 300).run()
    assert reading.verdicts[:2] == ["no-response", "unsolicited"]
    asked, answer = reading.transactions[:2]
    assert asked.error == "unit 2 answered instead"
    assert (answer.error, answer.of) == ("unit 2 answered a request to unit 1", 1)


def test_the_right_unit_may_still_answer_after_a_wrong_one(bus):
    reading = bus.say(READ).say(VALUES_2, 5).say(VALUES, 5).run()
    assert reading.verdicts == ["answered", "unsolicited"]


def test_an_answer_of_another_size_is_answered_with_a_word_about_it(bus):
    reading = bus.exchange(READ, "0103020007").run()
    assert reading.verdicts == ["answered"]
    assert reading.last.error == "2 data octets for 2 registers asked for, expected 4"


def test_an_answer_that_does_not_repeat_the_write_is_answered_with_a_word_about_it(known):
    reading = known.exchange(WRITE_OTHER, "010625021700").run()
    assert reading.last.verdict is Verdict.ANSWERED
    assert reading.last.error == "confirms another value than was written"


def test_another_value_written_to_the_same_register_is_another_request(known):
    before = len(known.run().transactions)
    reading = known.say("010625020001").exchange("010625020002", "010625020002", pause=100).run()
    assert [t.verdict.value for t in fresh(reading, before)] == ["no-response", "answered"]


def test_a_damaged_answer_is_not_a_timeout(bus):
    reading = bus.say(READ).damage(VALUES).exchange(READ_2, VALUES_2, pause=300).run()
    assert reading.verdicts == ["damaged-answer", "answered"]
    assert (reading.transactions[0].response, reading.transactions[0].station) == (2, 1)
    assert reading.transactions[0].error == "CRC error"
    assert reading.roles[1] == "response"


def test_an_answer_cut_short_is_a_damaged_answer(bus):
    reading = bus.say(READ).cut(VALUES, 4).say(READ, 300).run()
    assert reading.verdicts[0] == "damaged-answer"
    assert reading.transactions[0].error == "short: 4 octets, 9 expected"
    assert reading.transactions[1].attempt == 2


def test_an_answer_whose_unit_was_damaged_is_still_this_requests(known):
    before = len(known.run().transactions)
    reading = known.say(READ).damage(VALUES, at=0).say(READ, 300).run()
    assert fresh(reading, before)[0].verdict is Verdict.DAMAGED_ANSWER
    assert fresh(reading, before)[0].station == 1


def test_an_answer_after_a_damaged_one_still_counts(bus):
    reading = bus.say(READ).damage(VALUES).say(VALUES, 5).run()
    assert reading.verdicts == ["answered"]
    assert reading.last.error.startswith("before the answer: CRC error")


def test_a_copy_well_behind_a_damaged_answer_is_the_masters_repeat(bus):
    reading = bus.say(WRITE).damage(WRITE).say(WRITE, 190).say(WRITE, 12).run()
    assert reading.roles == ["request", "response", "request", "response"]
    assert reading.verdicts == ["damaged-answer", "retry"]


def test_a_copy_directly_behind_garbage_is_the_answer_with_a_bad_begin(bus):
    reading = bus.say(WRITE).noise(b"\x55\xaa\x13").say(WRITE, 1).run()
    assert reading.verdicts == ["answered"]
    assert reading.roles[-1] == "response"


def test_a_copy_in_the_learnt_time_is_the_answer_whatever_came_before_it(known):
    before = len(known.run().transactions)
    reading = known.say(WRITE).noise(b"\x55\xaa\x13").say(WRITE, 5).run()
    assert [t.verdict for t in fresh(reading, before)] == [Verdict.ANSWERED]


def test_garbage_in_place_of_an_answer_is_a_damaged_answer(bus):
    reading = bus.say(READ).noise(b"\x55\xaa\x13\x77").say(READ, 300).run()
    assert reading.verdicts[0] == "damaged-answer"
    assert reading.transactions[0].error == "4 octets came in answer, but no frame"
    assert reading.roles[1] == "noise"


def test_one_stray_octet_is_no_answer(bus):
    assert bus.say(READ).noise(b"\xff").say(READ, 300).run().verdicts[0] == "no-response"


def test_a_damaged_request_that_nobody_answers(bus):
    reading = bus.exchange(READ, VALUES).damage(READ_2, 40).exchange(READ, VALUES, pause=300).run()
    assert reading.verdicts == ["answered", "damaged-request", "answered"]
    assert reading.transactions[1].error.startswith("CRC error")


def test_a_request_damaged_at_the_tap_only_is_answered_all_the_same(bus):
    reading = bus.exchange(READ, VALUES).damage(READ_2, 40).say(VALUES_2, 8).run()
    assert reading.verdicts == ["answered", "answered"]
    assert reading.last.error.startswith("request damaged at this tap: CRC error")


def test_a_request_with_a_damaged_unit_is_attributed_by_its_answer(bus):
    reading = bus.damage(READ_2, 40, at=0).say(VALUES_2, 8).run()
    assert (reading.verdicts, reading.last.station) == (["answered"], 2)


def test_request_and_answer_both_damaged_are_one_damaged_request(bus):
    reading = bus.damage(READ).damage(VALUES).exchange(READ, VALUES, pause=300).run()
    assert reading.verdicts == ["damaged-request", "answered"]


def test_a_broadcast_needs_no_answer(bus):
    reading = bus.say(RUN_ALL).exchange(READ, VALUES, pause=100).run()
    assert reading.verdicts == ["broadcast", "answered"]
    assert reading.roles[0] == "broadcast"
    assert reading.placements[0].destination == 0


def test_a_broadcast_repeated_at_once_is_an_echo(bus):
    reading = bus.say(RUN_ALL).say(RUN_ALL, 0.5).exchange(READ, VALUES).run()
    assert reading.verdicts == ["broadcast", "echo", "answered"]


def test_listen_only_mode_needs_no_answer(bus):
    reading = bus.say("010800040000").say(READ, 300).exchange("010800010000", "020302 0001", pause=300).run()
    assert reading.verdicts[:2] == ["data", "no-response"]
    assert reading.transactions[1].error == "unit 1 was put into listen-only mode"
    assert reading.transactions[2].verdict is Verdict.DATA, "the restart that ends it is not answered either"


def test_listen_only_mode_may_be_refused(bus):
    reading = bus.exchange("010800040000", "018801").run()
    assert reading.verdicts == ["exception"]


def test_a_loop_back_is_answered_by_its_copy(known):
    assert known.exchange("01080000a537", "01080000a537").run().last.verdict is Verdict.ANSWERED


def test_coils_that_look_like_a_request_are_the_answer_to_one(bus):
    """Octets 01 01 03 00 00 01 are three octets of coils, and a request for one coil at 0300h."""
    reading = bus.exchange("010100000014", "010103000001").exchange("010103000001", "01010101").run()
    assert reading.verdicts == ["answered", "answered"]
    assert reading.roles == ["request", "response", "request", "response"]


def test_a_capture_that_ends_in_between_leaves_it_open(bus):
    assert bus.say(READ).run().verdicts == ["open"]


def test_silence_closes_an_unanswered_request_in_time(bus):
    bus.say(READ)
    tracker = bus.run().tracker.__class__(bus.timing)
    from dissectors.modbus.header import peek_rtu

    tracker.track(1, bus.events[0], peek_rtu(bus.events[0]))
    assert tracker.advance(bus.end + GIVE_UP - MS) == ()
    (transaction,) = tracker.advance(bus.end + GIVE_UP + 100 * MS)
    assert transaction.verdict is Verdict.NO_RESPONSE
    assert tracker.close() == ()


def test_the_masters_timeout_is_learnt_from_two_that_agree(bus):
    reading = bus.say(READ_2).say(READ, 500).say(READ, 500).run()
    assert reading.tracker.timeout == 500 * MS


def test_one_unanswered_request_teaches_no_timeout(bus):
    assert bus.say(READ_2).say(READ, 500).run().tracker.timeout is None


def test_response_times_are_learnt_by_unit(known):
    times = known.run().tracker.learnt.response_times()
    assert times == {1: (8 * MS, 8 * MS), 2: (8 * MS, 8 * MS)}


def test_a_write_that_takes_long_to_store_is_still_its_answer_before_the_timeout(bus):
    for _ in range(5):
        bus.exchange(READ, VALUES, answer=5)
    reading = bus.exchange(WRITE, WRITE, answer=90).exchange(READ, VALUES, answer=5).run()
    assert reading.verdicts == ["answered"] * 7


def test_a_wrong_byte_count_is_an_answer_with_a_word_about_it(bus):
    """One octet of coils, announced as two: it fits no direction."""
    reading = bus.exchange("01020 03f0001".replace(" ", ""), "01020201").run()
    assert reading.verdicts == ["answered"]
    assert "fit neither request nor response" in reading.last.error


def test_times_that_run_backwards_do_no_harm(bus):
    bus.exchange(READ, VALUES).exchange(READ_2, VALUES_2)
    bus.events[2], bus.events[0] = bus.events[0], bus.events[2]
    reading = bus.run()
    assert len({p.tx for p in reading.placements}) == len(reading.transactions)


def test_a_master_that_does_not_wait_got_an_answer_that_this_tap_missed(bus):
    bus.say(READ_2).say(READ, 500).say(READ_2, 500)  # a timeout of 500 ms
    reading = bus.exchange(READ, VALUES, pause=500).say(READ).exchange(READ_2, VALUES_2, pause=60).run()
    assert reading.transactions[-2].verdict is Verdict.NO_RESPONSE
    assert "may have been missed at this tap" in reading.transactions[-2].error
    assert reading.transactions[1].error is None


def test_the_response_time_that_a_copy_may_take_is_the_learnt_one(known):
    """8 ms learnt: a copy after 14 ms is the answer, one after 30 ms the request again."""
    before = len(known.run().transactions)
    reading = (
        known.exchange(WRITE, WRITE, answer=14).say(WRITE_OTHER).exchange(WRITE_OTHER, WRITE_OTHER, pause=30).run()
    )
    assert [t.verdict.value for t in fresh(reading, before)] == ["answered", "no-response", "retry"]


def test_a_wait_with_something_in_it_teaches_no_timeout(bus):
    for _ in range(3):
        bus.say(READ, 300).noise(b"\x55\xaa")
    assert bus.say(READ, 300).run().tracker.timeout is None


def test_a_write_that_takes_as_long_as_the_reads_is_an_answer_though_the_timeout_is_near(bus):
    for _ in range(3):
        bus.exchange(READ, VALUES, answer=174)
    bus.say(READ_2, 40).say(READ_2, 200).say(READ_2, 200)
    bus.exchange(READ, VALUES, answer=174)
    reading = bus.exchange(WRITE, WRITE, answer=175).run()
    assert reading.last.verdict is Verdict.ANSWERED


def test_a_repeat_at_once_behind_a_damaged_answer_is_no_echo(bus):
    for _ in range(3):
        bus.exchange("020300000001", "0203020007")
        bus.say("010300070002").damage("01030400070009", 12).exchange("010300070002", "01030400070009", pause=14)
    assert bus.run().verdicts == ["answered", "damaged-answer", "retry"] * 3


@pytest.mark.parametrize("latency", [0, 17 * MS])
def test_a_write_repeated_at_once_behind_its_damaged_confirmation_is_no_answer(paper_bus, latency):
    """Though the times of that station are known."""
    bus = paper_bus(latency=latency)
    for _ in range(4):
        bus.exchange(READ, VALUES).exchange(READ_2, VALUES_2)
    for _ in range(4):
        bus.say(WRITE).damage(WRITE, 12, at=4).say(WRITE, 12).say(WRITE, 12)
    assert bus.run().verdicts[8:] == ["damaged-answer", "retry"] * 4


def test_an_answer_to_an_echo_is_no_second_answer_where_the_adapter_hides_the_echo(paper_bus):
    bus = paper_bus(latency=17 * MS)
    for value in range(1, 5):
        write = f"01060010{value:04X}"
        bus.say(write, 300).say(write, 7).say(write, 1)
    assert "answered-twice" not in bus.run().verdicts


def test_a_second_confirmation_is_one_where_reads_have_no_echo(paper_bus):
    bus = paper_bus(latency=17 * MS).exchange(READ, VALUES, answer=30).exchange(READ, VALUES, answer=30)
    bus.exchange(WRITE, WRITE, answer=7, pause=300).say(WRITE, 1)
    assert bus.run().last.verdict is Verdict.ANSWERED_TWICE


def test_an_echo_cut_to_three_octets_is_one_where_no_answer_begins_so(bus):
    for _ in range(3):
        bus.say(READ, 300).cut(READ, 3, 0.7)
    assert bus.run().verdicts.count("echo") == 3


def test_an_echo_read_late_is_no_answer_where_all_requests_have_echoes(bus):
    """The copy behind it is the answer, and not a second one, nor a request that gets none."""
    for _ in range(4):
        bus.say(READ).say(READ, 0.7).say(VALUES)
    for answer in (3, 30):
        bus.say(WRITE, 200).say(WRITE, 9).say(WRITE, answer)
    assert bus.run().verdicts[8:] == ["answered", "answered-or-repeated"] * 2


def test_an_answer_read_late_behind_an_echo_is_perhaps_one(bus):
    for _ in range(4):
        bus.say(READ).say(READ, 0.7).say(VALUES)
    bus.say(WRITE, 200).say(WRITE, 0.7).say(WRITE, 120).say(READ, 8).say(READ, 0.7).say(VALUES)
    assert "no-response" not in bus.run().verdicts


def test_an_echo_of_a_read_that_looks_like_its_answer_is_an_echo(bus):
    coils = "010103000011"  # 17 coils from 0x0300 on: three octets of values, by the count
    for _ in range(3):
        bus.say(coils).say(coils, 0.7).say("010103123401")
    assert bus.run().verdicts == ["answered", "echo"] * 3


def test_of_damaged_writes_only_the_first_behind_a_damaged_one_is_its_answer(bus):
    for _ in range(3):
        bus.damage(WRITE, 300).damage(WRITE, 10)
    assert bus.run().verdicts == ["damaged-request"] * 3


def test_without_times_a_request_again_is_no_echo_where_others_have_none(paper_bus):
    bus = paper_bus(latency=50 * MS)
    for _ in range(4):
        bus.exchange(READ, VALUES, answer=1, pause=1).say(READ_2, 1).say(READ_2, 1)
    assert bus.run().verdicts.count("echo") == 0


def test_what_another_write_says_is_no_answer_where_one_of_another_station_came_between(paper_bus):
    """A confirmation that is late by a turn, in a log without times."""
    bus = paper_bus(latency=50 * MS)
    for value in range(1, 5):
        write = f"030600050{value:03X}"
        bus.say(write, 1).say(READ, 1).say(write, 1).say(VALUES, 1)
    assert not [one for one in bus.run().transactions if "another value" in (one.error or "")]
