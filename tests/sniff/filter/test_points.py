"""Values of points in filters: by name, with units, and several tests of one and the same value."""

from __future__ import annotations

from pathlib import Path

import pytest

from sniff.cli import main

CAPTURES = Path(__file__).parents[3] / "captures"


def rows(capsys: pytest.CaptureFixture[str], text: str, *more: str, capture: str = "rtu-usual-faults") -> list[int]:
    assert main(["show", str(CAPTURES / f"{capture}.cap.txt"), "-T", "fields", "-e", "no", "-Y", text, *more]) == 0
    return [int(line) for line in capsys.readouterr().out.split()]


def test_a_point_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    device = ("-d", "1=teco-e510")
    quick = rows(capsys, "output-frequency > 10 Hz", *device)
    single = rows(capsys, "output-frequency > 10 Hz && len == 7", *device)
    assert single == rows(capsys, "src == 1 && len == 7 && modbus.regnum16 == 9508 && modbus.regval_uint16 > 1000")
    assert len(quick) > 5
    assert rows(capsys, "output-frequency > 10", *device) == quick
    assert rows(capsys, 'point == "output frequency" and value > 10 Hz', *device) == quick
    assert rows(capsys, "value > 10 && point == output-frequency", *device) == quick
    assert rows(capsys, "output-frequency * 2 > 20", *device) == quick
    assert rows(capsys, "output-frequency in {10..60 Hz}", *device) == quick
    every = rows(capsys, "output-frequency", *device)
    assert set(every) > set(quick)
    assert rows(capsys, "point == output-frequency && !(value > 10)", *device) == sorted(set(every) - set(quick))
    assert rows(capsys, "output-frequency != 0 && dst == 1", *device) == []  # the answer tells it


def test_tests_between_and_speak_of_one_value(capsys: pytest.CaptureFixture[str]) -> None:
    device = ("-d", "1=teco-e510")
    fast = rows(capsys, "frequency-command > 59 && src == 1", *device)
    assert fast
    assert rows(capsys, "point == fault && value > 59", *device) == []  # another value of the same frame is so
    assert rows(capsys, "point == fault && point == status", *device) == []
    assert rows(capsys, "point == frequency-command && value > 59 && src == 1", *device) == fast
    assert rows(capsys, 'fault == "no fault"', *device)
    assert rows(capsys, "point == fault && value == no-fault", *device)


def test_points_without_a_profile(capsys: pytest.CaptureFixture[str]) -> None:
    answers = rows(capsys, 'point == "holding/49509" && value > 1000')
    assert answers
    assert set(answers) <= set(rows(capsys, "modbus.regval_uint16 > 1000"))


def test_the_line_that_names_a_device_is_searched(capsys: pytest.CaptureFixture[str]) -> None:
    assert rows(capsys, 'text contains "output frequency"') == []
    assert rows(capsys, 'text contains "output frequency"', "-d", "1=teco-e510")
    assert rows(capsys, '"Output Frequency"', "-d", "1=teco-e510")


def test_answers_have_what_their_request_tells(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(rows(capsys, "modbus.regnum16")) == 105
    assert len(rows(capsys, "n2.value", capture="n2-usual-faults")) == 97
    assert len(rows(capsys, "n2.changed.tentative", capture="n2-usual-faults")) == 12
