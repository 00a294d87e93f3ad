"""The serial ports of this machine: what they are, what they can report, who holds them."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from dissectors.line import MS, LineSettings
from sniff.engine.session import Adapter
from sniff.sources.drivers import UNKNOWN, USB_FRAME, Driver, find_driver, guess_driver

CAPTURE_PROCESS = b"sniff.capture.process"
"""In the command line of our own capture process; what follows says what it does."""

_SYS = Path("/sys/class/tty")
_PROC = Path("/proc")
_BY_NAME = (("ttyS", "8250"), ("ttyAMA", "pl011"), ("ttyACM", "cdc_acm"))


@dataclass(frozen=True, slots=True)
class Holder:
    """A process that has a port open."""

    pid: int
    name: str

    def __str__(self) -> str:
        return f"pid {self.pid} ({self.name})"


@dataclass(frozen=True, slots=True)
class PortInfo:
    """One serial port. `latency_timer`: ms, FTDI only, None where there is none. `holders`: those that may be seen."""

    device: str
    adapter: Adapter
    latency_timer: int | None = None
    holders: tuple[Holder, ...] = ()


def list_ports() -> list[PortInfo]:
    """All serial ports, by name. Needs no rights; where the system hides something, less is said."""
    from serial.tools import list_ports as tools

    found = sorted((str(port.device) for port in tools.comports()), key=_natural)
    held = find_holders(found)
    return [
        PortInfo(device, describe_port(device), latency_timer(device), tuple(held.get(device, ()))) for device in found
    ]


def describe_port(device: str, line: LineSettings | None = None) -> Adapter:
    """The adapter behind a port and how long it may hold octets back. Total: what is unknown is said to be.

    `line`: for UARTs whose FIFO waits for characters; 9600 Bd is assumed without it.
    """
    product = _product(device)
    driver_name = _driver_name(device)
    driver = find_driver(driver_name) if driver_name else guess_driver(product.vendor)
    reports, detail = driver.reports, driver.detail
    if os.name != "posix":
        reports, detail = (), "this system hands over no line errors: none seen does not mean a clean line"
    latency, latency_from = _latency(device, driver, line or LineSettings())
    return Adapter(
        name=product.name or driver.name or "unknown",
        driver=driver_name,
        latency=latency,
        latency_from=latency_from,
        reports=reports,
        detail=detail,
        serial_number=product.serial_number,
        packets=driver.packets,
    )


def latency_timer(device: str) -> int | None:
    """FTDI's latency timer, ms; None where there is none."""
    for folder in (_SYS / _tty(device) / "device", Path("/sys/bus/usb-serial/devices") / _tty(device)):
        try:
            return int((folder / "latency_timer").read_text().strip())
        except (OSError, ValueError):
            continue
    return None


def find_holders(devices: list[str]) -> dict[str, list[Holder]]:
    """Which processes have which ports open, as far as this user may see (/proc); empty where there is no /proc."""
    wanted: dict[str, list[str]] = {}
    for device in devices:
        wanted.setdefault(os.path.realpath(device), []).append(device)
    held: dict[str, list[Holder]] = {}
    for process in _PROC.glob("[0-9]*"):
        for target in _open_files(process):
            for device in wanted.get(target, ()):
                holder = Holder(int(process.name), _process_name(process))
                if holder not in held.setdefault(device, []):
                    held[device].append(holder)
    return held


def is_tty(device: str) -> bool:
    """Whether a path leads to a terminal device, by the system's own list; True where there is no such list."""
    try:
        number = os.stat(device).st_rdev
        kind = os.path.realpath(f"/sys/dev/char/{os.major(number)}:{os.minor(number)}/subsystem")
    except (AttributeError, OSError):
        return True
    return is_pty(device) or not _SYS.exists() or os.path.basename(kind) == "tty"


def is_pty(device: str) -> bool:
    """Whether a path leads to a pseudo-terminal."""
    return os.path.realpath(device).startswith("/dev/pts/")


def _open_files(process: Path) -> set[str]:
    try:
        return {os.readlink(entry.path) for entry in os.scandir(process / "fd")}
    except OSError:
        return set()  # not ours to see, or gone meanwhile


def _process_name(process: Path) -> str:
    try:
        words = (process / "cmdline").read_bytes().split(b"\0")
    except OSError:
        return "?"
    if CAPTURE_PROCESS in words:
        said = words[words.index(CAPTURE_PROCESS) + 1 :]
        return _printable(b" ".join([b"sniff485", *filter(None, said)]))
    try:
        return _printable((process / "comm").read_bytes().strip()) or "?"
    except OSError:
        return "?"


def _printable(name: bytes) -> str:
    """A process may call itself anything."""
    return "".join(character if character.isprintable() else "?" for character in name.decode("utf-8", "replace"))


def _tty(device: str) -> str:
    return os.path.basename(os.path.realpath(device))


def _natural(name: str) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", name)]


def _driver_name(device: str) -> str:
    if is_pty(device):
        return "pty"
    for link in ("device/driver", "device/../driver", "device/../../driver"):
        path = _SYS / _tty(device) / link
        if path.exists():
            name = os.path.basename(os.path.realpath(path))
            if find_driver(name) is not UNKNOWN:
                return name
    for prefix, name in _BY_NAME:
        if _tty(device).startswith(prefix):
            return name
    return ""


@dataclass(frozen=True, slots=True)
class _Product:
    """What an adapter says about itself."""

    name: str = ""
    serial_number: str = ""
    vendor: int | None = None


def _product(device: str) -> _Product:
    if is_pty(device):
        return _Product("pseudo-terminal")
    from serial.tools import list_ports as tools

    real = os.path.realpath(device)
    for port in tools.comports():
        if port.device in (device, real):
            name = port.product or (port.description if port.description != "n/a" else "")
            return _Product(str(name or ""), str(port.serial_number or ""), port.vid)
    return _Product()


def _latency(device: str, driver: Driver, line: LineSettings) -> tuple[int, str]:
    timer = latency_timer(device)
    if timer is not None:
        return timer * MS + USB_FRAME, f"latency timer {timer} ms + 1 ms USB"
    return driver.hold + driver.hold_chars * line.char, driver.hold_from
