"""Real traffic through framer, peek and tracker: every exchange is found, none is inverted."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.functions import FUNCTIONS

MS = 1_000_000


def track(chunks, timing, name="modbus-rtu"):
    dissector = registry.get(name)
    framer, tracker = dissector.framer(timing), dissector.tracker(timing)
    events = [event for chunk in chunks for event in framer.feed(chunk)] + framer.close()
    placements, closed = [], []
    for no, event in enumerate(events, 1):
        tracked = tracker.track(no, event, dissector.peek(event) if isinstance(event, Frame) else None)
        placements.append(tracked.placement)
        closed += tracked.closed
    return events, placements, closed + list(tracker.close()), tracker


def chunks_of(lines, timing):
    """A chunk a frame, at the time that its source gives (s)."""
    for line in lines:
        start = round(float(line.label) * 1e9)
        yield Chunk(start + len(line.octets) * timing.char, line.octets)


@pytest.mark.parametrize(
    ("name", "line", "frames"),
    [
        ("sigrok-brainchild-io16do", "19200,8E1", 30),
        ("sigrok-flowmeter-graph_tool", "9600,8N1", 18),
        ("sigrok-flowmeter-target_0liter_per_min", "9600,8N1", 112),
        ("sigrok-flowmeter-target_20liter_per_min", "9600,8N1", 66),
    ],
)
@pytest.mark.parametrize("latency", [0, 2 * MS, 17 * MS])
def test_logic_analyser_captures(name, line, frames, latency, shared):
    timing = Timing(LineSettings.parse(line), latency)
    events, placements, transactions, _ = track(chunks_of(shared(name), timing), timing)
    assert len([event for event in events if isinstance(event, Frame)]) == frames
    verdicts = Counter(transaction.verdict.value for transaction in transactions)
    assert verdicts == {"answered": frames // 2}
    assert [placement.role.value for placement in placements] == ["request", "response"] * (frames // 2)


@pytest.mark.parametrize("name", ["modbus-rtu-omega-cn7500", "modbus-rtu-delta-dtb4824"])
def test_recorded_pairs(name, shared):
    """Without times of their own: 5 ms to the answer, 50 ms to the next request."""
    timing = Timing(LineSettings.parse("19200,8N1"))
    now, chunks = 0, []
    for line in shared(name):
        now += (5 if " rsp " in f" {line.note} " else 50) * MS + len(line.octets) * timing.char
        chunks.append(Chunk(now, line.octets))
    events, placements, transactions, _ = track(chunks, timing)
    assert [placement.role.value for placement in placements] == ["request", "response"] * (len(events) // 2)
    assert {transaction.verdict.value for transaction in transactions} == {"answered"}
    assert {transaction.error for transaction in transactions} == {None}


def test_a_battery_that_is_asked_at_one_address_and_answers_from_another(shared):
    timing = Timing(LineSettings.parse("9600,8N1"))
    now, chunks = 0, []
    for line in shared("modbus-rtu-daly-ess"):
        now += (10 if line.octets[0] == 0x51 else 100) * MS + len(line.octets) * timing.char
        chunks.append(Chunk(now, line.octets))
    _, placements, transactions, tracker = track(chunks, timing)
    verdicts = Counter(transaction.verdict.value for transaction in transactions)
    assert verdicts == {"no-response": 109, "unsolicited": 110, "open": 1}
    assert [placement.role.value for placement in placements] == ["request", "response"] * 110
    answers = [transaction for transaction in transactions if transaction.verdict.value == "unsolicited"]
    assert {answer.error for answer in answers} == {"unit 81 answered a request to unit 129"}
    assert {answer.latency.nominal for answer in answers} == {10 * MS}
    assert tracker.timeout is None, "a master that goes on after such an answer has not timed out"


@pytest.mark.parametrize("kind", ["GOOD", "WRONG"])
def test_vectors_of_a_master_library(kind, shared):
    """Each pair on a bus of its own, the answer after 5 ms: good pairs are answered; wrong ones are not, or say why."""
    lines = shared("vectors-minimalmodbus-rtu")
    timing = Timing(LineSettings.parse("19200,8N1"))
    seen = 0
    for request, answer in pairwise(lines):
        if request.label.split(".")[0] != answer.label.split(".")[0] or f"{kind}_RTU" not in request.note:
            continue
        if request.octets[1] not in FUNCTIONS:
            continue  # what is wrong with an invented function only its inventor knows
        seen += 1
        end = len(request.octets) * timing.char
        chunks = [Chunk(end, request.octets), Chunk(end + 5 * MS + len(answer.octets) * timing.char, answer.octets)]
        _, _, transactions, _ = track(chunks, timing)
        verdicts = [transaction.verdict.value for transaction in transactions]
        if kind == "GOOD" and "wrong" not in request.note:
            assert verdicts in (["answered"], ["exception"]), request.note
        else:
            assert verdicts != ["answered"] or transactions[0].error, request.note
    assert seen > 5
