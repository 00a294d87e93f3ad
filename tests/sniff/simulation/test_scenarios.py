"""The named buses, as fast as they go: what the engine makes of them against what was really sent."""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings
from dissectors.simulated_faults import (
    BitFlips,
    Break,
    CutShort,
    DuplicateAddress,
    EarlyRelease,
    Echo,
    LateResponse,
    LostResponse,
    MarkParity,
    NoiseInGaps,
)
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Engine, Row
from sniff.engine.session import Session
from sniff.simulation import scenarios
from sniff.simulation.scenarios import Scenario, UnknownScenario, bursts, scenario, simulate
from sniff.simulation.tap import EXACT, FTDI, FTDI_LOW_LATENCY, OCTETS, UART, TapModel
from sniff.simulation.wire import Burst, Sent
from tests.seeds import seeds, some

NAMES = scenarios.names()
QUICK = {
    "modbus-rtu-busy": 2,
    "mstp": 4,
    "profibus": 4,
}
"""Seconds that show enough of a bus with hundreds of frames in each."""


def sniff(plan: Scenario, seconds: float, tap: TapModel = EXACT) -> tuple[list[Row], list[Transaction]]:
    session, items = simulate(plan, seconds, tap)
    engine = Engine(registry.get(plan.protocol), session.timing)
    outputs = [engine.feed(item) for item in items if isinstance(item, Chunk)] + [engine.close()]
    return [row for output in outputs for row in output.rows], [t for output in outputs for t in output.transactions]


@lru_cache(2)
def ran(name: str, seed: int, faults: bool, seconds: float) -> tuple[Burst, ...]:
    """What a bus carried, once for all adapters; each of them hears a run of its own, which must be the same."""
    return tuple(bursts(scenario(name, seed, faults), seconds))


def sent_in(carried: Iterable[Burst]) -> list[Sent]:
    return [sent for burst in carried for sent in burst.sent]


def good(rows: list[Row]) -> list[bytes]:
    return [row.event.octets for row in rows if isinstance(row.event, Frame) and row.event.ok]


def intact(truths: list[Sent], parties: set[str]) -> list[bytes]:
    return [sent.octets for sent in truths if sent.intact and sent.party in parties]


def readings(plan: Scenario, octets: list[bytes]) -> list[bytes]:
    """What was sent, and what else a framer may rightly make of it when something stands directly behind it."""
    if plan.protocol == "modbus-ascii":  # only the line feed was damaged
        return octets + [one.removesuffix(b"\n") for one in octets]
    if plan.protocol == "mstp":  # one filler octet may follow a frame
        return octets + [one + b"\xff" for one in octets]
    if plan.protocol == "profibus":  # a token has no check: two that collide may make a third
        return [*octets, bytes((0xDC, 1, 1)), bytes((0xDC, 2, 2))]
    return octets


def parties(plan: Scenario) -> set[str]:
    names = {party.name for party in plan.stations()}
    return names | {f"{name}'" for name in names} | {f"{name} echo" for name in names}


@pytest.mark.parametrize("tap", some([EXACT, FTDI, OCTETS, UART, FTDI_LOW_LATENCY], 2), ids=lambda tap: tap.name)
@pytest.mark.parametrize("name", NAMES)
def test_on_a_perfect_bus_every_frame_is_found_through_every_adapter(name: str, tap: TapModel) -> None:
    plan = scenario(name, faults=False)
    seconds = QUICK.get(name, 15)
    sent = sent_in(ran(name, 0, False, seconds))
    assert all(one.intact and not one.faults for one in sent)
    rows, _ = sniff(plan, seconds, tap)
    assert [row.event.octets for row in rows] == [one.octets for one in sent]
    assert all(isinstance(row.event, Frame) and row.event.ok for row in rows)


@pytest.mark.parametrize("tap", [EXACT, replace(FTDI, cut=0.2)], ids=["exact", "FTDI, cut"])
@pytest.mark.parametrize("name", NAMES)
def test_with_faults_the_good_frames_are_those_that_arrived_intact(name: str, tap: TapModel) -> None:
    plan = scenario(name, seed=7)
    seconds = 2 * QUICK.get(name, 15)
    carried = ran(name, 7, True, seconds)
    sent = sent_in(carried)
    assert sum(bool(one.faults) for one in sent) >= 5, "the scenario shows nothing"
    rows, _ = sniff(plan, seconds, tap)
    found, meant = Counter(good(rows)), Counter(intact(sent, parties(plan)))
    strange = found - Counter(readings(plan, [one.octets for one in sent]))
    assert not strange, "a good frame that nobody sent"
    assert (meant - found).total() <= meant.total() // 200
    octets = b"".join(row.event.octets for row in rows)
    assert octets == b"".join(burst.octets for burst in carried)


HARSH = (
    BitFlips(2e-3),
    MarkParity(1e-3),
    EarlyRelease(0.05),
    CutShort(0.03),
    LostResponse(0.03),
    LateResponse(0.03, 320_000_000),
    DuplicateAddress("drive 2", 12_000_000, 0.05),
    Echo(("drive 1",), rate=0.05),
    NoiseInGaps(0.15),
    Break(0.02),
)


@pytest.mark.parametrize("seed", seeds(2))
@pytest.mark.parametrize("name", NAMES)
def test_on_a_terrible_bus_nothing_is_made_up_and_hardly_anything_missed(name: str, seed: int) -> None:
    plan = replace(scenario(name, seed), faults=HARSH)
    seconds = 2 * QUICK.get(name, 15)
    carried = tuple(bursts(plan, seconds))
    sent = sent_in(carried)
    rows, _ = sniff(plan, seconds, replace(FTDI_LOW_LATENCY, cut=0.1, jitter=3_000_000))
    found, meant = Counter(good(rows)), Counter(intact(sent, parties(plan)))
    assert not found - Counter(readings(plan, [one.octets for one in sent])), "a good frame that nobody sent"
    assert (meant - found).total() <= meant.total() // 50
    octets = b"".join(row.event.octets for row in rows)
    assert octets == b"".join(burst.octets for burst in carried)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_is_the_same_run(name: str) -> None:
    assert (
        sent_in(bursts(scenario(name, 3), 5))
        == sent_in(bursts(scenario(name, 3), 5))
        != sent_in(bursts(scenario(name, 4), 5))
    )


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_travels_to_another_process_and_says_what_it_is(name: str) -> None:
    plan = scenario(name)
    travelled = pickle.loads(pickle.dumps(plan))
    assert sent_in(bursts(travelled, 2)) == sent_in(bursts(plan, 2))
    assert plan.text
    assert plan.protocol in registry.names()
    assert Session.from_metadata(simulate(plan, 1)[0].to_metadata()) == simulate(plan, 1)[0]


@pytest.mark.parametrize("name", ["modbus-rtu", "modbus-ascii"])
def test_modbus_shows_answers_exceptions_an_absent_unit_and_a_broadcast(name: str) -> None:
    _, transactions = sniff(scenario(name, faults=False), 60)
    verdicts = Counter(t.verdict for t in transactions)
    assert set(verdicts) - {Verdict.OPEN} == {
        Verdict.ANSWERED,
        Verdict.EXCEPTION,
        Verdict.NO_RESPONSE,
        Verdict.BROADCAST,
    }
    assert verdicts[Verdict.ANSWERED] > 400
    assert {t.station for t in transactions if t.verdict is Verdict.NO_RESPONSE} == {4}
    assert {t.station for t in transactions if t.verdict is Verdict.EXCEPTION} == {2}


def test_another_line_may_be_asked_for() -> None:
    plan = scenario("modbus-ascii", line=LineSettings.parse("9600,8N1"))
    session, items = simulate(plan, 2)
    assert str(session.line) == "9600,8N1"
    assert any(isinstance(item, Chunk) and item.octets.startswith(b":0103") for item in items)


def test_times_begin_when_the_capture_is_said_to_have_started() -> None:
    plan = scenario("n2")
    at_zero = list(simulate(plan, 5)[1])
    later = list(simulate(plan, 5, started=10**18)[1])
    assert [replace(item, time=item.time + 10**18) for item in at_zero] == later


def test_an_unknown_name_is_answered_with_those_there_are() -> None:
    with pytest.raises(UnknownScenario, match=r"'modbus'.*modbus-rtu"):
        scenario("modbus")
