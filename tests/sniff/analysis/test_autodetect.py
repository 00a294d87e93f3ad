"""The search for settings: real stations' traffic, heard bit by bit by a receiver with whatever settings are wanted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from random import Random

import pytest

from dissectors import registry
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.analysis.autodetect import (
    DWELL,
    FOUND_BITS,
    FOUND_FRAMES,
    CandidateEvidence,
    Candidature,
    Detecting,
    Ending,
    bits_of,
    candidates,
)
from sniff.simulation.collision import low_times, receive
from sniff.simulation.scenarios import bursts, scenario
from sniff.simulation.wire import Burst

ALL = ("parity", "framing", "break")
RATES = (9600, 19200, 38400, 57600, 76800, 115200)


@cache
def traffic(protocol: str, line: LineSettings, faults: bool = False, seconds: float = 12) -> tuple[Burst, ...]:
    """What stations of a protocol say on a line."""
    return tuple(burst for burst in bursts(scenario(protocol, 1, faults, line), seconds) if burst.octets)


def heard(burst: Burst, line: LineSettings, wanted: LineSettings) -> Chunk:
    """What a receiver set to `wanted` makes of octets sent with `line`."""
    if wanted == line:
        return Chunk(burst.ends[-1], bytes(burst.octets), tuple(burst.marks))
    got = receive(wanted, low_times(line, burst.ends[0] - line.char, burst.octets, {}))
    return Chunk(burst.ends[-1], got.octets, got.marks)


def search(
    protocol: str,
    line: LineSettings,
    lines: tuple[LineSettings, ...] | None = None,
    reports: tuple[str, ...] = ALL,
    faults: bool = False,
) -> tuple[Detecting, list[LineSettings]]:
    """Run a search to its end; with the settings that it listened with, in order."""
    detecting = Detecting(lines or candidates(), registry.names(), 0, reports)
    asked = [detecting.wanted]
    for burst in traffic(protocol, line, faults):
        chunk = heard(burst, line, detecting.wanted)
        detecting.feed(chunk if reports else replace(chunk, marks=()))
        if detecting.wanted != asked[-1]:
            asked.append(detecting.wanted)
        if detecting.found is not None:
            break
    return detecting, asked


@pytest.mark.parametrize("form", ["8N1", "8E1", "8O1"])
@pytest.mark.parametrize("baud", RATES)
def test_every_rate_and_parity_is_found(baud: int, form: str) -> None:
    line = LineSettings.parse(f"{baud},{form}")
    detecting, asked = search("modbus-rtu", line)
    outcome = detecting.outcome()
    assert outcome.ending is Ending.FOUND
    assert outcome.reading is not None
    assert (outcome.reading.line, outcome.reading.protocol) == (line, "modbus-rtu")
    assert outcome.reading.bits >= FOUND_BITS
    assert len(asked) < 20


@pytest.mark.parametrize(
    ("protocol", "token"),
    [
        ("mstp", "38400,8N1"),
        ("mstp", "9600,8N1"),
        ("n2", "9600,8N1"),
        ("n2", "19200,8O1"),
        ("modbus-ascii", "9600,7E1"),
        ("modbus-ascii", "38400,7O1"),
        ("modbus-ascii", "19200,8N1"),
        ("modbus-ascii", "4800,7E1"),
        ("modbus-rtu", "2400,8E1"),
    ],
)
def test_every_protocol_is_found(protocol: str, token: str) -> None:
    reading = search(protocol, LineSettings.parse(token))[0].outcome().reading
    assert reading is not None
    assert (str(reading.line), reading.protocol) == (token, protocol)


@pytest.mark.parametrize("protocol", ["modbus-rtu", "mstp", "n2"])
def test_a_bus_with_faults_is_found_too(protocol: str) -> None:
    line = LineSettings.parse("19200,8E1")
    reading = search(protocol, line, faults=True)[0].outcome().reading
    assert reading is not None
    assert (reading.line, reading.protocol) == (line, protocol)


@pytest.mark.parametrize("form", ["8N1", "8E1", "8O1"])
def test_without_line_errors_the_rate_is_found_and_the_doubt_is_said(form: str) -> None:
    line = LineSettings.parse(f"38400,{form}")
    outcome = search("modbus-rtu", line, reports=())[0].outcome()
    assert outcome.reading is not None
    assert outcome.reading.line.baud == 38400
    told = f"{outcome.reading.line} {' '.join(outcome.cannot_tell)}"
    assert all(parity in told for parity in ("8N1", "8E1", "8O1")), "the right one is at least named"


@pytest.mark.parametrize("form", ["8N1", "8E1", "8O1"])
def test_an_adapter_that_marks_whole_packets_will_do(form: str) -> None:
    """FTDI: one error marks every octet of its packet, and parity cannot be told from framing."""
    line = LineSettings.parse(f"38400,{form}")
    detecting = Detecting(candidates(), registry.names(), 0, ALL)
    for burst in traffic("modbus-rtu", line):
        chunk = heard(burst, line, detecting.wanted)
        either = LineError.PARITY | LineError.FRAMING
        marks = tuple(Mark(offset, either) for offset in range(len(chunk.octets))) if chunk.marks else ()
        detecting.feed(replace(chunk, marks=marks))
        if detecting.found is not None:
            break
    assert detecting.found is not None
    assert detecting.found.line == line


def test_stop_bits_are_never_claimed() -> None:
    line = LineSettings.parse("9600,8N2")
    outcome = search("n2", line)[0].outcome()
    assert outcome.reading is not None
    assert str(outcome.reading.line) == "9600,8N1"
    assert any("9600,8N2 from 9600,8N1" in words for words in outcome.cannot_tell)


def test_a_wrong_parity_names_the_right_one() -> None:
    """8N1 hears a parity bit as a stop bit; 8E1 marks everything on an odd line: both lead to 8O1 at once."""
    line = LineSettings.parse("9600,8O1")
    assert [str(one) for one in search("modbus-rtu", line)[1]] == ["9600,8N1", "9600,8O1"]
    lines = tuple(LineSettings.parse(token) for token in ("9600,8E1", "19200,8N1", "9600,8O1"))
    assert [str(one) for one in search("modbus-rtu", line, lines)[1]] == ["9600,8E1", "9600,8O1"]


def test_a_parity_that_marks_everything_is_never_the_answer() -> None:
    line = LineSettings.parse("9600,8O1")
    detecting, _ = search("modbus-rtu", line, (LineSettings.parse("9600,8E1"),))
    assert detecting.found is None


def test_silence_is_not_a_wrong_setting() -> None:
    detecting = Detecting(candidates(), registry.names())
    first = detecting.wanted
    for step in range(1000):
        detecting.advance(step * 100_000_000)
    assert detecting.wanted == first, "silence says nothing about the settings"
    assert detecting.outcome().ending is Ending.SILENT
    assert detecting.outcome().reading is None


@pytest.mark.parametrize("seed", range(3))
def test_noise_is_nothing_and_every_candidate_had_its_turn(seed: int) -> None:
    dice = Random(seed)
    detecting = Detecting(candidates(), registry.names(), 0, ALL)
    turns: Counter[LineSettings] = Counter()
    now = 0
    for _ in range(1500):
        now += dice.randrange(5_000_000, 300_000_000)
        turns[detecting.wanted] += 1
        detecting.feed(Chunk(now, dice.randbytes(dice.randrange(1, 40))))
    outcome = detecting.outcome()
    assert outcome.ending is Ending.UNKNOWN
    assert outcome.reading is None
    assert set(turns) == set(candidates())
    assert outcome.tried == len(candidates())


def test_a_slow_bus_keeps_its_candidate_and_rounds_grow_longer() -> None:
    lines = tuple(LineSettings.parse(token) for token in ("9600,8N1", "19200,8N1"))
    detecting = Detecting(lines, ("modbus-rtu",))
    stays: list[int] = []
    now = since = 0
    while len(stays) < 4:
        now += 500_000_000
        before = detecting.wanted
        detecting.feed(Chunk(now, b"\x12\x34\x56\x29\x47\x95"))
        if detecting.wanted != before:
            stays.append(now - since)
            since = now
    assert all(stay >= DWELL for stay in stays)
    assert stays[2] > 1.5 * stays[0]


def test_rows_of_zeros_and_line_errors_are_left_at_once() -> None:
    line = LineSettings.parse("9600,8N1")
    zeros = CandidateEvidence(line, ("modbus-rtu",), 0)
    zeros.feed(Chunk(1, bytes([0, 0xFF, 0x80, 0xFE, 0, 0xF8] * 5)))
    assert zeros.wrong
    errors = CandidateEvidence(line, ("modbus-rtu",), 0)
    errors.feed(
        Chunk(1, bytes(range(0x41, 0x5F)), tuple(Mark(offset, LineError.FRAMING) for offset in range(0, 30, 2)))
    )
    assert errors.wrong
    plain = CandidateEvidence(line, ("modbus-rtu",), 0)
    plain.feed(Chunk(1, bytes(range(0x41, 0x5F))))
    assert not plain.wrong


def test_what_the_port_cannot_do_is_passed_over() -> None:
    lines = tuple(LineSettings.parse(token) for token in ("9600,8N1", "76800,8N1", "19200,8N1"))
    detecting = Detecting(lines, ("n2",))
    detecting._move()
    assert detecting.wanted == lines[1]
    detecting.refuse()
    assert detecting.wanted == lines[2]
    for _ in range(4):
        detecting._move()
        assert detecting.wanted != lines[1]


def test_few_frames_are_likely_not_found() -> None:
    line = LineSettings.parse("9600,8N1")
    detecting = Detecting((line,), registry.names())
    for burst in traffic("modbus-rtu", line)[:2]:
        detecting.feed(heard(burst, line, line))
    detecting.advance(traffic("modbus-rtu", line)[1].ends[-1] + 50_000_000)
    outcome = detecting.outcome()
    assert outcome.ending is Ending.LIKELY
    assert outcome.reading is not None
    assert outcome.reading.protocol == "modbus-rtu"


def test_the_order_begins_with_the_usual() -> None:
    order = [str(line) for line in candidates()]
    assert order[:4] == ["9600,8N1", "9600,8E1", "19200,8N1", "19200,8E1"]
    assert len(order) == len(set(order))
    wanted = LineSettings.parse("57600,8E1")
    assert candidates(first=[wanted])[0] == wanted
    assert candidates([wanted]) == (wanted,)


def frames(protocol: str) -> Iterator[float]:
    from dissectors.frame import Frame
    from dissectors.line import Timing
    from sniff.engine.engine import Engine

    line = LineSettings.parse("9600,8N1")
    engine = Engine(registry.get(protocol), Timing(line))
    for burst in traffic(protocol, line)[:40]:
        for row in engine.feed(heard(burst, line, line)).rows:
            if isinstance(row.event, Frame):
                yield bits_of(row.event)


@pytest.mark.parametrize("protocol", registry.BUILT_IN)
def test_one_frame_is_never_enough(protocol: str) -> None:
    found = list(frames(protocol))
    assert found
    assert max(found) < FOUND_BITS / 2


def test_what_is_enough() -> None:
    line = LineSettings.parse("9600,8N1")
    good = Candidature(line, "n2", FOUND_BITS, FOUND_FRAMES, 100, 0.9, 0.0)
    assert good.enough
    assert not replace(good, bits=FOUND_BITS - 1).enough
    assert not replace(good, frames=FOUND_FRAMES - 1).enough
    assert not replace(good, covered=0.5).enough, "most of it is no frame of this protocol"
    assert not replace(good, marked=0.2).enough, "every fifth octet came with an error"
