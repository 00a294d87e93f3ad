"""convert to .csv and .parquet gives the table that show gives."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import pytest

CAPTURE = Path(__file__).parents[3] / "captures" / "rtu-usual-faults.cap.txt"


def test_csv_is_what_show_gives(tmp_path: Path, sniff485: Callable) -> None:
    target = tmp_path / "x.csv"
    ran = sniff485("convert", CAPTURE, target)
    assert ran.code == 0
    assert "rows" in ran.err
    assert target.read_text() == sniff485("show", CAPTURE, "--csv").out
    assert sniff485("convert", CAPTURE, target).code == 2
    assert sniff485("convert", CAPTURE, target, "-f", "--link-type", "147").code == 2


@pytest.mark.skipif(importlib.util.find_spec("polars") is None, reason="polars is not here")
def test_parquet_is_what_show_gives(tmp_path: Path, sniff485: Callable) -> None:
    import polars as pl

    first, second = tmp_path / "x.parquet", tmp_path / "y.parquet"
    assert sniff485("convert", CAPTURE, first).code == 0
    assert sniff485("show", CAPTURE, "--parquet", second).code == 0
    assert pl.read_parquet(first).equals(pl.read_parquet(second))


def test_a_damaged_capture_gives_what_came_before(tmp_path: Path, sniff485: Callable) -> None:
    source, target = tmp_path / "a.cap.txt", tmp_path / "x.csv"
    source.write_text("# line: 19200,8E1\n# protocol: modbus-rtu\n+0 01 03 00 00 00 02 C4 0B\n+9 0G\n")
    assert sniff485("convert", source, target).code == 3
    assert target.read_text().count("\n") == 2
