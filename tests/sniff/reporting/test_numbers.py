"""What a report says of a capture: the counts of other commands, the verdict first."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from sniff.reporting.numbers import CLASSES, CaptureNumbers
from tests.sniff.reporting.page_reading import CAPTURES

EACH = ("rtu-usual-faults", "n2-usual-faults", "mstp-usual-faults", "ascii-noisy-ftdi")


@pytest.mark.parametrize("name", EACH)
def test_the_parts_add_up(name: str, numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    numbers = numbers_of(CAPTURES / f"{name}.cap.txt")
    assert sum(part.noise for part in numbers.timeline) == numbers.noise_octets
    assert sum(part.damaged for part in numbers.timeline) == numbers.damaged
    busy = sum(part.load * numbers.part for part in numbers.timeline)
    assert busy == pytest.approx(numbers.load * numbers.seconds, rel=0.05)
    for station in numbers.stations:
        assert sum(count for _, count in station.response.classes) == station.response.count
    assert sum(station.response.count for station in numbers.stations) == numbers.response.count
    assert (numbers.ring is not None) == name.startswith("mstp")


def test_the_verdict_names_what_fails(numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    numbers = numbers_of(CAPTURES / "rtu-usual-faults.cap.txt")
    assert "station 4" in numbers.verdict
    assert numbers.findings[0].severity == "error"
    assert "4 ← read holding" in numbers.findings[0].evidence[0].text
    four = next(station for station in numbers.stations if station.address == 4)
    assert (four.asked, four.answered, four.trouble) == (4, 0, {"no answer": 4})
    assert four.health is not None
    assert four.health.score == 0


def test_a_clean_bus_is_in_good_order(numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    numbers = numbers_of(CAPTURES / "n2-clean.cap.txt")
    assert numbers.verdict == "The bus is in good order."
    assert numbers.health is not None
    assert numbers.health.score == 100


def test_silence_and_rubbish_are_told_apart(tmp_path: Path, numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    head = "#!sniff-capture 1\n# line: 9600,8N1\n# protocol: mstp\n# start: 2026-03-01T10:00:00Z\n"
    silent, rubbish = tmp_path / "silent.cap.txt", tmp_path / "rubbish.cap.txt"
    silent.write_text(head)
    rubbish.write_text(head + "+10 00 FE 80 F8 00 00 C0\n" * 20)
    assert numbers_of(silent).verdict.startswith("Nothing was heard")
    assert numbers_of(silent).health is None
    assert "not one frame" in numbers_of(rubbish).verdict


def test_what_the_adapter_cannot_tell_is_said(tmp_path: Path, numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    limits = " ".join(numbers_of(CAPTURES / "ascii-noisy-ftdi.cap.txt").measurement.limits)
    assert "17.5 ms" in limits
    assert "one flag covers a whole packet" in limits


def test_json_holds_the_same_and_is_json(poll_capture: Path, numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    numbers = numbers_of(poll_capture)
    again = json.loads(json.dumps(numbers.to_json(), allow_nan=False))
    assert again["frames"] == numbers.frames
    assert again["stations"][0]["response"]["p50"] == numbers.stations[0].response.p50
    assert [found["seen"] for found in again["findings"]] == [found.seen for found in numbers.findings]


@pytest.fixture
def poll_capture() -> Path:
    return CAPTURES / "rtu-noisy-ftdi.cap.txt"


def test_classes_ascend() -> None:
    assert all(low < high for low, high in pairwise(CLASSES))
