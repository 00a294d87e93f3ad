"""The named buses in real time, through the capture process: what `demo` shows is what the bus carried."""

from __future__ import annotations

import time
from contextlib import ExitStack

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import NS_PER_S
from sniff.capture.config import SourceSpec
from sniff.capture.ipc import Message, ReceivedMessage
from sniff.capture.link import CaptureLink
from sniff.engine.engine import Engine, Row
from sniff.simulation import scenarios
from sniff.simulation.bus import WHOLE, VirtualBus
from sniff.simulation.ports import HAS_PTY
from sniff.simulation.scenarios import Scenario, scenario
from sniff.simulation.wire import Sent

pytestmark = pytest.mark.skipif(not HAS_PTY, reason="this system has no pseudo-terminals")


PATIENCE = 90
"""s that a busy machine may take."""


def _lasts(truth: list[Sent]) -> float:
    """s from the first to the last that was said."""
    return (truth[-1].end - truth[0].start) / NS_PER_S if truth else 0.0


def _arrived(messages: list[Message], bus: int, truth: list[Sent]) -> bool:
    """Whether as many octets were received as were sent."""
    received = [one.item for one in messages if isinstance(one, ReceivedMessage) and one.bus == bus]
    return sum(len(item.octets) for item in received if isinstance(item, Chunk)) >= sum(len(s.octets) for s in truth)


def listen(plans: list[Scenario], seconds: float) -> list[tuple[list[Row], list[Sent]]]:
    """All buses at once through one capture process: of each the rows of the capture, and the truth."""
    with ExitStack() as stack:
        buses = [stack.enter_context(VirtualBus.from_scenario(plan, WHOLE, paused=True)) for plan in plans]
        sources = [
            SourceSpec(bus.tap(), plan.line, plan.protocol, plan.name) for bus, plan in zip(buses, plans, strict=True)
        ]
        with CaptureLink.start(sources) as link:
            for bus in buses:
                bus.begin()
            messages: list[Message] = []
            truths: list[list[Sent]] = [[] for _ in plans]
            until = time.monotonic() + PATIENCE
            while min(_lasts(truth) for truth in truths) < seconds:
                assert time.monotonic() < until, "a bus stands still"
                messages += link.receive(0.1)
                for truth, bus in zip(truths, buses, strict=True):
                    truth += bus.truth()
            while not all(_arrived(messages, index, truth) for index, truth in enumerate(truths)):
                assert time.monotonic() < until, "what was said did not arrive"
                messages += link.receive(0.1)
            messages += link.stop()
            engines = [
                Engine(registry.get(plan.protocol), link.session(index).timing) for index, plan in enumerate(plans)
            ]
        assert [bus.report().tap_octets for bus in buses] == [0] * len(buses), "the sniffer wrote to a bus"
    rows: list[list[Row]] = [[] for _ in plans]
    for message in messages:
        if isinstance(message, ReceivedMessage) and isinstance(message.item, Chunk):
            rows[message.bus] += engines[message.bus].feed(message.item).rows
    for index, engine in enumerate(engines):
        rows[index] += engine.close().rows
    return list(zip(rows, truths, strict=True))


def good(rows: list[Row]) -> list[bytes]:
    return [row.event.octets for row in rows if isinstance(row.event, Frame) and row.event.ok]


def test_every_frame_of_every_perfect_bus_comes_through() -> None:
    plans = [scenario(name, faults=False) for name in scenarios.names()]
    for plan, (rows, truths) in zip(plans, listen(plans, 2), strict=True):
        sent = [one.octets for one in truths]
        assert len(sent) >= 10, plan.name
        assert good(rows)[: len(sent)] == sent, plan.name
        assert [row.event.octets for row in rows][: len(sent)] == sent, plan.name  # and nothing else between them


def test_faults_come_through_as_they_were() -> None:
    plan = scenario("modbus-rtu-busy", seed=2)
    ((rows, truths),) = listen([plan], 2.5)
    assert sum(bool(one.faults) for one in truths) >= 3
    parties = {party.name for party in plan.stations()}
    meant = [one.octets for one in truths if one.intact and one.party in parties]
    assert good(rows)[: len(meant)] == meant
