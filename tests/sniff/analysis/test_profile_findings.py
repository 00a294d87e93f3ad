"""The rules PR…: each raised by what it is about, none by a healthy drive."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dissectors import registry
from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from dissectors.profiles.decoding import decode
from dissectors.profiles.packaged import packaged, parse_text
from dissectors.readings import Origin, Reading
from sniff.analysis.health import health_of
from sniff.analysis.judging import Judging
from sniff.analysis.point_reader import Sample
from sniff.analysis.profile_findings import ProfileFindings
from sniff.analysis.profile_rules import PROFILE_RULES
from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.simulation.scenarios import scenario, simulate

E510 = Devices(default=packaged("teco-e510"))
ACN = Devices({1: packaged("automationdirect-acn")})


def load(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bus = load("points_bus")


def judged(
    *exchanges: tuple[str, str | None], devices: Devices = E510, latency: float = 8.0, held: int = 0
) -> tuple[Finding, ...]:
    session = replace(bus.SESSION, adapter=replace(bus.SESSION.adapter, latency=held))
    judge = ProfileFindings(session.timing, dissector_for(session), devices)
    for output in bus.run(bus.chunks(*exchanges, latency=latency), session):
        for row in output.rows:
            judge.see(row.no, row.event, row.header, row.placement)
        for transaction in output.transactions:
            judge.settle(transaction)
    return judge.findings()


def brief(findings: Iterable[Finding]) -> list[tuple[str, str, str]]:
    return [(finding.code, finding.subject, finding.seen) for finding in findings]


@pytest.mark.parametrize(
    ("exchange", "expected"),
    [
        (
            ("01062502ffff", "018604"),
            [("PR001", "drive 1", "frequency command 655.35 Hz written, range 0 … 599 Hz")],
        ),
        (
            ("010325020001", "010302ffff"),
            [("PR001", "drive 1", "frequency command 655.35 Hz answered, range 0 … 599 Hz")],
        ),
        (("010625080001", "018604"), [("PR002", "drive 1", "1 written to reserved 2508h")]),
        (
            ("010625240001", "018604"),
            [("PR003", "drive 1", "output frequency (2524h) written, though it is read only")],
        ),
        (("010325210001", "0103020011"), [("PR004", "drive 1", "fault: code 17, external fault 01")]),
        (("010325210001", "01030200ff"), [("PR004", "drive 1", "fault: code 255, not in the manual")]),
        (("010325280001", "0103020009"), [("PR005", "drive 1", "alarm: code 9, UT")]),
        (("010325210001", "0103020000"), []),
        (("010600640001", "018602"), []),
        (("010601021770", "010601021770"), []),
    ],
)
def test_each_rule(exchange: tuple[str, str], expected: list[tuple[str, str, str]]) -> None:
    assert brief(judged(exchange)) == expected


def test_trip_bits_of_the_acn() -> None:
    found = judged(("0103032f0002", "010304040008 08".replace(" ", "")[:14]), devices=ACN)
    assert brief(found) == [
        ("PR004", "drive 1", "latched trips 1: overcurrent trip"),
        ("PR004", "drive 1", "latched trips 2: fan trip"),
    ]


def test_the_acns_reserved_span() -> None:
    assert brief(judged(("010604000001", "018602"), devices=ACN)) == [
        ("PR002", "drive 1", "1 written to reserved 0401h")
    ]


def test_a_frame_that_is_too_long() -> None:
    values = "0000" * 40
    found = judged((f"0110250100 28 50 {values}", "018603"))
    assert ("PR006", "drive 1", "frames of 89 octets to it, 80 allowed") in brief(found)
    assert "PR006" not in {finding.code for finding in judged(("01030000 0023", "010346" + "0000" * 35))}


@pytest.mark.parametrize(("latency", "held", "slow"), [(8, 0, False), (30, 0, True), (30, 16, True), (20, 16, False)])
def test_slowness_is_judged_by_what_the_adapter_allows(latency: float, held: int, slow: bool) -> None:
    found = judged(("010325240001", "0103020000"), latency=latency, held=held * 1_000_000)
    assert [finding.code for finding in found] == (["PR007"] if slow else [])
    if slow:
        assert found[0].seen.startswith("1 of 1 answers took over 10.0 ms, the slowest at least")
        assert found[0].severity is Severity.NOTE


def test_findings_add_up_and_carry_evidence() -> None:
    found = judged(*[("010325210001", "0103020011")] * 3, ("010325210001", "0103020002"))
    assert [(f.code, f.count, f.evidence) for f in found] == [("PR004", 3, (2, 4, 6)), ("PR004", 1, (8,))]
    assert found[0].seen == "fault: code 17, external fault 01, 3 times"
    assert found[0].first < found[0].last


def test_what_is_not_the_same_each_time_is_told_of_the_first() -> None:
    found = judged(*[(f"01062502{value}", f"01062502{value}") for value in ("ffff", "fffe", "ffff")])
    assert [one.seen for one in found if one.code == "PR001"] == [
        "frequency command 655.35 Hz written, range 0 … 599 Hz; that is the first of 3 times"
    ]


@pytest.mark.parametrize("number", [math.nan, math.inf, 1e30, 0.5, 2])
def test_what_is_no_code_is_no_fault(number: float) -> None:
    profile = packaged("teco-f510")
    reading = Reading("binary-input", 2, 0x7FC00000, number, Origin.READ)
    (value,) = (one for one in decode(profile, [reading]) if not one.bit)
    judge = ProfileFindings(bus.SESSION.timing, registry.get("mstp"), Devices(default=profile))
    judge._judge_value(Sample(0, 5, value, 1))
    assert {one.code for one in judge.findings()} <= {"PR001"}
    judge._judge_value(Sample(0, 5, replace(value, value=1), 2))
    assert "PR004" in {one.code for one in judge.findings()}


def test_no_profile_no_finding() -> None:
    assert judged(("01062502ffff", "018604"), devices=Devices({2: packaged("teco-e510")})) == ()


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.analysis.device_remarks.MOST_TOLD", 1)
    assert len(judged(("010625080001", "018604"), ("010625090001", "018604"))) == 1


def test_rules_are_complete() -> None:
    for code, rule in PROFILE_RULES.items():
        assert code == rule.code
        assert rule.explanation
        assert rule.means
        assert rule.next


@pytest.mark.parametrize("name", ["modbus-rtu", "modbus-ascii", "n2", "mstp"])
def test_a_simulated_bus_without_faults(name: str) -> None:
    """What the scenario does on purpose is found, nothing else: a read-only write, a value of 900 Hz, slow drives."""
    plan = scenario(name, faults=False)
    session, items = simulate(plan, 12 if name == "mstp" else 40)
    devices = Devices({address: packaged(profile) for address, profile in plan.devices.items()})
    judging = Judging(session, dissector_for(session), devices)
    for output in outputs(items, session):
        if isinstance(output, Output):
            judging.add(output)
    found = {finding.code for finding in judging.findings() if finding.code.startswith("PR")}
    meant = {
        "modbus-rtu": {"PR003", "PR007"},
        "modbus-ascii": {"PR003", "PR007"},
        "n2": {"PR001", "PR007", "PR010"},  # the master releases what this drive does not release
        "mstp": set(),
    }
    assert found <= meant[name]
    assert name == "mstp" or found


@pytest.mark.parametrize(
    ("devices", "exchange", "words", "severity"),
    [
        (E510, ("010625010001", "018605"), "exception 5 (write mode error)", Severity.WARNING),
        (E510, ("010625020001", "018604"), "exception 4 (data setting error)", Severity.WARNING),
        (Devices({2: packaged("teco-e510")}), ("010625240001", "018605"), "exception 5 (acknowledge)", Severity.NOTE),
        (None, ("010625240001", "018605"), "exception 5 (acknowledge)", Severity.NOTE),
        (ACN, ("010625240001", "018606"), "exception 6 (slave device busy)", Severity.NOTE),
    ],
)
def test_the_makers_words_for_an_exception_stand_before_the_standard(
    devices: Devices | None, exchange: tuple[str, str], words: str, severity: Severity
) -> None:
    judging = Judging(bus.SESSION, dissector_for(bus.SESSION), devices)
    for output in bus.run(bus.chunks(exchange, latency=8.0), bus.SESSION):
        judging.add(output)
    (finding,) = (finding for finding in judging.findings() if finding.code == "MB008")
    assert finding.seen.startswith(words)
    assert finding.severity is severity
    assert ("later" in finding.means) == ("acknowledge" in words)


@pytest.mark.parametrize(
    ("devices", "exchange", "expected"),
    [
        (E510, ("010325200001", "0103020009"), [("PR004", "drive 1", "status: fault")]),
        (E510, ("010325200001", "0103020011"), [("PR005", "drive 1", "status: warning")]),
        (E510, ("010325200001", "0103020001"), []),
        (ACN, ("010303040001", "0103028000"), [("PR004", "drive 1", "operation state: condition fault")]),
        (ACN, ("010303040001", "0103024001"), [("PR005", "drive 1", "operation state: condition warning")]),
        (ACN, ("010303040001", "0103020031"), []),
    ],
)
def test_a_status_word_tells_of_faults_and_warnings(
    devices: Devices, exchange: tuple[str, str], expected: list[tuple[str, str, str]]
) -> None:
    assert brief(judged(exchange, devices=devices)) == expected


def test_the_status_word_adds_nothing_to_the_code() -> None:
    found = judged(("010325200001", "0103020008"), ("010325210001", "0103020011"))
    assert brief(found) == [("PR004", "drive 1", "fault: code 17, external fault 01")]


F510 = packaged("teco-f510")


@pytest.mark.parametrize(
    ("space", "address", "code"),
    [("BI", 3, "PR004"), ("BI", 4, "PR005"), ("binary-input", 2, "PR004")],
)
@pytest.mark.parametrize("sure", [True, False])
def test_objects_tell_of_faults_and_warnings(space: str, address: int, code: str, sure: bool) -> None:
    session = bus.SESSION
    judge = ProfileFindings(session.timing, dissector_for(session), Devices(default=F510))
    for state in (0, 1):
        reading = Reading(space, address, state, state, Origin.READ, sure=sure)
        (value,) = decode(F510, (reading,))
        judge._judge_value(Sample(10, 1, value, 1))
    (found,) = judge.findings()
    assert (found.code, found.subject, found.severity) == (
        code,
        "drive 1",
        PROFILE_RULES[code].severity if sure else Severity.NOTE,
    )


def test_health_counts_what_devices_tell() -> None:
    session = bus.SESSION
    dissector = dissector_for(session)
    summary, judging = Summary(session.line), Judging(session, dissector, E510)
    for output in bus.run(bus.chunks(*[("010325210001", "0103020011")] * 3), session):
        summary.add(output)
        judging.add(output)
    health = health_of(summary, judging.findings())
    assert health.stations[1].reasons[-1] == "finding PR004 (−30)"
    assert health.bus.score == (100 + health.stations[1].score) // 2


def test_bits_that_must_be_zero_are_written_as_zero() -> None:
    (found,) = judged(("010625013001", "010625013001"))
    assert (found.code, found.subject) == ("PR008", "drive 1")
    assert found.seen == "operation command (2501h) written with reserved bits C D set"
    assert not judged(("010625010001", "010625010001"))


def test_a_function_that_the_manual_does_not_list_is_noted() -> None:
    (found,) = judged(("010425200001", "01840100"[:6]))
    assert (found.code, found.severity) == ("PR009", Severity.NOTE)
    assert found.seen == "asked with function 04 (hex); its manual lists 03 06 08 10"
    assert not judged(("010325200001", "0103020000"))


@pytest.mark.parametrize(
    ("station", "profile", "codes"),
    [
        (248, "teco-e510", []),
        (254, "teco-e510", []),
        (255, "teco-e510", ["PR012"]),
        (251, "automationdirect-acn", ["PR012"]),
        (250, "automationdirect-acn", []),
        (248, None, ["MB205"]),
    ],
)
def test_a_device_has_the_numbers_of_its_manual(station: int, profile: str | None, codes: list[str]) -> None:
    devices = None if profile is None else Devices(default=packaged(profile))
    session = bus.SESSION
    judging = Judging(session, dissector_for(session), devices)
    at = f"{station:02X}"
    for output in bus.run(bus.chunks((f"{at}03 2520 0001", f"{at}03 02 0005")), session):
        judging.add(output)
    assert [one.code for one in judging.findings() if one.code in ("PR012", "MB205")] == codes


def test_a_number_of_several_registers_is_written_once() -> None:
    """A write of both words of one number is one write."""
    document = """
name = "meter"
title = "Meter"
protocols = ["modbus-rtu"]
[[modbus.register]]
address = 0x10
name = "energy"
access = "r"
type = "u32"
"""
    found = judged(("0110001000020400000005", "011000100002"), devices=Devices(default=parse_text(document, "meter")))
    assert brief(found) == [("PR003", "device 1", "energy (0010h) written, though it is read only")]


def test_who_writes_the_display_selection_of_a_drive_is_not_accused() -> None:
    assert brief(judged(("01102510000204000000ff", "011025100002"))) == []


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        ("0103020006", []),
        ("0103020007", [("PR011", "drive 1", "0300h is 0007h, AutomationDirect ACN drive has 0006h")]),
    ],
)
def test_a_device_that_says_it_is_another(answer: str, expected: list[tuple[str, str, str]]) -> None:
    assert brief(judged(("010302ff0001", answer), devices=ACN)) == expected


RUNS, STANDS, SAVE = ("010303040001", "0103020031"), ("010303040001", "0103020000"), ("010603df0001", "010603df0001")
STOP = ("010603810002", "010603810002")


@pytest.mark.parametrize(
    ("exchanges", "told"),
    [
        ((RUNS, SAVE), True),
        ((RUNS, RUNS, SAVE), True),
        ((SAVE,), False),  # nobody knows
        ((STANDS, SAVE), False),
        ((RUNS, STANDS, SAVE), False),
        ((RUNS, STOP, SAVE), False),  # it was told to stop
        ((RUNS, *(("010303100001", "0103020000"),) * 100, SAVE), False),  # ten seconds later
    ],
)
def test_what_is_written_while_the_drive_runs(exchanges: tuple[tuple[str, str], ...], told: bool) -> None:
    found = [finding for finding in judged(*exchanges, devices=ACN) if finding.code == "PR013"]
    assert [finding.seen for finding in found] == [
        "save parameters (03E0h) written while its state was forward; it is taken while stopped"
    ] * told


@pytest.mark.parametrize(
    ("command", "found"),
    [
        ("01230103" + "41200000", [("PR003", "drive 1", "AO 1 written by write-attribute, which does not change it")]),
        ("01720301" + "41200000", []),
        ("01230101" + "00", []),  # its configuration
    ],
)
def test_the_value_of_an_output_takes_an_override_to_change(command: str, found: list[tuple[str, str, str]]) -> None:
    n2 = registry.get("n2")
    session = Session("x", LineSettings.parse("9600,8N1"), "n2")
    judge = ProfileFindings(session.timing, n2, Devices(default=packaged("teco-f510")))
    items = [Chunk(10**9, n2.makers["n2"](text=command)), Chunk(10**9 + 20_000_000, b"A\r")]
    for output in outputs(items, session):
        assert isinstance(output, Output)
        for row in output.rows:
            judge.see(row.no, row.event, row.header, row.placement)
        for transaction in output.transactions:
            judge.settle(transaction)
    assert brief(judge.findings()) == found
