"""The frames that the devices' manuals print, octet by octet, and what `show` says of them.

Three of the TECO manuals' have check octets that do not fit; they are damaged frames with the computed check beside.
Of the ASCII frames the manuals leave the LRC open.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.modbus.envelope import seal_ascii

RTU: tuple[tuple[str, str], ...] = (
    ("01 03 01 23 00 01 74 3C", "frequency command in the manual's example"),
    ("01 03 02 17 70 AF 82", "CRC error: 0xAF82, computed 0xB650"),
    ("02 83 52 C0 CD", "CRC error: 0xC0CD, computed 0x30CD"),
    ("01 08 00 00 A5 37 DA 8D", "return query data A5 37"),
    ("01 08 00 00 A5 37 DA 8D", "return query data A5 37"),
    ("01 08 00 00 A5 37 DA 8D", "return query data A5 37"),
    ("01 88 20 47 D8", "loop test refused"),
    ("01 06 01 02 17 70 27 E2", "60.00 Hz"),
    ("01 06 01 02 17 70 27 E2", "0x0102 = 6000"),
    ("01 06 01 02 17 70 27 E2", "60.00 Hz"),
    ("01 86 52 C3 9D", "request refused"),
    ("01 10 01 01 00 02 04 00 01 17 70 60 27", "run, forward"),
    ("01 10 01 01 00 02 11 F4", "write registers 0x0101 ×2"),
    ("01 10 01 01 00 02 04 00 01 17 70 60 27", "60.00 Hz"),
    ("01 90 52 CD FD", "request refused"),
)
ASCII: tuple[tuple[str, str], ...] = (
    ("01 03 01 23 00 01", "frequency command in the manual's example"),
    ("01 03 02 17 70", "60.00 Hz"),
    ("01 08 00 00 A5 37", "return query data A5 37"),
    ("01 08 00 00 A5 37", "return query data A5 37"),
    ("01 08 00 00 A5 37", "return query data A5 37"),
    ("01 88 20", "loop test refused"),
    ("01 06 01 02 17 70", "60.00 Hz"),
    ("01 06 01 02 17 70", "0x0102 = 6000"),
    ("01 10 01 01 00 02 04 00 01 17 70", "run, forward"),
    ("01 10 01 01 00 02", "write registers 0x0101 ×2"),
    ("01 10 01 01 00 02 04 00 01 17 70", "60.00 Hz"),
    ("01 90 52", "request refused"),
)
ACN: tuple[tuple[str, str], ...] = (
    ("01 10 11 02 00 02 04 00 32 00 64 12 02", "5.0 s"),
    ("01 10 11 02 00 02 E5 34", "write registers 0x1102 ×2"),
)


def rows(sniff485: Callable[..., Any], path: Path, protocol: str, device: str, frames: list[bytes]) -> list[Any]:
    head = f"#!sniff-capture 1\n# line: 19200,8N1\n# protocol: {protocol}\n# start: 2026-03-01T10:00:00Z\n"
    path.write_text(head + "".join(f"+100 {frame.hex(' ')}\n" for frame in frames))
    shown = [json.loads(line) for line in sniff485("show", path, "--json", "-d", f"*={device}").out.splitlines()]
    assert len(shown) == len(frames)
    return shown


PRINTED = {"teco-e510": RTU, "teco-f510": RTU, "automationdirect-acn": ACN}


@pytest.mark.parametrize("device", PRINTED)
def test_rtu_frames(device: str, sniff485: Callable[..., Any], tmp_path: Path) -> None:
    printed = PRINTED[device]
    frames = [bytes.fromhex(octets) for octets, _ in printed]
    for row, (octets, said) in zip(
        rows(sniff485, tmp_path / "printed.cap.txt", "modbus-rtu", device, frames), printed, strict=True
    ):
        assert said in row["text"], (octets, row)


@pytest.mark.parametrize("device", ["teco-e510", "teco-f510"])
def test_ascii_frames(device: str, sniff485: Callable[..., Any], tmp_path: Path) -> None:
    frames = [seal_ascii(bytes.fromhex(octets)) for octets, _ in ASCII]
    for row, (octets, said) in zip(
        rows(sniff485, tmp_path / "printed.cap.txt", "modbus-ascii", device, frames), ASCII, strict=True
    ):
        assert said in row["text"], (octets, row)
