"""Frames of a second protocol on the bus are listed as such: each octet once, in order, found by their own fields."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sniff.cli import main

CAPTURES = Path(__file__).parents[3] / "captures"
READ = "01 03 00 00 00 02 C4 0B", "01 03 04 00 06 00 05 DA 31"
TOKENS = "55 FF 00 01 02 00 00 40", "55 FF 00 03 04 00 00 04", "55 FF 00 05 06 00 00 C8"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A master that polls, and tokens between: two of them in one read, one behind stray octets."""
    lines = []
    for number in range(8):
        token = TOKENS[number % 2] if number != 3 else f"{TOKENS[0]} {TOKENS[1]}" if number != 5 else f"AA {TOKENS[0]}"
        lines += [
            f"10:00:{number:02d}.{at} {octets}" for at, octets in zip((100, 140, 300), (*READ, token), strict=True)
        ]
    path = tmp_path_factory.mktemp("two") / "two.log"
    path.write_text("\n".join(lines) + "\n")
    return path


def listed(capsys: pytest.CaptureFixture[str], path: Path, *more: str) -> list[dict[str, object]]:
    """The rows that `show` lists."""
    assert main(["show", "--json", str(path), *more]) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_both_are_listed(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = listed(capsys, log)
    octets = "".join(line.split(" ", 1)[1].replace(" ", "").lower() for line in log.read_text().splitlines())
    assert "".join(str(row["hex"]) for row in rows) == octets
    assert [row["proto"] for row in rows].count("mstp") == 9
    assert all(row["kind"] == "token" for row in rows if row["proto"] == "mstp")
    assert sum(row["verdict"] == "answered" for row in rows) == 16


def test_a_line_names_the_second(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(log)]) == 0
    assert capsys.readouterr().out.count("BACnet MS/TP: 2 → 1 token") >= 4


@pytest.mark.parametrize(
    ("wanted", "many"),
    [('mstp.frame_type == "Token"', 9), ("modbus.func_code == 3", 16), ('proto == "mstp"', 9), ("frame.len == 8", 17)],
)
def test_filters_know_both(wanted: str, many: int, log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert len(listed(capsys, log, "-Y", wanted)) == many


@pytest.mark.parametrize("more", [("-p", "modbus-rtu"), ("-p", "modbus-rtu", "--reference"), ("--reference",)])
def test_whoever_names_the_first(more: tuple[str, ...], log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert listed(capsys, log, *more) == listed(capsys, log)


def test_the_first_alone(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = listed(capsys, log, "-Y", 'proto == "modbus-rtu"')
    assert {row["proto"] for row in rows} == {"modbus-rtu"}


def second(capsys: pytest.CaptureFixture[str], path: Path, *more: str) -> object:
    """What `info` says of a second protocol."""
    assert main(["info", "--json", str(path), *more]) == 0
    return json.loads(capsys.readouterr().out)["second_protocol"]


def test_where_the_file_names_the_first(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = tmp_path / "said.cap.txt"
    assert main(["convert", str(log), str(said)]) == 0
    assert "# protocol: modbus-rtu" in said.read_text()
    capsys.readouterr()
    told = second(capsys, said)
    assert told == second(capsys, said, "--reference") == {"protocol": "mstp", "frames": 9}
    assert sum(row["proto"] == "mstp" for row in listed(capsys, said)) == 9
    assert second(capsys, said, "-p", "mstp") == {"protocol": "modbus-rtu", "frames": 16}


@pytest.mark.parametrize("name", ["rtu-noisy-ftdi", "ascii-usual-faults", "n2-usual-faults", "mstp-usual-faults"])
def test_none_is_invented(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert second(capsys, CAPTURES / f"{name}.cap.txt") is None
