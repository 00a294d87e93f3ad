"""`stats FILE load`: a second of which the capture covers a part is divided by that part."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.line import LineSettings
from sniff.analysis.load import Load, Second
from sniff.cli import stats

CHAR = 11 / 9600
HEAD = "#!sniff-capture 1\n# line: 9600,8E1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"
FRAME = "01 03 00 00 00 02 C4 0B"


def rows(sniff485: Callable[..., Any], tmp_path: Path, gaps: list[float]) -> list[dict[str, Any]]:
    path = tmp_path / "a.cap.txt"
    path.write_text(HEAD + "".join(f"+{gap} {FRAME}\n" for gap in gaps))
    info = json.loads(sniff485("info", path, "--json").out)
    found = [json.loads(line) for line in sniff485("stats", path, "load", "--json").out.splitlines()]
    return [info, *found]


def test_a_short_capture_has_the_load_that_info_says(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    info, only = rows(sniff485, tmp_path, [20, 100, 100])
    assert only["load_percent"] == pytest.approx(100 * info["load"], rel=1e-3)
    assert only["load_percent"] > 10


def test_whole_seconds_are_divided_by_a_second(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    _, *seconds = rows(sniff485, tmp_path, [20, *[100] * 28])
    middle = seconds[1]
    assert middle["load_percent"] == pytest.approx(100 * 10 * 8 * CHAR, rel=0.1)


def test_a_frame_over_the_boundary_counts_in_both_seconds(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    info, *seconds = rows(sniff485, tmp_path, [500, 503])  # the second frame ends 3 ms after the full second
    assert len(seconds) == 2
    whole = sum(row["octets"] for row in seconds)
    assert whole == info["octets"] == 16
    assert seconds[0]["load_percent"] > 2.5  # of half a second: one frame, and most of another
    assert [row["heard_s"] for row in seconds] == [pytest.approx(0.509, abs=1e-3), pytest.approx(0.003, abs=1e-3)]


def test_how_much_of_a_row_was_heard_stands_beside_its_load(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    _, *seconds = rows(sniff485, tmp_path, [900, *[100] * 12])
    assert [row["heard_s"] for row in seconds] == [pytest.approx(0.109, abs=1e-3), 1, pytest.approx(0.1, abs=1e-3)]


def test_what_was_not_heard_is_said(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "away.cap.txt"
    poll = "+990 01 03 00 00 00 02 C4 0B\n+10 01 03 04 00 07 00 01 8A 32\n"
    head = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"
    away = "#! +1 unplugged x is gone (hung up)\n#! +600001 replugged x is back\n+600500 01 03 00 00 00 02 C4 0B\n"
    path.write_text(head + 10 * poll + away + 10 * poll)
    told = json.loads(sniff485("info", path, "--json").out)
    assert told["unheard_seconds"] == 600
    assert told["load"] == pytest.approx(348 * 11 / 19200 / (told["seconds"] - 600), rel=1e-4)
    assert ", 10.0 min of it not heard)" in sniff485("info", path).out


def test_a_table_for_people_is_no_row_a_second(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    path.write_text(HEAD + f"+20 {FRAME}\n" + f"+7000 {FRAME}\n" * 40)  # 280 s
    ran = sniff485("stats", path, "load")
    assert [line.split()[0][11:19] for line in ran.out.splitlines()[1:4]] == ["10:00:00", "10:00:05", "10:00:10"]
    assert ran.err == ""
    assert len(sniff485("stats", path, "load", "--csv").out.splitlines()) == 1 + 41


def test_seconds_that_are_not_kept_are_said(capsys: pytest.CaptureFixture[str]) -> None:
    load = Load(LineSettings.parse("9600,8E1"), seconds={12: Second(), 13: Second()}, first=10**10, last=13 * 10**9)
    stats._say_forgotten(load)
    assert "before 1970-01-01T00:00:12.000000000Z" in capsys.readouterr().err
