"""Replies that are postponed and never come (MS311), of stations and of those behind routers."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame
from dissectors.findings import Severity
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import Timing
from dissectors.tracker import Verdict
from tests.dissectors.bacnet.make_ring_captures import READ, VALUE
from tests.dissectors.bacnet.ring_script import LINE, MS, Step, data, rounds, token

_BEHIND = "012407d30109ff" + READ[4:]
_SILENCE: list[Step] = [(400.0 + at % 2, token(*pair)) for at in range(13) for pair in ((3, 9), (9, 3))]
"""Ten seconds of a slow ring."""


def _read(steps: list[Step]) -> tuple[list[tuple[str, Severity, str]], list[Verdict]]:
    timing, now = Timing(LINE), 10**18
    framer, tracker, judge = MSTP.framer(timing), MSTP.tracker(timing), MSTP.judge(timing)
    events: list[Event] = []
    for silence, octets in steps:
        now += int(silence * MS) + len(octets) * timing.char
        events += framer.feed(Chunk(now, octets))
    verdicts = []
    for no, event in enumerate((*events, *framer.close())):
        header = MSTP.peek(event) if isinstance(event, Frame) else None
        tracked = tracker.track(no, event, header)
        judge.see(no, event, header, tracked.placement)
        for transaction in tracked.closed:
            judge.settle(transaction)
            if transaction.kind == "read-property":
                verdicts.append(transaction.verdict)
    return [(one.code, one.severity, one.seen) for one in judge.findings() if one.code == "MS311"], verdicts


def _asked(number: int, *then: Step, ask: str = READ) -> list[Step]:
    asked = ask.replace("00030" + "1", f"0003{number:02x}")
    return [(2, data(3, 9, asked, expects=True)), (5, frame(7, 3, 9)), (2, token(3, 9)), *then, (2, token(9, 3))]


def _value(number: int) -> Step:
    return (2, data(9, 3, VALUE[:6] + f"{number:02x}" + VALUE[8:]))


@pytest.mark.parametrize(("count", "severity"), [(1, Severity.NOTE), (3, Severity.WARNING)])
def test_answers_that_never_come(count: int, severity: Severity) -> None:
    steps = [step for number in range(count) for step in _asked(number)]
    found, verdicts = _read([*rounds(2, 3, 9), *steps, *_SILENCE])
    what = "1 request" if count == 1 else f"{count} requests"
    assert found == [("MS311", severity, f"never answered {count} of {what} that it had postponed")]
    assert verdicts == [Verdict.NO_RESPONSE] * count


def test_answers_that_come_with_the_token() -> None:
    steps = [step for number in range(3) for step in _asked(number, _value(number))]
    assert _read([*rounds(2, 3, 9), *steps, *_SILENCE]) == ([], [Verdict.ANSWERED] * 3)


def test_a_few_of_many_may_not_have_been_heard() -> None:
    many = [step for number in range(60) for step in _asked(number, *(() if number in (7, 31) else (_value(number),)))]
    found, _ = _read([*rounds(2, 3, 9), *many, *_SILENCE])
    assert found == [("MS311", Severity.NOTE, "never answered 2 of 60 requests that it had postponed")]


def test_a_router_does_not_promise_for_itself() -> None:
    steps = [step for number in range(3) for step in _asked(number, ask=_BEHIND)]
    found, verdicts = _read([*rounds(2, 3, 9), *steps, *_SILENCE])
    assert not found
    assert Verdict.NO_RESPONSE in verdicts


def test_an_answer_that_came_damaged_was_sent() -> None:
    silence, octets = _value(0)
    spoilt = octets[:-1] + bytes((octets[-1] ^ 1,))
    assert _read([*rounds(2, 3, 9), *_asked(0, (silence, spoilt)), *_SILENCE]) == ([], [Verdict.NO_RESPONSE])
