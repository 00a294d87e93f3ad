"""A second protocol that begins to speak long after the first: wherever rows are listed, the same is said."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

import sniff
from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings
from sniff.bus import second_proof, second_protocol
from sniff.cli import main
from sniff.engine.session import Session
from sniff.formats import create_of_items

POLL = bytes.fromhex("010300000002c40b"), bytes.fromhex("01030400060005da31")
TOKEN, STRAY = bytes.fromhex("55ff000102000040"), b"\xaa"
POLLS, ALONE = 40, 12
WINDOW = 256
LONE = 5
"""The poll that one token follows, long before the others."""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Polls; then tokens between, one behind a stray octet; then tokens alone, two of which came in one read."""
    file, at = tmp_path_factory.mktemp("later") / "later.mcap", 1_772_359_200_000_000_000
    reads: list[bytes] = []
    for number in range(POLLS):
        reads += [*POLL, *([TOKEN] if number == LONE else [])]
    for number in range(ALONE):
        reads += [*POLL, STRAY + TOKEN if number == 3 else TOKEN]
    reads += [TOKEN + TOKEN] * ALONE
    session = Session("/dev/ttyUSB0", LineSettings.parse("19200,8E1"), "modbus-rtu", at)
    with create_of_items(file, session) as writer:
        for octets in reads:
            at += 60 * MS
            writer.write(Chunk(at, octets))
    return file


@pytest.fixture(autouse=True)
def _short_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_proof, "WINDOW", WINDOW)
    monkeypatch.setattr(second_protocol, "MOST", 60)


def output(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    capsys.readouterr()
    assert main([str(word) for word in words]) == 0
    return capsys.readouterr().out


def shown(capsys: pytest.CaptureFixture[str], path: Path, *more: str) -> list[dict[str, object]]:
    return [json.loads(line) for line in output(capsys, "show", "--json", path, *more).splitlines()]


def test_it_is_listed_from_where_it_is_proven(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = shown(capsys, path)
    assert [row["proto"] for row in rows].count("mstp") == 3 * ALONE
    assert [row["proto"] for row in rows].count("modbus-rtu") == 2 * (POLLS + ALONE)
    assert [row["kind"] for row in rows if row["proto"] is None] == ["noise", "noise"]  # the lone one, and the stray
    numbers = [int(str(row["no"])) for row in rows]
    assert numbers == sorted(numbers)
    octets = "".join(str(row["hex"]) for row in rows)
    assert len(octets) // 2 == 17 * (POLLS + ALONE) + 8 + 8 * ALONE + 1 + 16 * ALONE


@pytest.mark.parametrize("more", [("--reference",), ("-Y", "frame.len > 0"), ("-Y", "mstp.src == 2 || frame.len > 0")])
def test_by_whatever_way(more: tuple[str, ...], path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys, path, *more) == shown(capsys, path)


def test_wherever_rows_are_listed(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = shown(capsys, path)
    expected = [(str(row["no"]), str(row["proto"] or ""), str(row["hex"])) for row in rows]
    tables = [output(capsys, "show", "--csv", path), output(capsys, "show", "--csv", "--reference", path)]
    written = tmp_path / "rows.csv"
    output(capsys, "convert", path, written)
    for text in (*tables, written.read_text()):
        found = [(row["no"], row["proto"], row["hex"]) for row in csv.DictReader(io.StringIO(text))]
        assert found == expected
    fields = output(capsys, "show", "-T", "fields", "-e", "no", "-e", "proto", "-e", "hex", path)
    assert [tuple(line.split("\t")) for line in fields.splitlines()] == expected
    assert len(output(capsys, "show", path).splitlines()) == len(rows)
    counted = json.loads(output(capsys, "info", "--json", path))["second_protocol"]
    assert counted == {"protocol": "mstp", "frames": 3 * ALONE}


def test_in_data_frames(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("polars")
    rows = shown(capsys, path)
    capture = sniff.read(path)
    frames = capture.frames(octets=True)
    for name in ("no", "proto", "src", "dst", "role", "ok", "error", "found", "noise_before", "tx", "verdict"):
        assert frames[name].to_list() == [row[name] for row in rows], name
    assert [octets.hex() for octets in frames["octets"]] == [row["hex"] for row in rows]
    assert frames["start_ns"].to_list() == [capture.started + int(str(row["start_ns"])) for row in rows]
    assert frames["len"].to_list() == [len(str(row["hex"])) // 2 for row in rows]
    assert capture.frames().drop("t").equals(frames.drop("octets", "t"))


def test_the_count_ends_it(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = shown(capsys, path)
    for many in (1, 2 * POLLS, 2 * POLLS + 4, len(rows)):
        assert shown(capsys, path, "-c", str(many)) == rows[:many]
