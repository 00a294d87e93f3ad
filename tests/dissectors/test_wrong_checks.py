"""Checks that a sender makes wrongly are told from noise, and from octets that are spoilt alike."""

from __future__ import annotations

from random import Random

from hypothesis import given
from hypothesis import strategies as st

from dissectors.wrong_checks import ALIKE, NOT_MADE, SAME, Mistake, Way, WrongChecks

NAMED = Mistake("which is another one")


def seen(rows: list[list[tuple[Way, int]]]) -> WrongChecks:
    checks = WrongChecks()
    for no, ways in enumerate(rows, 1):
        checks.see(no, 1000 * no, ways)
    return checks


def test_what_differs_alike_in_frames_that_say_different_things_is_the_senders():
    checks = seen([[(Way(ALIKE, 7, 12), right)] for right in range(8)])
    habit = checks.habit(8, 0)
    assert habit is not None
    assert habit.mistake == ALIKE
    assert habit.count == 8
    assert checks.habit(8, 1) is None, "a good one: no other start value makes it"
    assert checks.habit(11, 0) is None, "damage of another kind outweighs it"


def test_what_says_the_same_each_time_may_be_spoilt_alike():
    checks = seen([[(Way(ALIKE, 7, 12), 5), (Way(NOT_MADE, 9), 5)]] * 8)
    assert checks.habit(8, 0) is None
    same = checks.same(8)
    assert same is not None
    assert same.mistake == SAME
    assert same.count == 8
    assert seen([[(Way(NOT_MADE, 9), right)] for right in range(8)]).same(8) is None


def test_a_rule_of_its_own_is_named_before_a_difference():
    checks = seen([[(Way(ALIKE, 255), right), (Way(NAMED), right)] for right in range(6)])
    habit = checks.habit(6, 1)
    assert habit is not None
    assert habit.mistake == NAMED, "and is right now and then by chance"


@given(st.integers(0, 1 << 30), st.integers(5, 200))
def test_noise_is_nobodys_rule(seed: int, count: int):
    dice = Random(seed)
    rows = [[(Way(ALIKE, dice.randrange(1, 1 << 16), 12), dice.randrange(1 << 16))] for _ in range(count)]
    checks = seen(rows)
    assert checks.habit(count, 0) is None
    assert checks.same(count) is None


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), max_size=60), st.integers(0, 60))
def test_parts_that_merge_say_what_the_whole_says(rows: list[tuple[int, int]], cut: int):
    each = [[(Way(ALIKE, value, 9), right), (Way(NOT_MADE, value ^ right), right)] for value, right in rows]
    whole, merged = seen(each), seen(each[:cut]).merge(seen(each[cut:]))
    for damaged in (len(rows), 2 * len(rows)):
        one, other = whole.habit(damaged, 0), merged.habit(damaged, 0)
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            assert (one.mistake, one.count) == (other.mistake, other.count)
