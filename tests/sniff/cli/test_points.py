"""`points`, `profile`, and -d where other commands take it."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.modbus.envelope import seal_rtu
from sniff.cli import main
from tests.sniff.cli.test_profile_draft import meter

CAPTURES = Path(__file__).parents[3] / "captures"

EXCHANGES = (
    ("010625021770", "010625021770"),
    ("010625010003", "010625010003"),
    ("010325200004", "010308000900110000 1770"),
    ("010325240001", "0103021770"),
    ("020300000001", "0203020007"),
    ("010325240001", "01030207d0"),
)


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    lines = ["#!sniff-capture 1", "# line: 19200,8N1", "# protocol: modbus-rtu", "# start: 2026-03-01T10:00:00Z"]
    for request, response in EXCHANGES:
        lines += [f"+100 {seal_rtu(bytes.fromhex(request)).hex(' ').upper()}"]
        lines += [f"+20 {seal_rtu(bytes.fromhex(response)).hex(' ').upper()}"]
    path = tmp_path / "drive.cap.txt"
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


Run = Callable[..., Any]


def test_the_latest_values_as_a_table(sniff485: Run, drive: Path) -> None:
    ran = sniff485("points", drive, "-d", "1=teco-e510")
    rows = [line.split() for line in ran.out.splitlines()]
    assert ran.code == 0
    assert rows[0][:4] == ["device", "point", "value", "unit"]
    assert rows[[r[1] for r in rows].index("output-frequency")][:5] == ["1", "output-frequency", "20.00", "Hz", "0"]
    assert "command: run, reverse" in ran.out
    assert "external fault 01" in ran.out
    assert ["2", "holding/40001", "7"] in [row[:3] for row in rows]
    assert "status.running" not in ran.out
    assert "status.running" in sniff485("points", drive, "-d", "1=teco-e510", "--bits").out


def test_every_sample_as_csv_and_json(sniff485: Run, drive: Path) -> None:
    table = list(csv.DictReader(io.StringIO(sniff485("points", drive, "-d", "*=teco-e510", "--csv").out)))
    frequency = [row for row in table if row["point"] == "output-frequency"]
    assert [(row["value"], row["raw"], row["unit"], row["frame"]) for row in frequency] == [
        ("60.0", "6000", "Hz", "8"),
        ("20.0", "2000", "Hz", "12"),
    ]
    assert frequency[0]["time"].startswith("2026-03-01T10:00:00.")
    lines = sniff485("points", drive, "-d", "*=teco-e510", "--json", "-n", "set-*").out.splitlines()
    (sample,) = [json.loads(line) for line in lines]
    assert (sample["device"], sample["point"], sample["value"], sample["how"]) == ("1", "set-frequency", 60.0, "write")
    latest = sniff485("points", drive, "--json", "--latest").out.splitlines()
    assert len({json.loads(line)["point"] for line in latest}) == len(latest)


def test_words_in_show(sniff485: Run, drive: Path) -> None:
    plain, named = sniff485("show", drive).out, sniff485("show", drive, "-d", "1=teco-e510").out
    assert "—" not in plain
    assert "1 ← frequency command 60.00 Hz — write register 0x2502 = 6000" in named
    assert "1 ← run, reverse — write register" in named
    assert "1 → status running, forward, not ready, fault; fault external fault 01" in named
    first = json.loads(sniff485("show", drive, "-d", "1=teco-e510", "--json").out.splitlines()[0])
    assert first["text"].startswith("1 ← frequency command 60.00 Hz — ")


def test_findings_in_check(sniff485: Run, drive: Path) -> None:
    ran = sniff485("check", drive, "-d", "1=teco-e510", "--json")
    codes = {json.loads(line)["code"] for line in ran.out.splitlines()}
    assert "PR004" in codes
    assert not {code for code in codes if code.startswith("PR")} & {
        json.loads(line)["code"] for line in sniff485("check", drive, "--json").out.splitlines()
    }
    assert "reports a fault" in sniff485("rule", "PR004").out


def test_convert_writes_the_values(sniff485: Run, drive: Path, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    target = tmp_path / "drive.mcap"
    assert sniff485("convert", drive, target, "-d", "1=teco-e510").code == 0
    with target.open("rb") as stream:
        found = [
            json.loads(message.data)
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic.endswith("/1/output-frequency")
        ]
    assert found == [
        {"value": 60.0, "raw": 6000, "quality": 0, "frame": 8},
        {"value": 20.0, "raw": 2000, "quality": 0, "frame": 12},
    ]
    # the file says of itself who is on the bus
    assert "output-frequency" in sniff485("points", target).out
    assert "1 ← run, reverse — write register" in sniff485("show", target).out


@pytest.mark.parametrize(
    "words",
    [
        ("redissect",),
        ("merge",),
        ("cut", "--frames", "1-100"),
        ("recover",),
        ("anonymise",),
        ("recover", "--reference"),
    ],
)
def test_what_is_made_of_a_recording_keeps_its_values(
    sniff485: Run, drive: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    from mcap.reader import make_reader

    source, target = tmp_path / "drive.mcap", tmp_path / "made.mcap"
    assert sniff485("convert", drive, source, "-d", "1=teco-e510").code == 0
    assert sniff485(*words, source, "-o", target).code == 0
    with target.open("rb") as stream:
        found = [
            json.loads(message.data)["value"]
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic.endswith("/1/output-frequency")
        ]
    assert found == [60.0, 20.0]


def test_a_file_may_not_name_a_profile_by_path(sniff485: Run, drive: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    from sniff.bus.capture_writer import create
    from sniff.formats import read

    stolen = tmp_path / "stolen.toml"
    stolen.write_text('name = "stolen"\ntitle = "x"\nprotocols = []\nnoun = "STOLEN"\n', "utf-8")
    capture = read(drive)
    target = tmp_path / "hostile.mcap"
    for name in (str(stolen), "../stolen", "stolen.toml", "nobody", "teco-e510 \x1b"):
        session = replace(capture.session, notes={"devices": f"1={name},x=teco-e510,*="})
        with create(target, session) as writer:
            for item in read(drive).items():
                writer.write(item)
        ran = sniff485("points", target)
        assert ran.code == 0
        assert "holding/49477" in ran.out or "holding/49505" in ran.out
        target.unlink()


@pytest.mark.parametrize(
    ("token", "told"),
    [
        ("teco-e510", "expected ADDRESS=PROFILE"),
        ("300=teco-e510", "expected an address 0 … 255"),
        ("1=teco-e51", "did you mean 'teco-e510'"),
        ("1=nowhere.toml", "nowhere.toml"),
    ],
)
def test_a_wrong_device_is_a_usage_error(sniff485: Run, drive: Path, token: str, told: str) -> None:
    ran = sniff485("points", drive, "-d", token)
    assert ran.code == 2
    assert told in ran.err


# -- profile -----------------------------------------------------------------------------------------------------------


def test_profile_list_and_show(sniff485: Run) -> None:
    assert "teco-f510" in sniff485("profile", "list").out
    names = {json.loads(line)["name"] for line in sniff485("profile", "list", "--json").out.splitlines()}
    assert {"teco-e510", "teco-f510", "automationdirect-acn"} <= names
    shown = sniff485("profile", "show", "teco-f510").out
    for words in (
        "modbus longest frame: 80 octets",
        "2501h",
        "AI 10",
        "analog-input 4",
        "vendor-name: TECO F510",
        "LOPb",
    ):
        assert words in shown
    entries = [json.loads(line) for line in sniff485("profile", "show", "teco-e510", "--json").out.splitlines()]
    assert {"name": "output-frequency", "unit": "Hz", "scale": 0.01}.items() <= next(
        entry for entry in entries if entry["address"] == 0x2524
    ).items()
    assert sniff485("profile", "show", "nobody").code == 2


def test_profile_check(sniff485: Run, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.toml", tmp_path / "bad.toml"
    good.write_text('name = "a"\ntitle = "a"\nprotocols = []\n', "utf-8")
    bad.write_text('name = "a"\ntitle = "a"\nprotocols = []\n[modbus]\nregistr = 1\n', "utf-8")
    assert sniff485("profile", "check", good).code == 0
    ran = sniff485("profile", "check", good, bad)
    assert ran.code == 3
    assert "bad.toml: modbus.registr: unknown key; did you mean 'register'?" in ran.err


def test_profile_guess(sniff485: Run, drive: Path) -> None:
    rows = [json.loads(line) for line in sniff485("profile", "guess", drive, "--json").out.splitlines()]
    assert {(row["station"], row["profile"]) for row in rows if row["station"] == 1} == {
        (1, "teco-e510"),
        (1, "teco-f510"),
    }


def test_undescribed_registers_say_what_they_may_be(sniff485: Run, tmp_path: Path) -> None:
    capture = tmp_path / "meter.cap.txt"
    meter(capture)
    rows = [json.loads(line) for line in sniff485("points", capture, "--json", "--latest").out.splitlines()]
    assert [(row["point"], row["means"]) for row in rows] == [
        ("input/30001", "guessed f32 low word first: sensor (sure)"),
        ("input/30003", "guessed f32 low word first: sensor (sure)"),
        ("input/30005", "guessed f32 low word first: sensor (sure)"),
        ("input/30007", "guessed u32 low word first: counter (sure)"),
        ("input/30009", "guessed s16: sensor (sure)"),
    ]
    volts = rows[0]
    assert 220 < volts["low"] <= volts["value"] <= volts["high"] < 240
    assert (volts["quality"], volts["samples"], volts["written"]) == (1, 200, 0)
    assert volts["every_ms"] > 500
    plain = sniff485("points", capture, "--no-guess")
    assert "guessed" not in plain.out
    assert len(plain.out.splitlines()) == 1 + 9
    assert "guessed" not in sniff485("points", capture, "--csv").out


def test_a_described_station_is_not_guessed_at(sniff485: Run, drive: Path) -> None:
    out = sniff485("points", drive, "-d", "1=teco-e510").out
    assert all("guessed" not in line for line in out.splitlines() if line.lstrip().startswith("1 "))
    assert any("guessed" in line for line in out.splitlines() if line.lstrip().startswith("2 "))


@pytest.mark.parametrize("order", ["device", "name", "changed", "samples", "every", "rate"])
def test_orders_of_the_table(sniff485: Run, drive: Path, order: str) -> None:
    ran = sniff485("points", drive, "--sort", order, "--json", "--latest")
    assert ran.code == 0, ran.err
    rows = [json.loads(line) for line in ran.out.splitlines()]
    if order == "samples":
        assert [row["samples"] for row in rows] == sorted((row["samples"] for row in rows), reverse=True)
    if order == "name":
        assert [row["point"] for row in rows] == sorted(row["point"] for row in rows)


def test_ages_of_a_capture_from_before_1970(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = []
    for year in ("2026", "1931"):
        path = tmp_path / f"{year}.cap.txt"
        path.write_text((CAPTURES / "rtu-clean.cap.txt").read_text().replace("start: 2026-", f"start: {year}-"))
        assert main(["points", str(path), "--latest", "--csv"]) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]
