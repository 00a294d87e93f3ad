from __future__ import annotations

import os
import subprocess
import sys

import pytest

from dissectors.line import LineSettings
from sniff.sources import drivers, ports
from sniff.sources.drivers import find_driver
from sniff.sources.ports import describe_port, find_holders, is_pty, latency_timer, list_ports


def test_what_drivers_report() -> None:
    assert find_driver("ch341").reports == ()
    assert "no line errors" in find_driver("ch341").detail
    assert find_driver("ch341-uart").reports == ()
    assert "packet" in find_driver("ftdi_sio").detail
    assert find_driver("serial8250").detail == "per octet"
    assert find_driver("uart-pl011").name == "pl011"
    assert find_driver("something-new").reports is None


@pytest.mark.parametrize(("release", "reported"), [("5.4.0-42", False), ("5.9.1", True), ("6.1.0-rpi", True)])
def test_cp210x_depends_on_the_kernel(monkeypatch: pytest.MonkeyPatch, release: str, reported: bool) -> None:
    monkeypatch.setattr(drivers.platform, "system", lambda: "Linux")
    monkeypatch.setattr(drivers.platform, "release", lambda: release)
    assert bool(find_driver("cp210x").reports) is reported


@pytest.fixture
def sysfs(tmp_path, monkeypatch):
    """A machine with an FTDI adapter on ttyUSB7 and a UART on ttyS9."""
    for tty, driver in (("ttyUSB7", "ftdi_sio"), ("ttyS9", "serial8250")):
        (tmp_path / "drivers" / driver).mkdir(parents=True)
        device = tmp_path / tty / "device"
        device.mkdir(parents=True)
        (device / "driver").symlink_to(tmp_path / "drivers" / driver)
    (tmp_path / "ttyUSB7" / "device" / "latency_timer").write_text("16\n")
    monkeypatch.setattr(ports, "_SYS", tmp_path)
    return tmp_path


def test_ftdi_latency_is_its_timer_and_a_usb_frame(sysfs) -> None:
    assert latency_timer("/dev/ttyUSB7") == 16
    adapter = describe_port("/dev/ttyUSB7")
    assert (adapter.driver, adapter.latency) == ("ftdi_sio", 17_000_000)
    assert "16 ms" in adapter.latency_from
    (sysfs / "ttyUSB7" / "device" / "latency_timer").write_text("1\n")
    assert describe_port("/dev/ttyUSB7").latency == 2_000_000


def test_a_uart_waits_for_characters(sysfs) -> None:
    slow, fast = (describe_port("/dev/ttyS9", LineSettings(baud)).latency for baud in (1200, 115200))
    assert slow - fast == 4 * (LineSettings(1200).char - LineSettings(115200).char)
    assert latency_timer("/dev/ttyS9") is None


def test_what_is_not_there_is_described_as_unknown() -> None:
    adapter = describe_port("/dev/ttyNOTHING")
    assert (adapter.name, adapter.reports) == ("unknown", None)


def test_pseudo_terminal(pty) -> None:
    assert is_pty(pty.path)
    adapter = describe_port(pty.path)
    assert (adapter.driver, adapter.reports) == ("pty", ())
    assert 0 < adapter.latency <= 5_000_000


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="no /proc here")
def test_who_holds_a_port(pty, tmp_path) -> None:
    link = tmp_path / "boiler"
    link.symlink_to(pty.path)
    code = f"import os; os.open({pty.path!r}, os.O_RDWR | os.O_NOCTTY); print('open', flush=True); input()"
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"open\n"
        holders = find_holders([str(link)])[str(link)]
        assert [holder.pid for holder in holders] == [process.pid]
        assert str(holders[0]).startswith(f"pid {process.pid} (python")
        process.communicate(b"\n")
    assert find_holders([str(link)]) == {}


def test_listing_needs_no_rights() -> None:
    assert all(port.device and port.adapter.name for port in list_ports())


def test_a_usb_chip_is_known_where_the_system_names_no_driver(monkeypatch) -> None:
    from types import SimpleNamespace

    import serial.tools.list_ports as tools

    port = SimpleNamespace(device="COM7", vid=0x0403, product="FT232R", description="", serial_number="A1")
    monkeypatch.setattr(tools, "comports", lambda: [port])
    adapter = describe_port("COM7")
    assert (adapter.name, adapter.serial_number, adapter.latency) == ("FT232R", "A1", 17_000_000)
    assert adapter.reports is None
    port.vid = None
    assert describe_port("COM7").latency == 20_000_000


def test_what_an_adapter_calls_itself_is_escaped(monkeypatch, capsys) -> None:
    from sniff.cli import main
    from sniff.engine.session import Adapter

    adapter = Adapter("\x1b[2Jadapter\u202e", "ftdi_sio", 0, "exact", ())
    monkeypatch.setattr(ports, "list_ports", lambda: [ports.PortInfo("/dev/ttyUSB0", adapter)])
    assert main(["ports"]) == 0
    said = capsys.readouterr().out
    assert r"\x1b[2Jadapter\u202e" in said
    assert "\x1b" not in said
