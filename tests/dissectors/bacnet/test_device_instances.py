"""Two stations that say they are the same device (MS502), and what only looks like it."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet import MSTP
from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import Timing
from tests.dissectors.bacnet.ring_script import LINE, MS, Step, data, rounds, token


def _i_am(mac: int, instance: int, network: tuple[int, str] | None = None) -> bytes:
    behind = "0100" if network is None else f"0108{network[0]:04x}{len(network[1]) // 2:02x}{network[1]}"
    return data(mac, 255, f"{behind}1000c4{8 << 22 | instance:08x}2201e09103215d")


def _said(steps: Iterable[Step]) -> list[Finding]:
    timing, now = Timing(LINE), 10**18
    framer, judge = MSTP.framer(timing), MSTP.judge(timing)
    events: list[Event] = []
    for silence, octets in steps:
        now += int(silence * MS) + len(octets) * timing.char
        events += framer.feed(Chunk(now, octets))
    for no, event in enumerate((*events, *framer.close())):
        judge.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    return [one for one in judge.findings() if one.code == "MS502"]


def test_two_stations_with_one_instance() -> None:
    says: list[Step] = [(2, token(3, 7)), (2, _i_am(7, 88)), (2, token(7, 9)), (2, _i_am(9, 88)), (2, token(9, 3))]
    (found,) = _said([*says, *rounds(2, 3, 7, 9)])
    assert found.severity is Severity.WARNING
    assert found.seen == "I-Am of MAC 7 and MAC 9 as device 88"


def test_of_several_instances_it_is_said_once() -> None:
    steps = [(2.0, _i_am(mac, 88 + no)) for no in range(5) for mac in (7, 9, 7)]
    (found,) = _said(steps)
    assert "as device 88; of MAC 7 and MAC 9 as device 89" in found.seen
    assert found.seen.endswith("and 2 more")


def test_a_device_that_got_another_address() -> None:
    steps = [*rounds(2, 3, 7), (2, token(3, 7)), (2, _i_am(7, 88)), (2, token(7, 3)), *rounds(3, 3, 9)]
    (found,) = _said([*steps, (2, token(3, 9)), (2, _i_am(9, 88)), (2, token(9, 3)), *rounds(3, 3, 9)])
    assert found.severity is Severity.NOTE
    assert found.seen.endswith("one after the other")


def test_two_stations_behind_routers() -> None:
    here, there = (2, _i_am(1, 88, (12, "05"))), (2, _i_am(1, 88, (13, "2c")))
    (found,) = _said([here, there, here])
    assert found.seen == "I-Am of network 12:5 and network 13:44 as device 88"


def test_one_station_seen_on_several_ways() -> None:
    assert not _said([(2.0, _i_am(1, 88, (net, "05"))) for net in (12, 13, 12)])
    assert not _said([(2, _i_am(5, 88)), (2, _i_am(1, 88, (12, "05"))), (2, _i_am(5, 88))])
    assert not _said([(2.0, _i_am(mac, 88, (12, "0a000005bac0"))) for mac in (1, 2, 1)])


def test_a_number_that_nobody_has_yet() -> None:
    assert not _said([(2.0, _i_am(mac, 4194303)) for mac in (7, 9, 7, 9)])
