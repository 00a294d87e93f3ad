"""Rings on which nothing is wrong, heard through adapters and by computers that hold reads back: nobody is accused."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from random import Random

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.findings import judge
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.bacnet.simulated import Faults, Poller, SimulatedNode, f510
from dissectors.findings import Severity
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from sniff.engine.session import Item
from sniff.simulation.tap import EXACT, FTDI, OCTETS, UART, Tap, TapModel
from sniff.simulation.wire import Burst, Party, Wire
from tests.dissectors.bacnet.ring_script import Step, data, rounds, script

MS = 1_000_000
LINE = LineSettings(38400)
Host = Callable[[Iterable[Item], Random], Iterator[Item]]


def prompt(items: Iterable[Item], dice: Random) -> Iterator[Item]:
    """A computer that reads at once."""
    yield from items


def held(items: Iterable[Item], dice: Random) -> Iterator[Item]:
    """One that now and then reads nothing for a while, then everything at once."""
    waiting, until = bytearray(), 0
    for item in items:
        assert isinstance(item, Chunk)
        if waiting and item.time > until:
            yield Chunk(until, bytes(waiting))
            waiting.clear()
        if not waiting and item.time >= until and dice.random() < 0.003:
            until = item.time + dice.randrange(5, 80) * MS
        if item.time < until:
            waiting += item.octets
        else:
            yield item
    if waiting:
        yield Chunk(until, bytes(waiting))


def trickling(items: Iterable[Item], dice: Random) -> Iterator[Item]:
    """One that falls behind now and then and catches up read by read."""
    now = 0
    for item in items:
        assert isinstance(item, Chunk)
        if item.time >= now and dice.random() < 0.003:
            now = item.time + dice.randrange(5, 60) * MS
        if item.time >= now:
            yield item
        else:
            yield Chunk(now, item.octets)
            now += 700_000


def ring(slow: bool = False, **more: int) -> list[SimulatedNode]:
    targets = [(5, "analog-input,4", "present-value"), (9, "binary-input,0", "object-name")]
    applications = {2: Poller(targets, every=300 * MS), 5: f510(510), 9: f510(511), 20: None}
    faults = Faults(use_delay=11 * MS, reply_delay=200 * MS) if slow else None
    return [
        SimulatedNode(mac, Timing(LINE), made, max_master=24, faults=faults, **more)
        for mac, made in applications.items()
    ]


@cache
def ran(slow: bool) -> tuple[Burst, ...]:
    """What the ring carried, once for all who hear it."""
    return tuple(Wire(LINE, [Party(str(node.mac), node) for node in ring(slow)]).run(12 * 10**9))


@pytest.mark.parametrize("slow", [False, True])
@pytest.mark.parametrize("host", [prompt, held, trickling])
@pytest.mark.parametrize("tap", [EXACT, FTDI, OCTETS, UART], ids=lambda tap: tap.name)
def test_a_ring_in_order(tap: TapModel, host: Host, slow: bool):
    timing = Timing(LINE, tap.latency(LINE))
    framer, observer = MSTP.framer(timing), MstpRingObserver(timing)
    events = []
    for item in host(Tap(LINE, tap, 1).tap(ran(slow)), Random(3)):
        assert isinstance(item, Chunk)
        events += framer.feed(item)
    for no, event in enumerate(events + framer.close()):
        observer.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    assert [finding for finding in judge(observer.ring()) if finding.severity >= Severity.WARNING] == []


def test_a_router_with_large_extended_frames():
    steps: list[Step] = rounds(5, 1, 5)
    for no in range(40):
        steps += [
            (2, frame(33, 255 if no % 8 == 0 else 5, 1, bytes.fromhex("010010 0a") + bytes(1400))),
            *rounds(3, 1, 5),
        ]
    assert script(steps).graves() == set()


@pytest.mark.parametrize("frames", [1, 5, 20, 50])
def test_any_max_info_frames(frames: int):
    steps: list[Step] = []
    for _ in range(30):
        steps += [*((2.0, data(1, 5, "0100100a" + "5a" * 30)) for _ in range(frames)), *rounds(2, 1, 5)]
    assert script(steps).graves() == set()
