"""`points PORT`, `stats PORT`, `live --json`, `record --json`: what a port says, as tables and as typed records."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("termios")

from dissectors.modbus.envelope import seal_rtu
from sniff.cli import main
from tests.e2e.recording_bus import LINE, Feeder

POLL, ANSWER = seal_rtu(b"\1\3\0\0\0\2"), seal_rtu(b"\1\3\4\0\1\0\2")


@pytest.fixture
def port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    monkeypatch.chdir(tmp_path)
    bus = Feeder()
    bus.poll(POLL + ANSWER, 0.05)
    yield bus.path
    bus.close()


def said(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main([*words, *LINE, "--duration", "1.5"]) == 0
    return capsys.readouterr().out


def test_points_of_a_port(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    table = said(capsys, "points", port)
    assert table.startswith("device  point")
    assert "holding/40001" in table
    samples = [json.loads(line) for line in said(capsys, "points", port, "--json", "-n", "holding/40002").splitlines()]
    assert len(samples) > 3
    assert {(one["device"], one["point"], one["value"]) for one in samples} == {("1", "holding/40002", 2)}
    rows = said(capsys, "points", port, "--csv").splitlines()
    assert rows[0].startswith("time,device,point,value")
    assert len([row for row in rows if row.startswith("time,")]) == 1


@pytest.mark.parametrize("table", ["nodes", "transactions", "polls"])
def test_statistics_of_a_port(port: str, capsys: pytest.CaptureFixture[str], table: str) -> None:
    rows = [json.loads(line) for line in said(capsys, "stats", port, table, "--json").splitlines()]
    assert rows
    if table == "nodes":
        assert rows[0]["asked"] > 3


def test_a_port_is_listened_to_alone_and_whole(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["points", port, "x.mcap"]) == 2
    assert main(["stats", port, "-Y", "modbus.func_code == 3"]) == 2
    assert main(["points", port, "--parquet", "x.parquet"]) == 2
    assert "record it, then" in capsys.readouterr().err


def test_live_and_record_print_typed_records(port: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lines = [json.loads(line) for line in said(capsys, "live", port, "--json", "--no-record").splitlines()]
    frames = [one for one in lines if "record" not in one]
    assert frames
    assert all("hex" in one for one in frames)
    assert {one["record"] for one in lines if "record" in one} >= {"value", "finding", "health", "state"}
    lines = [json.loads(line) for line in said(capsys, "record", port, "-q", "--json-lines", "x.jsonl").splitlines()]
    assert lines == []
    records = [json.loads(line) for line in (tmp_path / "x.jsonl").read_text().splitlines()]
    assert {one["record"] for one in records} >= {"value", "finding", "health", "state"}
    states = [one["listening"] for one in records if one["record"] == "state"]
    assert states == [True, False]


def test_a_table_is_drawn_into_its_room(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from types import SimpleNamespace

    from sniff.analysis.summary import Summary
    from sniff.cli import watching
    from tests.sniff.bus.test_live_batches import SESSION

    monkeypatch.setenv("LINES", "10")
    monkeypatch.setenv("COLUMNS", "80")
    model = SimpleNamespace(summary=Summary(SESSION.line))
    live = SimpleNamespace(session=SESSION, searching=None, model=model, now=None)
    watching._draw(live, lambda: print("\n".join(map(str, range(50)))))  # type: ignore[arg-type]
    lines = capsys.readouterr().out.split("\n")
    assert "Ctrl-C ends" in lines[0]
    assert len(lines) - 1 == 9
    assert lines[-2].endswith("and 43 lines more")
