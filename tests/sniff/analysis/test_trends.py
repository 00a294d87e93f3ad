"""How values went: rows and tables say the same, and what is thinned keeps its shape."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.profiles import Devices
from dissectors.profiles.packaged import packaged
from sniff.analysis.trends import MOST_VALUES, Trend, Trends
from sniff.bus.offline import survey
from sniff.engine.follow_settings import dissector_for
from sniff.formats import read
from tests.sniff.cli.test_profile_draft import meter

CAPTURES = Path(__file__).parents[3] / "captures"
NAMES = ("rtu-usual-faults", "ascii-usual-faults", "n2-usual-faults", "mstp-clean", "rtu-noisy-ftdi")


def trends(path: Path, devices: Devices, reference: bool) -> list[Trend]:
    capture = read(path)
    made = Trends(dissector_for(capture.session), devices)
    survey(capture, capture.session, made, reference=reference)
    return made.moved(99)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("devices", [Devices(), Devices(default=packaged("teco-e510"))], ids=["plain", "described"])
def test_tables_say_what_rows_say(name: str, devices: Devices) -> None:
    path = CAPTURES / f"{name}.cap.txt"
    assert trends(path, devices, True) == trends(path, devices, False)


def test_a_described_value_has_its_name_and_unit() -> None:
    moved = trends(CAPTURES / "rtu-usual-faults.cap.txt", Devices(default=packaged("teco-e510")), False)
    assert ("1", "output-frequency", "Hz", "") in [(one.station, one.name, one.unit, one.how) for one in moved]


def test_registers_of_nobody_are_the_numbers_that_they_are_guessed_to_be(tmp_path: Path) -> None:
    capture = tmp_path / "meter.cap.txt"
    meter(capture)
    moved = {one.name: one for one in trends(capture, Devices(), False)}
    volts = moved["input/30001"]
    assert volts.how == "guessed f32 low word first: sensor (sure)"
    assert all(220 < value < 240 for value in volts.values)
    assert "input/30002" not in moved


def test_many_values_are_thinned_evenly() -> None:
    trend = Trend("1", "a")
    for time in range(100_000):
        trend.add(time, float(time))
    assert MOST_VALUES // 2 <= len(trend.values) <= MOST_VALUES
    steps = {later - before for before, later in zip(trend.times, trend.times[1:], strict=False)}
    assert len(steps) == 1
