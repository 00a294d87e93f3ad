"""Exchanges that bear a number: each request is over exactly once, whatever comes."""

from __future__ import annotations

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, FoundBy, Frame, Header, Role
from dissectors.numbered_exchanges import NumberedExchanges
from dissectors.tracker import Transaction, Verdict

S = 1_000_000_000
MOST = 4


def frame(octets: bytes, second: float) -> Frame:
    start = int(second * S)
    return Frame("paper", octets, start, start + 1000, Check.GOOD, FoundBy.LENGTH)


def header(role: Role) -> Header:
    return Header("paper", 1, 2, role, "read")


STEPS = st.lists(st.tuples(st.booleans(), st.integers(0, 6), st.sampled_from((b"a", b"b")), st.integers(0, 15)))


@given(STEPS)
def test_each_request_is_over_exactly_once(steps: list[tuple[bool, int, bytes, int]]) -> None:
    exchanges = NumberedExchanges(10 * S, MOST)
    asked: list[int] = []
    over: list[Transaction] = []
    now = 0
    for no, (asks, number, octets, wait) in enumerate(steps):
        now += wait
        over += exchanges.advance(now * S)
        if asks:
            tx, ended = exchanges.ask(number, no, frame(octets, now), header(Role.REQUEST))
            asked.append(tx)
            over += ended
        else:
            over.append(exchanges.answer(number, no, frame(octets, now), header(Role.RESPONSE)))
        assert sum(exchanges.is_open(one) for one in range(7)) <= MOST
    over += exchanges.close()
    ended_ids = Counter(one.id for one in over)
    assert set(ended_ids.values()) <= {1}
    assert set(asked) == {one.id for one in over if one.request is not None}
    assert all(one.verdict is Verdict.UNSOLICITED for one in over if one.request is None)


def test_the_same_again_is_a_repeat_and_another_is_not() -> None:
    exchanges = NumberedExchanges(10 * S, MOST)
    first, _ = exchanges.ask(7, 1, frame(b"a", 0), header(Role.REQUEST))
    _, (lost,) = exchanges.ask(7, 2, frame(b"a", 1), header(Role.REQUEST))
    assert (lost.id, lost.verdict) == (first, Verdict.NO_RESPONSE)
    closed = exchanges.answer(7, 3, frame(b"x", 1.5), header(Role.RESPONSE))
    assert (closed.verdict, closed.attempt, closed.of) == (Verdict.RETRY, 2, first)
    exchanges.ask(7, 4, frame(b"a", 2), header(Role.REQUEST))
    exchanges.ask(7, 5, frame(b"b", 3), header(Role.REQUEST))
    assert exchanges.answer(7, 6, frame(b"x", 3.5), header(Role.RESPONSE)).verdict is Verdict.ANSWERED


def test_an_answer_may_take_as_long_as_patience_lasts() -> None:
    exchanges = NumberedExchanges(10 * S, MOST)
    exchanges.ask(7, 1, frame(b"a", 5), header(Role.REQUEST))
    exchanges.ask(8, 2, frame(b"b", 6), header(Role.REQUEST))
    end = 5 * S + 1000
    assert exchanges.advance(end + 10 * S) == ()
    (over,) = exchanges.advance(end + 10 * S + 1)
    assert (over.request, over.verdict) == (1, Verdict.NO_RESPONSE)
    assert exchanges.is_open(8)
