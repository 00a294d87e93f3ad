"""Which requests follow which: one master has one order, and whoever comes between has none."""

from __future__ import annotations

import random

import numpy as np
import pytest

from dissectors.modbus import poll_order
from dissectors.modbus.poll_order import Asked, PollOrder

ONE: Asked = (1, ("read", 0))
TWO: Asked = (2, ("read", 0))
PANEL: Asked = (2, ("read", 300))


def ordered(asked: list[Asked]) -> PollOrder:
    order = PollOrder()
    for each in asked:
        order.add(each)
    return order


def test_what_always_comes_next_is_usual_in_that_order_alone():
    order = ordered([ONE, TWO, PANEL] * 5)
    assert order.is_usual(ONE, TWO)
    assert not order.is_usual(TWO, ONE)


def test_whoever_comes_between_is_not_where_others_are_as_a_rule():
    order = ordered(([ONE, TWO] * 4 + [PANEL]) * 5)
    assert not order.is_usual(TWO, PANEL)  # though it always comes there: another comes there more often
    assert not order.is_usual(PANEL, ONE)
    assert order.is_usual(ONE, TWO)


def test_twice_is_no_habit():
    assert not ordered([ONE, TWO, ONE, TWO]).is_usual(ONE, TWO)


@pytest.mark.parametrize("seed", range(20))
def test_many_at_once_teach_what_each_teaches_wherever_nobody_looks(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("_ALL", 50), ("_SOME", 7), ("_EVERY", 40)):
        monkeypatch.setattr(poll_order, name, value)
    dice = random.Random(seed)
    asked = [dice.choice([ONE, TWO, PANEL]) for _ in range(400)]
    at_once, at = PollOrder(), 0
    while at < len(asked):
        part = asked[at : at + dice.choice([1, 3, 20, 90])]
        at += len(part)
        if at_once.looks_at(len(part)):
            each = list(dict.fromkeys(part))
            at_once.add_all(np.array([each.index(one) for one in part]), each)
        else:
            at_once.skip(len(part))
    assert at_once == ordered(asked)


def test_another_poll_list_is_learnt_after_a_night_too():
    order = ordered([ONE, TWO] * 50_000 + [ONE, TWO, PANEL] * 90_000)
    assert order.is_usual(TWO, PANEL)
