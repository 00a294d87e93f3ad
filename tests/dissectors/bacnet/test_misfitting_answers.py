"""Answers that come at once and that nobody can take: elsewhere (MS312), or with another number (MS313)."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame
from dissectors.findings import with_consequences
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import Timing
from tests.dissectors.bacnet.make_ring_captures import READ, VALUE
from tests.dissectors.bacnet.ring_script import LINE, MS, Step, data, found, poll, rounds, token


def _asked(number: int) -> Step:
    return (2, data(3, 12, f"{READ[:8]}{number:02x}{READ[10:]}", expects=True))


def _value(number: int, to: int = 3, after: float = 6) -> Step:
    return (after, data(12, to, f"{VALUE[:6]}{number:02x}{VALUE[8:]}"))


def _bus(*answers: Step, then: tuple[Step, ...] = ()) -> list[Step]:
    """3 asks 12 so many times, with numbers from 20 on."""
    steps: list[Step] = []
    for at, answer in enumerate(answers):
        steps += [*rounds(3, 3, 12, 19), _asked(20 + at), answer, *then]
    return steps + rounds(3, 3, 12, 19)


def _said(steps: list[Step], latency: float = 0) -> list[tuple[str, str, str]]:
    """What is at least noted, consequences left out: code, subject, words."""
    timing, now = Timing(LINE, int(latency * MS)), 10**18
    framer, tracker, judge = MSTP.framer(timing), MSTP.tracker(timing), MSTP.judge(timing)
    events: list[Event] = []
    for silence, octets in steps:
        now += int(silence * MS) + len(octets) * timing.char
        events += framer.feed(Chunk(now, octets))
    for no, event in enumerate((*events, *framer.close())):
        header = MSTP.peek(event) if isinstance(event, Frame) else None
        tracked = tracker.track(no, event, header)
        judge.see(no, event, header, tracked.placement)
        for transaction in tracked.closed:
            judge.settle(transaction)
    standing = with_consequences(judge.findings(), MSTP.rules)
    return [(one.code, one.subject, one.seen) for one in standing if one.cause is None]


_WAITS: tuple[Step, ...] = ((260, token(3, 12)), (2, token(12, 19)), (2, token(19, 3)))
_LETS_GO: tuple[Step, ...] = (
    *((510.0 if to == 4 else 24.0, poll(3, to)) for to in range(4, 13)),
    (3, found(12, 3)),
    *rounds(1, 3, 12, 19),
)


@pytest.mark.parametrize("latency", [0, 1, 16.5])
@pytest.mark.parametrize(("to", "whom"), [(255, "everybody"), (19, "MAC 19"), (40, "MAC 40")])
@pytest.mark.parametrize("then", [(), _WAITS, _LETS_GO], ids=["goes on", "waits", "lets go"])
def test_the_answer_goes_elsewhere(to: int, whom: str, then: tuple[Step, ...], latency: float) -> None:
    """Neither has anybody a second token, nor does the tap miss a thing, nor is who asked at fault."""
    said = _said(_bus(*(_value(20 + at, to) for at in range(6)), then=then), latency)
    assert said == [("MS312", "MAC 12", f"answered 6 times to {whom} instead of who had asked it")]


@pytest.mark.parametrize("latency", [0, 16.5])
@pytest.mark.parametrize(("number", "count", "of"), [(0, 6, 20), (20, 5, 21)])
def test_the_number_is_of_no_open_request(number: int, count: int, of: int, latency: float) -> None:
    said = _said(_bus(*(_value(number) for _ in range(6))), latency)
    seen = f"answered {count} times with the invoke id of no open request, first {number} for {of}"
    assert said == [("MS313", "MAC 12", seen)]


@pytest.mark.parametrize(
    "steps",
    [
        _bus(*(_value(19 + at) for at in range(6))),  # one answer behind: each is that of an open request
        [*rounds(3, 3, 12, 19), _asked(19), (6, frame(7, 3, 12)), *_bus(*(_value(19 + at) for at in range(6)))],
        _bus(*(_value(number) for number in (20, 0, 22, 0, 24))),  # twice is no habit
        _bus(*((2, token(3, 12)) for _ in range(6))),
    ],
)
def test_what_is_none_of_both(steps: list[Step]) -> None:
    assert not {code for code, _, _ in _said(steps)} & {"MS312", "MS313"}
