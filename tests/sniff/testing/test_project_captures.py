"""The project's own captures: each finding has one, each protocol has those that the documentation promises."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from sniff.analysis.judging import all_rules
from sniff.testing.naming import expectation_path, is_capture
from tests.faults import make_captures
from tests.faults.case import Said
from tests.faults.cases import CASES

CAPTURES = Path(__file__).parents[3] / "captures"
FINDING = re.compile(r"(?P<code>[A-Z][A-Z0-9]\d{3}) (?P<severity>info|note|warning|error): ")
ALL = sorted(path for path in CAPTURES.rglob("*") if is_capture(path))


@dataclass(slots=True)
class Expected:
    """What an expectation says, as far as these tests ask."""

    protocol: str
    noise: int
    lines: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))

    @property
    def findings(self) -> list[tuple[str, str]]:
        matches = [FINDING.match(line) for line in self.lines["findings"]]
        assert all(matches), "a finding that these tests cannot read"
        return [(match["code"], match["severity"]) for match in matches if match is not None]

    @property
    def healthy(self) -> bool:
        return not any(severity in ("warning", "error") for _, severity in self.findings)


def expected(capture: Path) -> Expected:
    text = expectation_path(capture).read_text(encoding="utf-8")
    octets = re.search(r"^# .* (\d+) octets of noise$", text, re.MULTILINE)
    assert octets is not None
    found = Expected(text.splitlines()[1].split()[1], int(octets[1]))
    section = ""
    for line in text.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        elif line:
            found.lines[section].append(line)
    return found


@pytest.fixture(scope="module")
def readings() -> dict[str, Expected]:
    return {path.name: expected(path) for path in ALL}


def test_every_capture_has_its_expectation() -> None:
    assert ALL
    assert [path.name for path in ALL if not expectation_path(path).exists()] == []


def test_every_rule_has_a_capture_that_shows_it(readings: dict[str, Expected]) -> None:
    shown = {code for reading in readings.values() for code, _ in reading.findings}
    for told in (CAPTURES / "sites").glob("*.check.txt"):  # what several buses say together
        shown |= set(re.findall(r"^\S.* \[(SB\d+)\]$", told.read_text(encoding="utf-8"), re.MULTILINE))
    assert sorted(set(all_rules()) - shown) == [], "make one: a case in tests/faults, then tests.faults.make_captures"
    assert sorted(shown - set(all_rules())) == [], "expectations name rules that are no more"


def test_every_case_of_the_matrix_has_a_capture_that_shows_what_it_is_about() -> None:
    for case in CASES:
        path = CAPTURES / "findings" / make_captures.file_name(case)
        assert path.exists(), f"{case.name}: run python -m tests.faults.make_captures captures/findings {case.name!r}"
        codes = {code for code, _ in expected(path).findings}
        for one in case.expect:
            wanted = one.codes if isinstance(one, Said) else one[:1]
            assert not wanted or codes & set(wanted), path.name


@pytest.mark.parametrize("protocol", ["modbus-rtu", "modbus-ascii", "n2", "mstp"])
def test_each_protocol_clean_noisy_and_with_exceptions(protocol: str, readings: dict[str, Expected]) -> None:
    mine = {name: reading for name, reading in readings.items() if reading.protocol == protocol}
    clean = {name: reading for name, reading in mine.items() if "clean" in name}
    assert clean
    assert all(reading.healthy and not reading.noise for reading in clean.values())
    noisy = [reading for name, reading in mine.items() if "noisy" in name]
    assert noisy
    assert all(reading.noise for reading in noisy)
    assert any(": exception after " in line for reading in mine.values() for line in reading.lines["transactions"])


@pytest.mark.parametrize("name", ["drive trips", "clock stepped", "silent bus", "N2 station resets"])
def test_a_capture_made_again_is_the_same(name: str, tmp_path: Path) -> None:
    make_captures.make(tmp_path, [name])
    (made,) = tmp_path.iterdir()
    assert made.read_text(encoding="utf-8") == (CAPTURES / "findings" / made.name).read_text(encoding="utf-8")
