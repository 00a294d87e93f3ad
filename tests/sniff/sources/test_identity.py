from __future__ import annotations

import os
from types import SimpleNamespace

import pytest
import serial.tools.list_ports as tools

from sniff.sources.identity import PortIdentity


def usb(device: str, serial_number: str | None, location: str | None) -> SimpleNamespace:
    return SimpleNamespace(device=device, serial_number=serial_number, location=location)


@pytest.fixture
def plugged(monkeypatch):
    ports: list[SimpleNamespace] = []
    monkeypatch.setattr(tools, "comports", lambda: ports)
    return ports


def test_another_name_the_same_adapter(plugged) -> None:
    plugged[:] = [usb("/dev/ttyUSB0", "A1", "1-2:1.0"), usb("/dev/ttyUSB1", "B2", "1-3:1.0")]
    identity = PortIdentity.of("/dev/ttyUSB0")
    plugged[:] = [usb("/dev/ttyUSB0", "B2", "1-3:1.0")]
    assert identity.find() is None, "the same name is another adapter now"
    plugged.append(usb("/dev/ttyUSB5", "A1", "2-1:1.0"))
    assert identity.find() == "/dev/ttyUSB5"


def test_an_adapter_with_four_ports_has_one_serial_number(plugged) -> None:
    four = [usb(f"/dev/ttyUSB{number}", "Q4", f"1-2:1.{number}") for number in range(4)]
    plugged[:] = four
    identity = PortIdentity.of("/dev/ttyUSB2")
    plugged[:] = [usb(f"/dev/ttyUSB{number + 4}", "Q4", f"3-1:1.{number}") for number in range(4)]
    assert identity.find() == "/dev/ttyUSB6"


def test_an_adapter_without_number_is_known_by_its_socket(plugged) -> None:
    plugged[:] = [usb("/dev/ttyUSB0", None, "1-2"), usb("/dev/ttyUSB1", None, "1-3")]
    identity = PortIdentity.of("/dev/ttyUSB1")
    plugged[:] = [usb("/dev/ttyUSB0", None, "1-3")]
    assert identity.find() == "/dev/ttyUSB0"


def test_the_name_that_the_user_gave_is_kept(plugged, tmp_path) -> None:
    device = tmp_path / "ttyUSB0"
    device.touch()
    name = tmp_path / "boiler"
    name.symlink_to(device)
    plugged[:] = [usb(str(device), "A1", "1-2:1.0")]
    identity = PortIdentity.of(str(name))
    assert identity.serial_number == "A1"
    assert identity.find() == str(name)


def test_a_port_without_usb_is_known_by_its_path(plugged, tmp_path) -> None:
    device = tmp_path / "ttyS0"
    device.touch()
    identity = PortIdentity.of(str(device))
    assert identity.find() == str(device)
    device.unlink()
    assert identity.find() is None


def test_the_number_of_a_pseudo_terminal_may_be_somebody_elses(pty, tmp_path) -> None:
    assert PortIdentity.of(pty.path).find() is None
    link = tmp_path / "bus"
    link.symlink_to(pty.path)
    identity = PortIdentity.of(str(link))
    assert identity.find() is None
    link.unlink()
    other = tmp_path / "other"
    other.symlink_to(pty.path)
    os.rename(other, link)
    assert identity.find() == str(link)
    assert identity.renewed().find() is None
