"""A recording holds the device profiles in force: it says the same elsewhere, and after the profile has changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader

from dissectors.frame import Chunk
from dissectors.profiles.packaged import packaged
from sniff.cli import main
from sniff.devices import devices, noted, noted_devices, with_devices
from sniff.engine.capture import Capture
from sniff.engine.session import DEVICES_NOTE, LATEST
from sniff.formats import read
from sniff.recording.beginning import MOST_PROFILE
from sniff.recording.mcap_writer import create
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder

CAPTURE = Path(__file__).parents[3] / "captures" / "rtu-clean.cap.txt"
PUMP = """
name = "pump"
title = "A pump of the house"
vendor = "us"
models = ["P1"]
noun = "pump"
protocols = ["modbus-rtu"]
source = "its label"

[[modbus.register]]
address = 0x2520
name = "state-of-the-pump"
title = "state"
"""


def write(recorder: Recorder, capture: Capture) -> None:
    for item in capture.items():
        if isinstance(item, Chunk):
            recorder.chunk(item)
        else:
            recorder.line(item)
    recorder.close()


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording made where the profile was; where it is read, the profile is not."""
    at_site = tmp_path / "site"
    (at_site / "profiles").mkdir(parents=True)
    (at_site / "profiles" / "pump.toml").write_text(PUMP)
    target = tmp_path / "night.mcap"
    monkeypatch.chdir(at_site)
    assert main(["convert", str(CAPTURE), str(target), "-d", "1=pump", "-d", "2=teco-e510"]) == 0
    elsewhere = tmp_path / "desk"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    return target


def test_names_are_known_elsewhere(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["points", str(recorded)]) == 0
    ran = capsys.readouterr()
    assert "state-of-the-pump" in ran.out
    assert "not known here" not in ran.err
    assert noted(read(recorded).session) == ({"1": "pump", "2": "teco-e510"}, ())
    assert main(["show", str(recorded), "-c", "2"]) == 0
    assert "1 → state 36" in capsys.readouterr().out


def test_what_the_user_says_wins(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["points", str(recorded), "-d", "1=teco-e510"]) == 0
    assert "state-of-the-pump" not in capsys.readouterr().out


def test_stock_tools_see_them(recorded: Path) -> None:
    with recorded.open("rb") as stream:
        found = {one.name: one for one in make_reader(stream).iter_attachments()}
    assert found.keys() == {"pump.toml", "teco-e510.toml"}
    assert found["pump.toml"].data.decode() == PUMP
    assert found["teco-e510.toml"].data.decode() == packaged("teco-e510").document


def test_every_part_holds_them(tmp_path: Path) -> None:
    capture = read(CAPTURE)
    session = with_devices(capture.session, devices({"*": "teco-f510"}))
    write(Recorder(tmp_path / "parts.mcap", session, Rotation(count=20)), capture)
    parts = sorted(tmp_path.glob("parts-*.mcap"))
    assert len(parts) > 1
    for part in parts:
        default = noted_devices(read(part).session).default
        assert default is not None
        assert default.entries == packaged("teco-f510").entries


def test_a_copy_without_names_leaves_them_out(recorded: Path) -> None:
    assert main(["anonymise", str(recorded), "-o", "out.mcap"]) == 0
    assert b"pump of the house" not in Path("out.mcap").read_bytes()
    assert not read("out.mcap").session.profiles


@pytest.mark.parametrize(
    ("profiles", "why"),
    [
        ({"pump": "name = "}, "broken"),
        ({"pump": "x" * MOST_PROFILE}, "too long"),
        ({"../pump": PUMP}, "a path"),
        ({"pump": "\x00"}, "no text"),
    ],
)
def test_a_hostile_attachment_is_no_device(tmp_path: Path, profiles: Mapping[str, str], why: str) -> None:
    capture = read(CAPTURE)
    name = next(iter(profiles))
    session = replace(capture.session, notes={DEVICES_NOTE: f"1={name}"}, profiles=profiles)
    write(Recorder(tmp_path / "hostile.mcap", session), capture)
    found = read(tmp_path / "hostile.mcap")
    assert noted(found.session) == ({}, (f"1={name}",)), why
    assert list(found.items()) == list(capture.items())
    assert main(["points", str(tmp_path / "hostile.mcap")]) == 0


@pytest.mark.parametrize("started", [-(10**18), 10**40])
def test_a_start_that_no_attachment_can_have_keeps_them_all_the_same(tmp_path: Path, started: int) -> None:
    session = replace(read(CAPTURE).session, started=started, profiles={"pump": PUMP})
    with create(tmp_path / "old.mcap", session):
        pass
    found = read(tmp_path / "old.mcap").session
    assert (found.started, dict(found.profiles)) == (min(started, LATEST), {"pump": PUMP})
