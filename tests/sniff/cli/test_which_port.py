"""PORT on the command line: words that are no port, and no word at all."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.cli import Failure, targets


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "nothing"))
    return tmp_path


def target(port: str | None) -> targets.Target:
    return targets.target_of(argparse.Namespace(port=port, line=None, protocol=None, devices=[]))


def test_a_bus_that_is_not_configured(folder: Path, sniff485: Callable) -> None:
    ran = sniff485("live", "boiler-room")
    assert ran.code == 2
    assert ran.err == (
        "sniff485: boiler-room: no such bus is configured: there is no sniff485.toml in this folder, in one above it, "
        "or in the user's configuration\n"
    )
    (folder / "sniff485.toml").write_text('[bus.roof]\nport = "/dev/ttyUSB7"\n')
    assert f"{folder / 'sniff485.toml'} has roof" in sniff485("record", "boiler-room").err


@pytest.mark.skipif(not Path("/dev/null").is_char_device(), reason="no /dev here")
def test_a_device_without_its_folder(folder: Path, sniff485: Callable) -> None:
    ran = sniff485("live", "null")
    assert ran.code == 2
    assert "did you mean /dev/null?" in ran.err


def test_a_port_without_its_folder_that_is_not_there(
    folder: Path, sniff485: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sniff.sources.ports.list_ports", list)
    ran = sniff485("record", "ttyUSB77")
    assert (ran.code, ran.err) == (2, "sniff485: ttyUSB77: no such port; this machine shows no serial ports\n")


@pytest.mark.parametrize("port", ["/dev/ttyUSB7", "COM3", "socket://127.0.0.1:1", "a.mcap"])
def test_what_may_be_a_port_is_left_to_the_port(folder: Path, port: str) -> None:
    assert target(port).source.spec == port


def test_the_only_port_is_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "sniff485.toml").write_text('[bus.roof]\nport = "/dev/ttyUSB7"\n')
    assert target(None).source.spec == "/dev/ttyUSB7"
    said = capsys.readouterr().err
    assert "no port named: listening to /dev/ttyUSB7, the only one there is" in said
    assert "assuming 19200,8E1 for modbus-rtu" in said


def test_no_port_at_all_is_a_failure(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sniff.sources.ports.list_ports", list)
    with pytest.raises(Failure, match="which port"):
        target(None)


@pytest.mark.parametrize(("port", "name"), [("/dev/pts/0", "pts-0"), ("/dev/ttyUSB0", "ttyUSB0")])
def test_the_name_of_a_recording_says_the_port(folder: Path, port: str, name: str) -> None:
    assert target(port).source.bus == name
    assert targets.new_recording(name).startswith(f"sniff485-{name}-")


def test_a_bus_may_be_called_what_no_file_can_be() -> None:
    assert targets.new_recording("north/boiler: 1").startswith("sniff485-north-boiler- 1-")
