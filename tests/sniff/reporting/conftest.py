"""Captures to report on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.profiles import Devices
from sniff.formats import read
from sniff.reporting.collecting import collect
from sniff.reporting.numbers import CaptureNumbers
from tests.sniff.reporting.page_reading import SCRIPT


@pytest.fixture
def numbers_of() -> Callable[[Path], CaptureNumbers]:
    def make(path: Path) -> CaptureNumbers:
        capture = read(path)
        return collect(path.name, capture, capture.session, Devices())

    return make


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A server that calls itself a script, answering twice so that its words are evidence; a port of that name too."""

    def line(delay: str, octets: bytes) -> str:
        return f"{delay} {(octets + crc16_modbus(octets).to_bytes(2, 'little')).hex(' ').upper()}"

    name = SCRIPT.encode()
    answer = bytes([1, 0x11, len(name) + 1]) + name + b"\xff"
    path = tmp_path / "a&b<i>.cap.txt"
    head = ["#!sniff-capture 1", "# line: 19200,8E1", "# protocol: modbus-rtu", f"# port: {SCRIPT}"]
    rounds = [line("+200", b"\x01\x11"), line("+40", answer), line("+60", answer)]
    path.write_text("\n".join([*head, "# start: 2026-03-01T10:00:00Z", *rounds * 3, f'#! +5 note "{SCRIPT}"', ""]))
    return path
