"""`profile draft` on a meter that nobody has described."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from dissectors.profiles import parse_text
from dissectors.profiles.model import Kind
from sniff.bus.capture_writer import create
from sniff.engine.session import Session

LINE = LineSettings.parse("9600,8E1")
MS = 1_000_000


def meter(path: Path, stations: tuple[int, ...] = (7,)) -> None:
    """Voltage, current, power as swapped floats, an energy counter, a temperature: answered 200 times."""
    dice, now = random.Random(485), 1_772_359_200_000_000_000
    energy = 65_000
    with create(path, Session("meter", LINE, "modbus-rtu", now)) as writer:
        for _ in range(200):
            energy += dice.randrange(20)
            numbers = [230 + dice.gauss(0, 2), 5 + dice.gauss(0, 0.3), 1150 + dice.gauss(0, 40)]
            words = [word for number in numbers for word in struct.unpack(">HH", struct.pack(">f", number))[::-1]]
            words += [energy & 0xFFFF, energy >> 16, round(dice.gauss(0, 30)) & 0xFFFF]
            for station in stations:
                for pdu in (
                    struct.pack(">BBHH", station, 4, 0, len(words)),
                    struct.pack(f">BBB{len(words)}H", station, 4, 2 * len(words), *words),
                ):
                    octets = seal_rtu(pdu)
                    now += 20 * MS + len(octets) * LINE.char
                    writer.write(Chunk(now, octets))
                now += 500 * MS


def test_a_draft_of_a_meter_is_a_profile_that_reads_it(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    capture, draft = tmp_path / "meter.cap.txt", tmp_path / "meter.toml"
    meter(capture)
    ran = sniff485("profile", "draft", capture, "-w", draft, "--name", "meter")
    assert (ran.code, ran.out) == (0, "")
    assert "5 values drafted" in ran.err
    profile = parse_text(draft.read_text(), "meter.toml")
    kinds = [(entry.address, entry.kind, entry.swapped, bool(entry.doubt)) for entry in profile.entries]
    assert kinds == [
        (0, Kind.F32, True, False),
        (2, Kind.F32, True, False),
        (4, Kind.F32, True, False),
        (6, Kind.U32, True, False),
        (8, Kind.S16, False, False),
    ]
    assert sniff485("profile", "check", draft).code == 0
    points = sniff485("points", capture, "-d", f"7={draft}")
    assert points.code == 0, points.err


def test_a_draft_overwrites_nothing(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    capture, draft = tmp_path / "meter.cap.txt", tmp_path / "meter.toml"
    meter(capture)
    draft.write_text("mine")
    assert sniff485("profile", "draft", capture, "-w", draft).code == 3
    assert draft.read_text() == "mine"


@pytest.mark.parametrize(("station", "code"), [((), 2), (("--station", 8), 0), (("--station", 9), 3)])
def test_one_station_is_drafted(
    sniff485: Callable[..., Any], tmp_path: Path, station: tuple[object, ...], code: int
) -> None:
    capture = tmp_path / "meter.cap.txt"
    meter(capture, (7, 8))
    ran = sniff485("profile", "draft", capture, *station)
    assert ran.code == code
    assert ("7, 8" in ran.err) == (code == 2)
