"""`profile draft` on a meter that nobody has described."""

from __future__ import annotations

import random
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from dissectors.profiles.model import Kind
from dissectors.profiles.packaged import parse_text
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
    assert sniff485("profile", "draft", capture, "-w", draft).code == 2
    assert draft.read_text() == "mine"
    assert sniff485("profile", "draft", capture, "-w", draft, "-f").code == 0
    assert draft.read_text() != "mine"


def asked_of(path: Path, questions: list[tuple[int, int, int, list[int]]], times: int = 60) -> None:
    """A capture of reads: station, function, first register, words; each asked so often, the words one higher each
    time."""
    now = 1_772_359_200_000_000_000
    with create(path, Session("meter", LINE, "modbus-rtu", now)) as writer:
        for turn in range(times):
            for station, function, first, words in questions:
                told = [(word + turn) & 0xFFFF for word in words]
                for pdu in (
                    struct.pack(">BBHH", station, function, first, len(told)),
                    struct.pack(f">BBB{len(told)}H", station, function, 2 * len(told), *told),
                ):
                    octets = seal_rtu(pdu)
                    now += 20 * MS + len(octets) * LINE.char
                    writer.write(Chunk(now, octets))


def test_holding_and_input_registers_are_two_things(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    capture, draft = tmp_path / "two.cap.txt", tmp_path / "two.toml"
    asked_of(capture, [(7, 3, 0, [100, 5]), (7, 4, 0, [4000, 9, 11])])
    ran = sniff485("profile", "draft", capture, "-w", draft)
    assert ran.code == 0
    assert "each is described by itself" in ran.err
    profile = parse_text(draft.read_text(), "two.toml")
    places = [(entry.space, entry.address, entry.name) for entry in profile.entries]
    assert places == [
        ("holding", 0, "holding-40001"),
        ("holding", 1, "holding-40002"),
        ("input", 0, "input-30001"),
        ("input", 1, "input-30002"),
        ("input", 2, "input-30003"),
    ]
    only = sniff485("profile", "draft", capture, "--table", "input").out
    assert {entry.space for entry in parse_text(only, "only").entries} == {"input"}


@pytest.mark.parametrize("name", ["", "a b", "../up", "näme"])
def test_a_draft_has_a_name_that_a_profile_may_have(sniff485: Callable[..., Any], tmp_path: Path, name: str) -> None:
    capture = tmp_path / "meter.cap.txt"
    asked_of(capture, [(7, 3, 0, [100])])
    ran = sniff485("profile", "draft", capture, f"--name={name}")
    assert ran.code == 2
    assert "letters, digits" in ran.err


def test_stations_of_two_families_are_no_profile(sniff485: Callable[..., Any]) -> None:
    ran = sniff485("profile", "draft", "captures/rtu-clean.cap.txt", "captures/n2-clean.cap.txt")
    assert ran.code == 2
    assert "captures/n2-clean.cap.txt: n2" in ran.err


@pytest.mark.parametrize(("protocol", "station"), [("n2", 1), ("mstp", 5)])
def test_who_has_no_registers_is_told_where_the_values_are(
    sniff485: Callable[..., Any], protocol: str, station: int
) -> None:
    ran = sniff485("profile", "draft", f"captures/{protocol}-clean.cap.txt")
    assert ran.code == 3
    assert "sniff485 points" in ran.err
    assert "AO" in ran.err or "analog-output" in ran.err
    assert ": nobody answered registers, only other things" in ran.err
    ran = sniff485("profile", "draft", f"captures/{protocol}-clean.cap.txt", "--station", station)
    assert f": station {station} answered no registers, only other things" in ran.err


def test_a_draft_that_says_no_maker_shows_none(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    capture, draft = tmp_path / "meter.cap.txt", tmp_path / "meter.toml"
    meter(capture)
    assert sniff485("profile", "draft", capture, "-w", draft).code == 0
    shown = sniff485("profile", "show", draft).out.splitlines()
    assert shown[0] == "device: device (draft)"
    assert "source: none is said" in shown


def test_requests_without_answers_are_no_draft(sniff485: Callable[..., Any], tmp_path: Path) -> None:
    capture = tmp_path / "asked.cap.txt"
    with create(capture, Session("meter", LINE, "modbus-rtu", 0)) as writer:
        for turn in range(1, 9):
            writer.write(Chunk(turn * 1000 * MS, seal_rtu(struct.pack(">BBHH", 7, 3, 0, 2))))
    ran = sniff485("profile", "draft", capture)
    assert ran.code == 3
    assert "nobody answered a read of registers" in ran.err


@pytest.mark.parametrize("action", [("profile", "draft"), ("profile", "guess"), ("diff",)])
def test_a_capture_that_ends_too_early_is_said(
    sniff485: Callable[..., Any], tmp_path: Path, action: tuple[str, ...]
) -> None:
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    asked_of(whole, [(7, 3, 0, [100])])
    cut.write_bytes(whole.read_bytes()[:-40])
    named = (cut, cut) if action == ("diff",) else (cut,)
    ran = sniff485(*action, *named)
    assert "cut.mcap" in ran.err, ran


def test_profiles_are_listed_without_numpy() -> None:
    code = "import sys, sniff.cli.profile; print('numpy' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "False"


@pytest.mark.parametrize(("station", "code"), [((), 2), (("--station", 8), 0), (("--station", 9), 3)])
def test_one_station_is_drafted(
    sniff485: Callable[..., Any], tmp_path: Path, station: tuple[object, ...], code: int
) -> None:
    capture = tmp_path / "meter.cap.txt"
    meter(capture, (7, 8))
    ran = sniff485("profile", "draft", capture, *station)
    assert ran.code == code
    assert ("7, 8" in ran.err) == (code != 0)
