"""`check` and `rule` as a user runs them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from sniff.bus.capture_writer import create
from sniff.cli import main
from sniff.simulation.scenarios import Scenario, simulate
from tests.faults.buses import modbus


def recorded(plan: Scenario, path: Path, seconds: float = 10) -> str:
    session, items = simulate(plan, seconds)
    with create(path, session) as writer:
        for item in items:
            writer.write(item)
    return str(path)


@pytest.fixture
def absent(tmp_path: Path) -> str:
    return recorded(modbus(absent=(4,), seed=1), tmp_path / "absent.cap.txt")


def test_a_finding_fails_and_is_told_with_its_evidence(absent, capsys):
    assert main(["check", absent]) == 1
    said = capsys.readouterr().out
    assert "ERROR    station 4: no answer  [MB001]" in said
    assert "rows:" in said
    said = " ".join(said.split())  # however wide the terminal is
    assert "station 4: 0 (100% of its requests without answer (−100); finding MB001 (−30))" in said


def test_a_clean_bus_passes(tmp_path, capsys):
    assert main(["check", recorded(modbus(seed=1), tmp_path / "clean.cap.txt")]) == 0
    assert "health 100" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "code"),
    [(["--fail-on", "never"], 0), (["--ignore", "MB"], 0), (["--only", "MB4"], 0), (["--only", "MB001"], 1)],
)
def test_what_fails_can_be_chosen(absent, options, code):
    assert main(["check", absent, *options]) == code


def test_json_is_an_object_a_finding(absent, capsys):
    main(["check", absent, "--json"])
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    first = next(one for one in found if one["code"] == "MB001")
    assert (first["subject"], first["severity"]) == ("station 4", "error")
    assert first["frames"][0]["start_ns"] == first["first_ns"]


def test_junit_fails_the_rules_that_found_something(absent, capsys):
    main(["check", absent, "--format", "junit"])
    suite = ElementTree.fromstring(capsys.readouterr().out).find("testsuite")
    failed = {case.get("name")[:5] for case in suite if case.find("failure") is not None}
    assert failed == {"MB001"}  # the time lost is a consequence
    assert int(suite.get("failures")) == len(failed)
    assert int(suite.get("tests")) == len(suite)


@pytest.fixture
def two_masters(tmp_path: Path) -> str:
    return recorded(modbus(second_master=True, seed=1), tmp_path / "two.cap.txt", 3)


def test_consequences_stand_under_their_cause(two_masters, capsys):
    assert main(["check", two_masters]) == 1
    lines = capsys.readouterr().out.splitlines()
    cause = next(number for number, line in enumerate(lines) if "[MB203]" in line)
    assert any(line.startswith("         └ 3 stations (") for line in lines[cause : cause + 12])
    main(["check", two_masters, "--json"])
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    cause = next(number for number, one in enumerate(found) if one["code"] == "MB203")
    assert found[cause]["cause"] is None
    assert found[cause + 1]["cause"] == {"code": "MB203", "subject": "bus"}
    main(["check", two_masters, "--format", "junit", "--fail-on", "note"])
    suite = ElementTree.fromstring(capsys.readouterr().out).find("testsuite")
    failed = {case.get("name")[:5]: case.find("failure").text for case in suite if case.find("failure") is not None}
    assert "explains " in failed["MB203"]
    assert not {one["code"] for one in found if one["cause"]} & set(failed)


def test_the_exit_code_goes_by_causes(two_masters):
    assert main(["check", two_masters, "--fail-on", "note", "--ignore", "MB4"]) == 1
    assert main(["check", two_masters, "--only", "MB203,MB002", "--fail-on", "error"]) == 1
    assert main(["check", two_masters, "--only", "MB002", "--fail-on", "warning"]) == 0


def test_every_rule_is_explained(capsys):
    assert main(["rule", "LN", "MB", "N2", "MS"]) == 0
    said = capsys.readouterr().out
    assert "consistent with: " in said
    main(["rule", "--json"])
    for line in capsys.readouterr().out.splitlines():
        rule = json.loads(line)
        assert all(rule[key] for key in ("title", "explanation", "means", "next")), rule["code"]


def test_an_unknown_code_is_a_usage_error(absent, capsys):
    assert main(["rule", "XX9"]) == 2
    assert main(["check", absent, "--only", "XX"]) == 2
    assert "no rule has that code" in capsys.readouterr().err


def test_several_captures_are_told_together(poll: Path, sniff485: Any) -> None:
    again = poll.with_name("again.cap.txt")
    again.write_text(poll.read_text())
    ran = sniff485("check", poll, again)
    assert "all 2 captures together:" in ran.out
    together = ran.out.partition("together:")[2]
    assert "in 2 of 2 captures" in together
    assert len(together.strip().splitlines()) >= 2
    assert "together" not in sniff485("check", poll).out


def test_nothing_heard_has_the_time_of_the_capture(sniff485, tmp_path):
    path = tmp_path / "silent.cap.txt"
    path.write_text("#!sniff-capture 1\n# line: 9600,8N1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n")
    found = [json.loads(line) for line in sniff485("check", "--json", path).out.splitlines()]
    assert {one["code"] for one in found} == {"LN001", "LN002"}
    assert {(one["first"], one["last_ns"]) for one in found} == {("2026-03-01T10:00:00.000000000Z", 0)}


def test_what_is_so_for_a_while_is_not_said_of_the_bus(sniff485: Any) -> None:
    path = Path(__file__).parents[3] / "captures" / "findings" / "line-a-drive-still-speaks-bacnet.cap.txt"
    found = {one["code"]: one for one in map(json.loads, sniff485("check", "--json", path).out.splitlines())}
    assert found["LN303"]["means"].endswith("; at those times the bus runs mstp")
