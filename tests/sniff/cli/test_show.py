"""`show`: lines, JSON as promised, fields, filters, and errors with a way out."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.sniff.formats.packets_made import as_pcap, udp

CAPTURES = Path(__file__).parents[3] / "captures"

KEYS = [
    "no", "t", "start_ns", "end_ns", "proto", "src", "dst", "role", "kind", "ok", "error", "found", "noise_before",
    "tx", "verdict", "latency_ms", "text", "hex",
]  # fmt: skip


def test_json_has_the_promised_keys_in_order(poll: Path, sniff485: Callable) -> None:
    ran = sniff485("show", "--json", poll)
    rows = [json.loads(line) for line in ran.out.splitlines()]
    assert ran.code == 0
    assert all(list(row) == KEYS for row in rows)
    first = rows[0]
    assert first["text"] == "1 ← read holding 0x0000 ×2"
    assert (first["src"], first["dst"], first["role"], first["kind"]) == (None, 1, "request", "read-holding-registers")
    assert (first["verdict"], first["tx"], first["ok"], first["error"]) == ("answered", 1, True, None)
    assert first["end_ns"] == 0
    assert first["t"].startswith("2026-03-01T09:59:59.9954")
    assert rows[1]["latency_ms"] == pytest.approx(8.2 - 9 * 11 / 19.2, abs=1e-4)
    assert first["latency_ms"] == rows[1]["latency_ms"]


def test_the_hex_of_all_lines_is_every_octet(poll: Path, sniff485: Callable) -> None:
    from sniff.formats import read

    rows = [json.loads(line) for line in sniff485("show", "--json", poll).out.splitlines()]
    octets = b"".join(item.octets for item in read(poll).items() if hasattr(item, "octets"))
    assert "".join(row["hex"] for row in rows) == octets.hex()
    noise = [row for row in rows if row["kind"] == "noise"]
    assert [row["proto"] for row in noise] == [None]


def test_verdicts_survive(poll: Path, sniff485: Callable) -> None:
    rows = [json.loads(line) for line in sniff485("show", "--json", poll).out.splitlines()]
    assert [row["verdict"] for row in rows][:6] == [
        "answered", "answered", None, "no-response", "exception", "exception",
    ]  # fmt: skip
    assert rows[6]["ok"] is False
    assert "CRC" in rows[6]["error"]


def test_a_filter_chooses(poll: Path, sniff485: Callable) -> None:
    out = sniff485("show", poll, "-Y", "verdict == no-response").out
    assert out.count("\n") == 1
    assert "2 ← read holding" in out


def test_fields_by_wiresharks_names(poll: Path, sniff485: Callable) -> None:
    out = sniff485(
        "show",
        poll,
        "-Y",
        "ok && role == response",
        "-T",
        "fields",
        "-e",
        "mbrtu.unit_id",
        "-e",
        "modbus.regval_uint16",
        "-e",
        "modbus.exception_code",
    ).out
    assert out.splitlines() == ["1\t215,26\t", "1\t\t2"]


def test_fields_in_json(poll: Path, sniff485: Callable) -> None:
    first = json.loads(sniff485("show", "--json", "--fields", poll).out.splitlines()[0])
    assert first["fields"]["modbus.func_code"] == 3
    assert first["fields"]["tx.latency_low_ms"] <= first["fields"]["tx.latency_ms"]


def test_tree_and_hex(poll: Path, sniff485: Callable) -> None:
    out = sniff485("show", poll, "-V", "-x", "-c", 2).out
    assert "0000  01 03 00 00 00 02 c4 0b" in out
    assert "unit" in out
    assert "None" not in out.replace("= None", "")


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["show", "no-such.mcap"], 3, "no-such.mcap"),
        (["show", "no-such.xyz"], 3, "no such file"),
        (["show", "{poll}", "-Y", "dts == 3"], 2, "unknown name 'dts'"),
        (["show", "{poll}", "-p", "modbusrtu"], 2, "modbus-rtu"),
        (["show", "{poll}", "-s", "fast"], 2, "19200,8E1"),
        (["show", "{poll}", "-T", "fields"], 2, "-e"),
        (["show", "{text}"], 3, "byte log"),
        (["show", "{folder}"], 3, "directory"),
        (["show", "{broken}"], 3, "broken.cap.txt:3"),
    ],
)
def test_an_error_is_one_line_with_a_way_out(
    arguments: list[str], code: int, said: str, poll: Path, tmp_path: Path, sniff485: Callable
) -> None:
    text, folder, broken = tmp_path / "text.mcap", tmp_path / "folder.mcap", tmp_path / "broken.cap.txt"
    text.write_text("hello, this is no recording\n")
    folder.mkdir()
    broken.write_text("#!sniff-capture 1\n# protocol: modbus-rtu\n+0 01 0G\n")
    names = {"poll": poll, "text": text, "folder": folder, "broken": broken}
    ran = sniff485(*(argument.format(**names) for argument in arguments))
    assert ran.code == code
    assert said.lower() in ran.err.lower()
    assert "Traceback" not in ran.err
    if code == 3:
        assert ran.err.count("\n") == 1


def test_standard_input(poll: Path, sniff485: Callable, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import io
    from types import SimpleNamespace

    whole = sniff485("show", poll).out
    mcap = tmp_path / "poll.mcap"
    assert sniff485("convert", poll, mcap).code == 0
    for path in (poll, mcap):
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(path.read_bytes()), isatty=lambda: False))
        assert sniff485("show", "-").out == whole


@pytest.mark.parametrize("text", ["", "(1.0) bus 01 03 00 00 00 02 C4 0B\n"], ids=["nothing", "byte log"])
def test_standard_input_has_no_path(
    text: str, sniff485: Callable, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import io
    import tempfile
    from types import SimpleNamespace

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(text.encode()), isatty=lambda: False))
    ran = sniff485("info", "-")
    assert ran.code == (0 if text else 3)
    assert str(tmp_path) not in ran.out + ran.err


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-8"])
def test_an_output_without_arrows(encoding: str, poll: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What Windows makes of `show FILE > frames.txt`."""
    import io

    from sniff.cli import main

    out = io.TextIOWrapper(io.BytesIO(), encoding)
    monkeypatch.setattr("sys.stdout", out)
    assert main(["show", str(poll)]) == 0
    out.flush()
    written = out.buffer.getvalue().decode(encoding)  # type: ignore[attr-defined]
    assert main(["show", "--json", str(poll)]) == 0
    out.flush()
    lines = out.buffer.getvalue().decode(encoding).splitlines()  # type: ignore[attr-defined]
    assert json.loads(lines[-1])["text"].startswith("1 ← read holding 0x0000 ×2")
    assert ("1 ← read holding" if encoding == "utf-8" else "1 <- read holding") in written


@pytest.mark.skipif(os.name != "posix", reason="names of files are text here")
def test_a_name_that_is_no_text(sniff485: Callable, tmp_path: Path) -> None:
    log = tmp_path / os.fsdecode(b"\xff.log")
    log.write_text("(1.0) bus 01 03 00 00 00 02 C4 0B\n")
    assert sniff485("show", log).code == 0
    assert sniff485("info", log).code == 0
    for out in ("out.mcap", "out.cap.txt", "out.pcapng"):
        assert sniff485("convert", log, tmp_path / out).code == 0
        assert "\\udcff.log" in sniff485("info", tmp_path / out).out


def test_csv_has_the_values_of_json(poll: Path, sniff485: Callable) -> None:
    expected = [json.loads(line) for line in sniff485("show", "--json", poll).out.splitlines()]
    ran = sniff485("show", "--csv", poll)
    assert ran.code == 0
    assert ran.out.splitlines()[0] == ",".join(KEYS)
    rows = list(csv.DictReader(io.StringIO(ran.out)))
    assert len(rows) == len(expected) > 1
    for row, wanted in zip(rows, expected, strict=True):
        told = {key: int(value) if isinstance(value, bool) else value for key, value in wanted.items()}
        assert row == {key: "" if value is None else str(value) for key, value in told.items()}


def test_csv_has_one_heading_and_takes_filters(poll: Path, sniff485: Callable) -> None:
    out = sniff485("show", "--csv", poll, poll, "-Y", "verdict == no-response").out
    assert [line.split(",")[0] for line in out.splitlines()] == ["source", str(poll), str(poll)]
    assert [line.split(",")[1] for line in out.splitlines()] == ["no", "4", "4"]


def test_no_cell_of_csv_is_a_formula(poll: Path, sniff485: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("bus.row_words", "cli.said_texts"):
        monkeypatch.setattr(f"sniff.{module}.describe", lambda dissector, row, meaning=None: "=1+1,\n2")
    rows = list(csv.DictReader(io.StringIO(sniff485("show", "--csv", poll, "-c", "1").out)))
    assert [row["text"] for row in rows] == ["'=1+1,\n2"]


def test_parquet_has_the_values_of_json(poll: Path, sniff485: Callable, tmp_path: Path) -> None:
    pl = pytest.importorskip("polars", reason="needs polars, the extra parquet")
    expected = [json.loads(line) for line in sniff485("show", "--json", poll).out.splitlines()]
    target = tmp_path / "out.parquet"
    assert sniff485("show", poll, "--parquet", target).code == 0
    table = pl.read_parquet(target)
    assert table.columns == KEYS
    assert (table["t"].dtype, table["ok"].dtype) == (pl.Datetime("ns", "UTC"), pl.Boolean)
    assert table.drop("t").to_dicts() == [{key: row[key] for key in row if key != "t"} for row in expected]
    assert table["t"].dt.to_string("%Y-%m-%dT%H:%M:%S%.9fZ").to_list() == [row["t"] for row in expected]


def test_parquet_overwrites_nothing_unasked(poll: Path, sniff485: Callable, tmp_path: Path) -> None:
    pytest.importorskip("polars", reason="needs polars, the extra parquet")
    target = tmp_path / "out.parquet"
    target.write_text("precious")
    assert sniff485("show", poll, "--parquet", target).code == 2
    assert target.read_text() == "precious"
    assert sniff485("show", poll, "--parquet", poll, "-f").code == 2
    assert sniff485("show", poll, "--parquet", tmp_path / "no" / "where").code == 3
    assert sniff485("show", poll, "--parquet", target, "-f", "-c", "2").code == 0
    assert target.read_bytes()[:4] == b"PAR1"
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


@pytest.mark.parametrize("count", ["-3", "x", "1.5", ""])
def test_a_count_is_a_whole_number(sniff485: Callable, count: str) -> None:
    ran = sniff485("show", "captures/rtu-clean.cap.txt", f"--count={count}")
    assert (ran.code, ran.out) == (2, "")
    assert "expected a whole number, 0 or more" in ran.err


def test_a_count_of_none_shows_none(sniff485: Callable) -> None:
    ran = sniff485("show", "captures/rtu-clean.cap.txt", "-c", 0)
    assert (ran.code, ran.out) == (0, "")


@pytest.mark.parametrize("name", ["sixteen-registers", "twenty-parameters", "acn-common-area", "bacnet-three-objects"])
def test_a_question_names_what_its_answer_tells(name: str, sniff485: Callable) -> None:
    ran = sniff485("show", f"captures/devices/{name}.cap.txt", "--json", "--fields")
    asked, told = (json.loads(line) for line in ran.out.splitlines()[:2])
    assert {one["place"] for one in told["values"]} <= {one["place"] for one in asked["asks"]}
    assert all(one["title"] for one in asked["asks"])
    assert (asked["values"], told["asks"]) == ([], [])
    assert len(told["values"]) in (len(asked["asks"]), len(asked["asks"]) - 1)  # one property the drive does not have


@pytest.mark.parametrize("more", [(), ("--reference",)])
def test_a_row_names_the_findings_that_it_shows(more: tuple[str, ...], sniff485: Callable) -> None:
    path = CAPTURES / "rtu-usual-faults.cap.txt"
    found = [json.loads(line) for line in sniff485("check", path, "--json").out.splitlines()]
    told: dict[int, set[str]] = {}
    for finding in found:
        for frame in finding["frames"]:
            told.setdefault(frame["no"], set()).add(finding["code"])
    lines = sniff485("show", path, "-T", "fields", "-e", "no", "-e", "finding", *more).out.splitlines()
    cells = {int(no): set(codes.split(",")) for no, _, codes in (line.partition("\t") for line in lines) if codes}
    assert cells == told


def test_what_only_filters_have_is_no_unknown_field(sniff485: Callable) -> None:
    ran = sniff485("show", CAPTURES / "rtu-clean.cap.txt", "-T", "fields", "-e", "point")
    assert ran.code == 2
    assert "unknown" not in ran.err
    assert "-Y" in ran.err


def test_fields_of_relatives_on_networks_are_known(tmp_path: Path, sniff485: Callable) -> None:
    here, there = (bytes((192, 0, 2, 1)), 47808), (bytes((192, 0, 2, 9)), 47808)
    path = as_pcap(tmp_path / "x.pcap", [(1, udp(here, there, bytes.fromhex("81050006003c")))])
    ran = sniff485("show", path, "-T", "fields", "-e", "bvlc.function", "-e", "bvlc.reg_ttl")
    assert (ran.code, ran.out) == (0, "5\t60\n")
    listed = sniff485("show", "--help-fields").out
    assert listed.count(" bvlc.function ") == 1
    assert listed.count(" bacapp.type ") == 1
    assert " bacapp.type " in sniff485("show", "--help-fields=bacnet-ip").out
