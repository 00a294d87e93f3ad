"""Health follows its published formula, gives its reasons, and a bus is not well beside a station that fails."""

from __future__ import annotations

import pytest

from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.tracker import Verdict
from sniff.analysis.health import health_of, station_health, station_of
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.engine.observer import observe
from sniff.engine.session import LineEventKind, Session


def finding(code: str, subject: str, severity: Severity = Severity.ERROR) -> Finding:
    return Finding(code, severity, subject, 0, 0, 1, (), "seen", "means", "next")


def node(address: int, answered: int = 0, **verdicts: int) -> Node:
    made = Node(address, sent=answered, heard=answered)
    made.verdicts[Verdict.ANSWERED] = answered
    for name, count in verdicts.items():
        made.verdicts[Verdict[name.upper()]] = count
    return made


def summary(*nodes: Node) -> Summary:
    made = Summary(LineSettings.parse("19200,8E1"), frames=100, octets=1000)
    made.nodes.nodes.update({one.address: one for one in nodes})
    return made


def test_a_bus_in_order_is_at_100_without_reasons() -> None:
    health = health_of(summary(node(1, 50), node(2, 50)))
    assert (health.bus.score, health.bus.reasons) == (100, ())
    assert {address: one.score for address, one in health.stations.items()} == {1: 100, 2: 100}


@pytest.mark.parametrize(
    ("made", "score", "reason"),
    [
        (node(1, 90, no_response=10), 80, "10% of its requests without answer (−20)"),
        (node(1, 0, no_response=10), 0, "100% of its requests without answer (−100)"),
        (node(1, 90, damaged_answer=10), 70, "10% of its answers damaged (−30)"),
        (node(1, 50, damaged_answer=50), 40, "50% of its answers damaged (−60)"),
        (node(1, 80, retry=20), 80, "20% answered late, twice or after a repeat (−20)"),
        (node(1, 80, exception=20), 90, "20% answered with an exception (−10)"),
    ],
)
def test_each_deduction_of_a_station(made: Node, score: int, reason: str) -> None:
    health = station_health(made)
    assert health is not None
    assert health.score == score
    assert health.reasons == (reason,)


def test_damaged_frames_are_a_share_of_those_that_could_be_its_own() -> None:
    """What other stations sent to it is theirs, also where it is damaged."""
    made = Node(31, sent=40, received=40, damaged=4, heard=36)
    health = station_health(made)
    assert health is not None
    assert health.reasons == ("10% of its frames damaged (−30)",)


def test_a_station_that_was_never_asked_and_sent_nothing_has_none() -> None:
    assert station_health(Node(7)) is None


def test_findings_about_a_station_count_for_it_and_notes_do_not() -> None:
    health = station_health(node(2, 50), [finding("MB201", "station 2"), finding("MB008", "x", Severity.NOTE)])
    assert health is not None
    assert (health.score, health.reasons) == (70, ("finding MB201 (−30)",))


def test_findings_about_the_bus_count_at_most_60() -> None:
    graves = [finding(f"MB20{number}", "bus") for number in range(5)]
    health = health_of(summary(node(1, 50)), graves)
    assert health.bus.score == 40
    assert health.stations[1].score == 100


def test_a_bus_is_at_most_half_way_between_100_and_its_worst_station() -> None:
    stations = [node(address, 100) for address in range(1, 40)]
    health = health_of(summary(*stations, node(40, 0, no_response=4)), [finding("MB001", "station 40")])
    assert health.stations[40].score == 0
    assert health.bus.score == 50
    assert health.bus.reasons[-1] == "station 40 is at 0, so the bus is at 50 at best"


def test_a_station_without_a_finding_does_not_hold_the_bus_down() -> None:
    assert health_of(summary(node(1, 99), node(2, 1, no_response=1))).bus.score == 99


def test_addresses_that_were_only_looked_for_cost_nothing() -> None:
    """A scan asks everywhere; an address that is missed has a finding."""
    scanned = [node(address, 0, no_response=1) for address in range(2, 100)]
    health = health_of(summary(node(1, 50), *scanned))
    assert (health.bus.score, list(health.stations)) == (100, [1])
    missed = health_of(summary(node(1, 50), *scanned), [finding("MB001", "station 7")])
    assert list(missed.stations) == [1, 7]


@pytest.mark.parametrize(
    ("subject", "address"),
    [("station 3", 3), ("MAC 27", 27), ("0 → 27", 27), ("station 1, AI 200", 1), ("bus", None), ("adapter", None)],
)
def test_the_station_that_a_subject_names(subject: str, address: int | None) -> None:
    assert station_of(finding("X", subject)) == address


def test_what_holes_explain_is_nobodys() -> None:
    """Of packets of which only the begin was kept every answer is cut short, and no station is to blame."""
    made = summary(node(1, 40, damaged_answer=8, no_response=2), node(2, 48, damaged_answer=2))
    made.damaged = 10
    made.verdicts[Verdict.DAMAGED_ANSWER] = 10
    assert health_of(made).stations[1].score < 50
    made.events[LineEventKind.DROPPED] = 5
    half = health_of(made)
    assert half.stations[1].reasons == ("8.0% of its answers damaged (−24)",)  # 16 % are, half of them at holes
    made.events[LineEventKind.DROPPED] = 3
    made.events[LineEventKind.UNPLUGGED] = made.events[LineEventKind.REPLUGGED] = 2  # gone and back is one hole
    assert health_of(made) == half
    made.events.clear()
    made.events[LineEventKind.DROPPED] = 10
    health = health_of(made)
    assert (health.bus, {one.score for one in health.stations.values()}) == (health_of(summary(node(1, 50))).bus, {100})
    made.events[LineEventKind.DROPPED], made.events[LineEventKind.NOTE] = 0, 50
    assert health_of(made).stations[1].score < 50


def test_damaged_requests_are_no_damage_of_whom_they_ask() -> None:
    """A master without an address sends them, and the line spoils them."""
    session = Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu")
    asks, answers = bytes.fromhex("010300000002C40B"), bytes.fromhex("01030400010002 2A32")
    items = []
    for turn in range(20):
        octets = asks[:-1] + b"\x0c" if turn % 4 == 0 else asks
        items.append(Chunk((2 * turn + 1) * 100_000_000, octets))
        if octets == asks:
            items.append(Chunk((2 * turn + 1) * 100_000_000 + 12_000_000, answers))
    counted = Summary(session.line)
    observe(outputs(items, session), counted)
    (only,) = counted.nodes.present()
    assert (counted.damaged, only.damaged) == (5, 0)
    health = station_health(only)
    assert health is not None
    assert health.score == 100
