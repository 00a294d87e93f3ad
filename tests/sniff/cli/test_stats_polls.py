"""`stats FILE polls`: the master's programme as a table, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Ran = Callable[..., Any]


@pytest.mark.parametrize("protocol", ["rtu", "ascii", "n2", "mstp"])
def test_every_protocol_has_a_programme(sniff485: Ran, protocol: str) -> None:
    name = f"captures/{protocol}-usual-faults.cap.txt"
    ran = sniff485("stats", name, "polls", "--json")
    assert ran.code == 0
    rows = [json.loads(line) for line in ran.out.splitlines()]
    assert rows
    assert sum(row["answered"] for row in rows) > 5
    assert any(row["asks"] for row in rows)
    reference = sniff485("stats", name, "polls", "--json", "--reference")
    assert reference.out == ran.out


def test_properties_are_asked_by_client_device_and_object(sniff485: Ran) -> None:
    out = sniff485("stats", "captures/mstp-usual-faults.cap.txt", "polls", "--json").out
    rows = [json.loads(line) for line in out.splitlines()]
    asked = {(row["src"], row["station"], row["asks"]) for row in rows if row["request"] == "read-property"}
    assert (2, 5, "analog-output/0") in asked
    assert (1, 9, "analog-input/4") in asked


def test_names_where_a_profile_is_said(sniff485: Ran) -> None:
    ran = sniff485("stats", "captures/rtu-clean.cap.txt", "polls", "-d", "*=teco-e510")
    assert ran.code == 0
    assert "output-frequency" in ran.out
    assert " jitter ms" in ran.out.splitlines()[0]


def test_csv_has_all_columns(sniff485: Ran) -> None:
    out = sniff485("stats", "captures/n2-clean.cap.txt", "polls", "--csv").out
    first = next(csv.DictReader(io.StringIO(out)))
    assert list(first)[:4] == ["src", "station", "request", "asks"]
    assert first["first"].startswith("2026-")


def test_a_bus_that_asks_nothing(sniff485: Ran, tmp_path: Path) -> None:
    empty = tmp_path / "nothing.cap.txt"
    whole = Path("captures/rtu-clean.cap.txt").read_text()
    empty.write_text("".join(line for line in whole.splitlines(keepends=True) if line.startswith("#")))
    ran = sniff485("stats", empty, "polls")
    assert ran.code == 0, ran.err
    assert "was asked anything" in ran.out


def test_times_of_several_days_have_their_day(sniff485: Ran, tmp_path: Path) -> None:
    path = tmp_path / "days.cap.txt"
    head = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"
    path.write_text(head + "+43200000 01 03 00 00 00 02 C4 0B\n" * 3)
    assert "03-01 21:59:59  03-02 21:59:59" in sniff485("stats", path, "polls").out
