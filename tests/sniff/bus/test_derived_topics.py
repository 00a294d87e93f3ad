"""The messages a second that go back into a recording: windows add up to the whole, keys are those of the schemas."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from dissectors import registry
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_observer import MstpRingObserver
from dissectors.line import LineSettings
from dissectors.simulated_faults import LostResponse
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.judging import Judging
from sniff.bus.derived_topics import BUS, NODE, BusChannels
from sniff.bus.model import BusModel
from sniff.bus.offline import outputs
from sniff.devices import noted_devices
from sniff.editing.cutting import around_finding
from sniff.engine.engine import Output
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.recording.topics import SCHEMAS
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import EXACT
from tests.faults.buses import modbus

CAPTURES = Path(__file__).parents[3] / "captures" / "findings"
S = 10**9
Told = list[tuple[str, dict[str, Any]]]


def told(session: Any, items: Any) -> tuple[Told, MstpRingObserver, int]:
    """All messages but findings, what the ring was in all, and the number of frames."""
    dissector = registry.get(session.protocol)
    model = BusModel(session, dissector)
    channels, ring, frames, messages = BusChannels(model), MstpRingObserver(session.timing), 0, []
    now = 0
    for item in outputs(items, session):
        if not isinstance(item, Output):
            model.add_line_event(item)
            continue
        for row in item.rows:
            ring.see(row.no, row.event, row.header)
            frames += row.header is not None
            now = row.event.end
        model.add(item)
        channels.add(item)
        messages += channels.due(now)
    messages += channels.due(now + 10 * S)
    known = {BUS: BUS, NODE: NODE}
    kept = [(one.topic, json.loads(one.data), one.schema) for one in messages if one.schema in known]
    for _, content, schema in kept:
        properties = json.loads(SCHEMAS[schema].text)["properties"]
        assert content.keys() <= properties.keys()
        for key, value in content.items():
            assert isinstance(value, int | float)
            assert properties[key]["type"] == "number" or isinstance(value, int), key
    return [(topic, content) for topic, content, _ in kept], ring, frames


def total(messages: Told, topic: str, key: str) -> int:
    return sum(content.get(key, 0) for at, content in messages if at == topic)


def test_windows_of_a_ring_add_up() -> None:
    session, items = simulate(scenario("mstp", seed=4), 30, EXACT)
    messages, observer, frames = told(session, items)
    ring = observer.ring()
    bus = f"/bus/{session.bus}"
    assert total(messages, bus, "frames") == frames
    assert total(messages, bus, "tokens") == sum(edge.tokens for edge in ring.edges.values()) > 500
    lost = sum(one.count for (what, _), one in ring.happened.items() if what is RingEventKind.LOST_TOKEN)
    assert total(messages, bus, "tokens_lost") == lost > 0
    for mac, node in ring.nodes.items():
        topic = f"/nodes/{session.bus}/{mac}"
        assert total(messages, topic, "tokens") == node.tokens_received
        assert total(messages, topic, "postponed") == (node.postponed if node.is_master else 0)
    last = [content for topic, content in messages if topic == bus][-1]
    assert last["ring_masters"] == len(ring.order) == 4
    assert 5 < last["loop_p50_ms"] < 100
    assert 0 <= last["poll_waste"] <= 1


def test_a_bus_without_tokens_says_nothing_of_them() -> None:
    session, items = simulate(modbus((LostResponse(0.2, ("unit 2",)),), seed=2), 20, EXACT)
    messages, _, frames = told(session, items)
    assert total(messages, f"/bus/{session.bus}", "frames") == frames
    assert not any("tokens" in content for _, content in messages)
    assert total(messages, f"/nodes/{session.bus}/2", "errors") > 0
    assert min(content["health"] for topic, content in messages if topic.endswith("/2")) < 100


@pytest.mark.parametrize("name", ["modbus-rtu", "n2", "mstp"])
def test_nothing_between_windows(name: str) -> None:
    session, _ = simulate(scenario(name, seed=1), 1, EXACT)
    channels = BusChannels(BusModel(session, registry.get(session.protocol)))
    assert channels.due(5 * S) == []
    assert channels.due(5 * S + S - 1) == []
    assert [one.topic for one in channels.due(6 * S)] == [f"/bus/{session.bus}"]


def test_words_of_a_finding_are_harmless_whatever_an_event_says() -> None:
    session, _ = simulate(scenario("modbus-rtu", seed=1), 1, EXACT)
    judging = Judging(session, registry.get(session.protocol))
    for _ in range(20):
        judging.add_line_event(LineEvent(S, LineEventKind.ERRORS, "\x1b[2J\u202eparity", 40))
    said = [finding for finding in judging.findings() if "parity" in finding.seen]
    assert said
    assert all(word.isprintable() for finding in said for word in (finding.seen, finding.means, finding.subject))


def test_findings_about_known_devices_are_told_everywhere() -> None:
    capture = read(CAPTURES / "drive-told-too-much.cap.txt")
    session, devices = capture.session, noted_devices(capture.session)
    dissector = registry.get(session.protocol)
    model = BusModel(session, dissector, devices)
    channels = BusChannels(model)
    observe(outputs(capture.items(), session), model)
    assert "PR001" in {finding.code for finding in model.findings()}
    assert any(json.loads(one.data)["name"] == "PR001" for one in channels.findings(S))
    assert around_finding(capture, session, "PR001")


def test_that_nothing_is_heard_is_told_nobody_before_it_was_listened_for_a_while() -> None:
    """A bus that begins is not silent: no outlet and no recording says so, nor is its health less."""
    session = Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu")
    model = BusModel(session, registry.get(session.protocol))
    early = True
    model.is_early = lambda: early
    channels = BusChannels(model)
    assert not [one for one in channels.findings(0) if b"LN002" in one.data]
    assert model.health().bus.score == 100
    early = False
    assert [one for one in channels.findings(0) if b"LN002" in one.data]
    assert model.health().bus.score < 100


def test_a_second_in_which_only_an_answer_was_missed_is_no_good_one() -> None:
    session = Session("x", LineSettings(), "modbus-rtu")
    channels = BusChannels(BusModel(session, registry.get("modbus-rtu")))
    channels.due(S)
    missed = Transaction(1, 3, "read", 1, None, Verdict.NO_RESPONSE, 0, S)
    channels.add(Output((), (missed,)))
    bus, node = (json.loads(one.data) for one in channels.due(2 * S))
    assert (bus["frames"], bus["errors"], bus["error_rate"]) == (0, 1, 1.0)
    assert (node["requests"], node["errors"], node["error_rate"]) == (1, 1, 1.0)
