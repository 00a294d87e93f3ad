"""Parquet: the same samples as CSV, instants to the nanosecond, hostile values, damaged captures."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sniff.cli import main
from sniff.engine.capture import CaptureError
from sniff.formats.parquet import Kind, ParquetWriter

CAPTURES = Path(__file__).parents[3] / "captures"
COLUMNS = {"time": Kind.TIME, "text": Kind.TEXT, "value": Kind.NUMBER, "raw": Kind.INTEGER}


@pytest.mark.parametrize(
    ("name", "profile"), [("rtu-clean", "teco-e510"), ("n2-clean", "teco-f510"), ("mstp-clean", "teco-f510")]
)
def test_the_same_samples_as_csv(name: str, profile: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["points", str(CAPTURES / f"{name}.cap.txt"), "-d", f"*={profile}"]
    assert main([*words, "--csv"]) == 0
    expected = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert main([*words, "--parquet", str(tmp_path / "out.parquet")]) == 0
    table = pl.read_parquet(tmp_path / "out.parquet")
    assert len(table) == len(expected) > 1
    for found, wanted in zip(table.to_dicts(), expected, strict=True):
        assert [found["device"], found["point"], found["unit"]] == [wanted["device"], wanted["point"], wanted["unit"]]
        shown = found["text"] if found["value"] is None else found["value"]
        assert str(shown) == wanted["value"] or float(shown) == float(wanted["value"])
    assert table["time"].cast(pl.Int64).is_sorted()
    assert table["time"].dtype == pl.Datetime("ns", "UTC")


@given(
    rows=st.lists(
        st.tuples(st.integers(0, 2**62), st.text() | st.none(), st.floats() | st.none(), st.integers(-(2**70), 2**70)),
        max_size=30,
    )
)
def test_any_value_has_a_place(rows: list[tuple[object, ...]], tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("parquet") / "any.parquet"
    with ParquetWriter(path, COLUMNS) as table:
        for row in rows:
            table.add(row)
    read = pl.read_parquet(path)
    assert read["time"].cast(pl.Int64).to_list() == [row[0] for row in rows]
    assert read["text"].to_list() == [row[1] for row in rows]
    assert read["raw"].to_list() == [row[3] if -(2**63) <= int(str(row[3])) < 2**63 else None for row in rows]


def test_many_batches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.formats.parquet.BATCH", 7)
    with ParquetWriter(tmp_path / "many.parquet", COLUMNS) as table:
        for number in range(100):
            table.add((number, str(number), number / 2, number))
    assert pl.read_parquet(tmp_path / "many.parquet")["raw"].to_list() == list(range(100))


def test_what_came_before_the_damage_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "cut.parquet"

    def write() -> None:
        with ParquetWriter(path, COLUMNS) as table:
            table.add((1, "whole", 1.0, 1))
            raise CaptureError("the rest is damaged")

    with pytest.raises(CaptureError):
        write()
    assert pl.read_parquet(path)["text"].to_list() == ["whole"]


def test_nothing_is_overwritten_and_no_folder_is_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    there = tmp_path / "there.parquet"
    there.write_text("precious")
    capture = str(CAPTURES / "rtu-clean.cap.txt")
    assert main(["points", capture, "--parquet", str(there)]) == 2
    assert "--force" in capsys.readouterr().err
    assert there.read_text() == "precious"
    assert main(["points", capture, "--parquet", str(tmp_path / "no" / "where.parquet")]) == 3
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("command", ["points", "show"])
def test_a_full_disk_is_a_line(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(CAPTURES / "rtu-clean.cap.txt"), "--parquet", "/dev/full", "-f"]) == 3
    assert "no space left" in capsys.readouterr().err


def test_after_a_defect_there_is_no_file(tmp_path: Path) -> None:
    def write() -> None:
        with ParquetWriter(tmp_path / "never.parquet", COLUMNS) as table:
            table.add((1, "whole", 1.0, 1))
            raise KeyError

    with pytest.raises(KeyError):
        write()
    assert list(tmp_path.iterdir()) == []
