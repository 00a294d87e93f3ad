"""A station answers in the order in which it is asked: what it owes no more is not late, and not a second answer."""

from __future__ import annotations

import pytest

ONE, VALUES = "010300000002", "01030400010002"
TWO, OTHERS = "020300000002", "02030400030004"


@pytest.fixture
def bus(paper_bus):
    made = paper_bus()
    for _ in range(4):
        made.exchange(ONE, VALUES).exchange(TWO, OTHERS)
    return made


def unheard(bus):
    """A request whose answer this tap missed, and the next turn."""
    return bus.say(ONE).exchange(TWO, OTHERS, pause=55)


def test_an_answer_whose_request_was_missed_does_not_belong_to_one_before_later_answers(bus):
    for _ in range(3):
        bus.say("090300000002").exchange(TWO, OTHERS, pause=300)  # so long may answers take
    unheard(bus).exchange(ONE, VALUES).exchange(TWO, OTHERS).say(VALUES, 60)
    assert bus.run().last.verdict.value == "unsolicited"


def test_an_answer_in_the_next_turn_is_late(bus):
    bus.say(ONE).say(TWO, 120).say(VALUES, 4)
    assert "late" in bus.run().verdicts


def test_of_a_repeat_nobody_knows_which_try_was_answered(bus):
    bus.say(ONE).say(ONE, 120).say(VALUES, 4).say(VALUES, 30)
    assert "late" in bus.run().verdicts


def test_no_answer_comes_after_many_times_what_the_master_waited(bus):
    unheard(bus)
    for _ in range(4):
        bus.exchange(TWO, OTHERS)
    bus.say(VALUES, 60)
    assert bus.run().last.verdict.value == "unsolicited"


@pytest.mark.parametrize("left", [5, 6, 7])
def test_the_answer_to_a_request_that_was_damaged_is_no_second_answer(bus, left):
    bus.cut(TWO, left, 40).say(OTHERS, 6)
    assert "answered-twice" not in bus.run().verdicts


def test_a_second_answer_directly_behind_the_first_is_one(bus):
    bus.say("02030400030005", 2)
    assert bus.run().last.verdict.value == "answered-twice"


def test_of_two_requests_directly_behind_one_another_both_are_owed(bus):
    bus.say(ONE).say("010300100002", 1).say(VALUES, 4).say(VALUES, 8)
    assert "late" in bus.run().verdicts


def test_the_second_answer_to_what_was_asked_twice_is_late_whatever_came_between(bus):
    bus.say(ONE).say(ONE, 120).say(VALUES, 30).exchange("010400000002", "01040400010002").say(VALUES, 30)
    assert bus.run().last.verdict.value == "late"
