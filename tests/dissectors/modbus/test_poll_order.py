"""Which requests follow which: one master has one order, and whoever comes between has none."""

from __future__ import annotations

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
