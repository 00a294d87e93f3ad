"""From a live bus to outlets: each value, or the newest of a point at its pace; the last one always."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.live import LiveBus
from sniff.capture.ipc import Ended, HeardOctets, ReceivedMessage, Tick
from sniff.engine.blocks import Block, reads_of
from sniff.engine.session import LineEvent, LineEventKind
from sniff.outlets.teller import Teller
from sniff.outlets.told import FindingTold, NumbersTold, StateTold, Told, ValueTold
from tests.property.modbus_adus import rtu
from tests.sniff.bus.given_link import GivenLink

MS = 1_000_000


class Heardall:
    """Keeps what it is told."""

    def __init__(self, every: int = 0) -> None:
        self.every = every
        self.got: list[Told] = []

    def tell(self, things: object) -> None:
        self.got += things  # type: ignore[operator]

    def values(self) -> list[object]:
        return [one.sample.value.value for one in self.got if isinstance(one, ValueTold)]

    def of(self, kind: type) -> list:
        return [one for one in self.got if isinstance(one, kind)]


def read(at: int, value: int) -> list[Chunk]:
    """A register is read, at ms."""
    return [
        Chunk(at * MS, rtu(bytes((1, 3, 0, 0, 0, 1)))),
        Chunk((at + 3) * MS, rtu(bytes((1, 3, 2, value >> 8, value & 255)))),
    ]


def told(outlets: list[Heardall], messages: list, now: int = 9000) -> LiveBus:
    link = GivenLink([*messages, Ended("done")], paths=["x"])
    link.clock = SimpleNamespace(now=lambda: now * MS)  # type: ignore[attr-defined]
    link.line = LineSettings.parse("115200,8N1")
    live = LiveBus(link, watched=False)  # type: ignore[arg-type]
    Teller(outlets).attach(live)
    to_the_end(live)
    return live


def to_the_end(live: LiveBus) -> None:
    """A poll takes only so long: on a busy machine it takes several."""
    while live.ended is None:
        live.poll_tables()


def heard(chunks: list[Chunk]) -> HeardOctets:
    return HeardOctets(0, Block(reads_of(chunks)))


def test_one_gets_each_value_the_other_the_newest_at_its_pace_and_the_last() -> None:
    each, seldom = Heardall(), Heardall(every=1_000 * MS)
    messages = []
    for turn in range(20):
        messages += [heard(read(100 * turn, turn)), Tick(0, (100 * turn + 90) * MS)]
    told([each, seldom], messages)
    assert each.values() == list(range(20))
    assert seldom.values()[-1] == 19
    assert len(seldom.values()) <= 4


def test_numbers_come_each_second_and_nobody_is_told_twice() -> None:
    outlet = Heardall()
    messages = []
    for turn in range(40):
        messages += [heard(read(100 * turn, 1)), Tick(0, (100 * turn + 90) * MS)]
    told([outlet], messages)
    assert len([one for one in outlet.of(NumbersTold) if one.station is None]) in (3, 4)
    codes = [one.news.finding.code for one in outlet.of(FindingTold)]
    assert len(codes) == len(set(codes))


def test_a_port_that_goes_and_comes_is_told_and_the_end_too() -> None:
    outlet = Heardall()
    events = [
        ReceivedMessage(0, LineEvent(100 * MS, LineEventKind.UNPLUGGED, "x: gone")),
        ReceivedMessage(0, LineEvent(200 * MS, LineEventKind.REPLUGGED, "x: back")),
    ]
    told([outlet], events)
    assert [one.listening for one in outlet.of(StateTold)] == [True, False, True, False]


@pytest.mark.parametrize(("now", "codes"), [(9_000, set()), (90_000, {"LN002"})])
def test_that_nothing_is_heard_is_told_when_somebody_has_listened_for_a_while(now: int, codes: set[str]) -> None:
    outlet = Heardall()
    messages: list = []
    for turn in range(1, 9):
        messages += [
            ReceivedMessage(0, LineEvent(turn * 1000 * MS, LineEventKind.NOTE, "")),
            Tick(0, turn * 1000 * MS),
        ]
    live = told([outlet], messages, now)
    assert live.now == 8000 * MS
    assert {one.news.finding.code for one in outlet.of(FindingTold)} - {"LN001"} == codes
    assert {one.topic for one in live.link.told} >= {"/bus/bus0"}  # type: ignore[attr-defined]
    assert {json.loads(one.data)["name"] for one in live.link.told if one.topic == "/findings"} - {"LN001"} == codes  # type: ignore[attr-defined]


def test_what_goes_into_a_recording_is_the_same_with_a_listener() -> None:
    def recorded(outlets: list[Heardall]) -> list[tuple]:
        messages = []
        for turn in range(20):
            messages += [heard(read(100 * turn, turn)), Tick(0, (100 * turn + 90) * MS)]
        link = GivenLink([*messages, Ended("done")], paths=["x"])
        link.clock = SimpleNamespace(now=lambda: 9000 * MS)  # type: ignore[attr-defined]
        live = LiveBus(link, watched=False)  # type: ignore[arg-type]
        if outlets:
            Teller(outlets).attach(live)
        to_the_end(live)
        return [one for one in link.told if one.topic.startswith("/values")]

    alone = recorded([])
    assert alone
    assert recorded([Heardall()]) == alone
