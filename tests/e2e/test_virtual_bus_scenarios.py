"""The named buses in real time, through the capture process: what `demo` shows is what the bus carried."""

from __future__ import annotations

import time
from contextlib import ExitStack

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Frame
from sniff.capture.config import SourceSpec
from sniff.capture.link import CaptureLink
from sniff.capture.wire import Received
from sniff.engine.engine import Engine, Row
from sniff.simulation import scenarios
from sniff.simulation.bus import WHOLE, VirtualBus
from sniff.simulation.ports import HAS_PTY
from sniff.simulation.scenarios import Scenario, scenario
from sniff.simulation.wire import Sent

pytestmark = pytest.mark.skipif(not HAS_PTY, reason="this system has no pseudo-terminals")


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
            time.sleep(seconds)
            truths = [bus.truth() for bus in buses]
            time.sleep(0.2)  # all of that is on its way
            messages = link.stop()
            engines = [
                Engine(registry.get(plan.protocol), link.session(index).timing) for index, plan in enumerate(plans)
            ]
        assert [bus.report().tap_octets for bus in buses] == [0] * len(buses), "the sniffer wrote to a bus"
    rows: list[list[Row]] = [[] for _ in plans]
    for message in messages:
        if isinstance(message, Received) and isinstance(message.item, Chunk):
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
