"""A capture and its copies in other formats are one capture; what a file does not say its octets do."""

from __future__ import annotations

import json
import shutil
import struct
from pathlib import Path
from typing import Any

import pytest

from sniff.cli import main

CAPTURES = Path(__file__).parents[3] / "captures"
NANOSECONDS, MICROSECONDS = 0xA1B23C4D, 0xA1B2C3D4


def _buses(folder: Path, capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    assert main(["fleet", "--workers", "1", "--no-index", "--json", str(folder)]) in (0, 1)
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def _in_microseconds(path: Path) -> None:
    """What another program makes of a pcap file: its times rounded down."""
    octets = bytearray(path.read_bytes())
    assert struct.unpack_from("<I", octets) == (NANOSECONDS,)
    struct.pack_into("<I", octets, 0, MICROSECONDS)
    at = 24
    while at < len(octets):
        _, parts, length = struct.unpack_from("<III", octets, at)
        struct.pack_into("<I", octets, at + 4, parts // 1000)
        at += 16 + length
    path.write_bytes(octets)


@pytest.mark.parametrize("name", ["rtu-usual-faults", "mstp-noisy-ftdi", "n2-usual-faults", "profibus-clean"])
def test_a_copy_counts_once(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "archive"
    folder.mkdir()
    shutil.copy(CAPTURES / f"{name}.cap.txt", folder)
    capsys.readouterr()
    (alone,) = _buses(folder, capsys)
    for suffix in ("mcap", "pcapng", "pcap"):
        assert main(["convert", str(CAPTURES / f"{name}.cap.txt"), str(folder / f"copy-{suffix}.{suffix}")]) == 0
    _in_microseconds(folder / "copy-pcap.pcap")
    capsys.readouterr()
    (bus,) = _buses(folder, capsys)
    assert {**bus, "notes": []} == {**alone, "notes": []}
    assert len(bus["notes"]) == 3
    assert all("counted once" in note for note in bus["notes"])


def test_only_copies_without_a_name_are_one_bus(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(2):
        main(["convert", str(CAPTURES / "rtu-clean.cap.txt"), str(tmp_path / f"night-{number}.pcap")])
    capsys.readouterr()
    (bus,) = _buses(tmp_path, capsys)
    assert bus["bus"] == "night-0"
    main(["convert", str(CAPTURES / "rtu-duplicate-address.cap.txt"), str(tmp_path / "another.pcap")])
    capsys.readouterr()
    assert {bus["bus"] for bus in _buses(tmp_path, capsys)} == {"night-0", "another"}


def test_octets_tell_the_protocol_that_a_file_does_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["convert", str(CAPTURES / "n2-clean.cap.txt"), str(tmp_path / "night.pcap")])
    capsys.readouterr()
    (bus,) = _buses(tmp_path, capsys)
    assert (bus["protocol"], bus["findings"]) == ("n2", [])
    assert bus["days"][0]["damaged_share"] == 0


def test_a_log_without_times_has_no_load(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bare.log").write_text("01 03 00 00 00 02 C4 0B\n01 03 04 00 01 00 02 2A 32\n" * 8)
    (bus,) = _buses(tmp_path, capsys)
    (day,) = bus["days"]
    assert (day["day"], day["load"], day["listened_s"], day["frames"]) == ("no date", None, None, 16)
    main(["fleet", "--workers", "1", "--no-index", str(tmp_path)])
    assert "no date" in (said := capsys.readouterr().out)
    assert " 0%" not in said
