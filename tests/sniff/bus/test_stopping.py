"""A capture that is asked to end, or has ended, is not looked at for ever: a second of all buses together."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS
from sniff.bus import live as live_module
from sniff.bus.live import LATE_MOST, TO_THE_END, LiveBus
from sniff.bus.router import Router
from sniff.capture.ipc import Ended, Message, ReceivedMessage
from tests.sniff.bus.given_link import GivenLink

READ = bytes.fromhex("01030000 0002C40B") * 125  # 1000 octets
BUSES = 3


class Clock:
    """Each look at it costs a twentieth of a second."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        self.now += 0.05
        return self.now


def flood(bus: int, reads: int) -> list[Message]:
    return [ReceivedMessage(bus, Chunk(at * MS, READ)) for at in range(reads)]


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(live_module, "time", made)
    return made


def test_buses_share_the_second_that_is_left(clock: Clock) -> None:
    link: Any = GivenLink([message for bus in range(BUSES) for message in flood(bus, 500)])
    router = Router(link)
    lives = [LiveBus(link, bus, router=router) for bus in range(BUSES)]
    for one in lives:
        one.poll()
    before = [one.model.summary.octets for one in lives]
    link.over_since = clock.now
    link.messages.append(Ended("stopped"))
    for one in lives:
        one.poll()
    assert all(one.model.summary.octets > seen for one, seen in zip(lives, before, strict=True)), "each had its turn"
    for one in lives:
        while one.ended is None:
            one.poll()
        assert one.model.summary.octets + one.unseen == 500 * len(READ), "what is not looked at is counted"
        assert one.unseen


def test_the_last_octets_of_a_capture_that_takes_its_time_are_looked_at(clock: Clock) -> None:
    link: Any = GivenLink()
    one = LiveBus(link)
    link.over_since = clock.now - 2 * TO_THE_END
    link.messages = [*flood(0, LATE_MOST // len(READ)), Ended("stopped")]
    while one.ended is None:
        one.poll()
    assert (one.unseen, one.model.summary.octets) == (0, LATE_MOST // len(READ) * len(READ))
