"""Serial drivers: what they can report and how long they hold octets back; a table, from their sources.

Linux kernel: drivers/usb/serial, drivers/usb/class/cdc-acm.c, drivers/tty/serial, drivers/tty/n_tty.c. Times marked
"assumed" have no such source: adapters differ, and only a measurement tells.
"""

from __future__ import annotations

import platform
import re
from dataclasses import dataclass, replace

from dissectors.line import MS

USB_FRAME = 1 * MS
"""A full-speed USB host polls once a frame of 1 ms (USB 2.0, 5.3)."""

ALL = ("parity", "framing", "break", "overrun")


@dataclass(frozen=True, slots=True)
class Driver:
    """One driver. `reports`: None where nobody knows. `hold`, `hold_chars`: ns and characters it may keep an octet.
    `packets`: as in `Adapter`.
    """

    name: str
    reports: tuple[str, ...] | None
    detail: str
    hold: int
    hold_from: str
    hold_chars: int = 0
    packets: bool | None = False


DRIVERS: dict[str, Driver] = {
    driver.name: driver
    for driver in (
        Driver(
            "ftdi_sio",
            ALL,
            "one flag covers a whole USB packet of up to 62 octets: an error is somewhere among the octets marked",
            17 * MS,
            "latency timer at its default of 16 ms + 1 ms USB",
            packets=True,
        ),
        Driver(
            "cp210x",
            ALL,
            "reported since Linux 5.9 and only while INPCK is set; no break on CP2102; some clones report nothing",
            4 * MS,
            "assumed for cp210x",
        ),
        Driver(
            "ch341",
            (),
            "the driver reports no line errors: none seen does not mean a clean line",
            4 * MS,
            "assumed for ch341",
        ),
        Driver("pl2303", ALL, "one flag covers a whole USB transfer", 4 * MS, "assumed for pl2303", packets=True),
        Driver(
            "cdc_acm",
            ("parity", "framing", "break", "overrun"),
            "one notification covers a whole transfer, and many devices send none",
            4 * MS,
            "assumed for cdc_acm",
            packets=True,
        ),
        Driver("8250", ALL, "per octet", 1 * MS, "FIFO timeout of 4 characters + 1 ms of scheduling", 4),
        Driver("pl011", ALL, "per octet", 1 * MS, "FIFO timeout of 4 characters + 1 ms of scheduling", 4),
        Driver(
            "pty",
            (),
            "a pseudo-terminal has no line, so no line errors",
            3 * MS,
            "one scheduler slice of the host",
        ),
    )
}

_ALIASES = {
    "ftdi_sio": r"ftdi.*",
    "cp210x": r"cp210.*",
    "ch341": r"ch34.*",
    "pl2303": r"pl2303.*",
    "cdc_acm": r"cdc_acm|usb_cdc",
    "8250": r".*8250.*|.*16550.*|dw-apb-uart|of_serial|serial",
    "pl011": r".*pl011.*",
    "pty": r"pty",
}

BY_VENDOR = {0x0403: "ftdi_sio", 0x10C4: "cp210x", 0x1A86: "ch341", 0x067B: "pl2303"}
"""USB vendor → driver, for systems that do not name one: how long the chip holds octets back is the same there."""

UNKNOWN = Driver(
    "", None, "unknown driver: errors may go unreported", 20 * MS, "assumed for an unknown driver", packets=None
)


def find_driver(name: str) -> Driver:
    """The driver of a kernel's name for it ("ftdi_sio", "serial8250"); UNKNOWN where the table has none."""
    if name in DRIVERS:
        return _today(DRIVERS[name])
    for known, pattern in _ALIASES.items():
        if re.fullmatch(pattern, name, re.IGNORECASE):
            return _today(DRIVERS[known])
    return UNKNOWN


def guess_driver(vendor: int | None) -> Driver:
    """The driver of a USB vendor where the system is not Linux; what it reports there is not known."""
    known = DRIVERS.get(BY_VENDOR.get(vendor or 0, ""))
    if known is None:
        return UNKNOWN
    return replace(known, reports=None, packets=None, detail="what this system's driver reports is not known")


def _today(driver: Driver) -> Driver:
    """cp210x before Linux 5.9 reports nothing (commit a7207e9835a4)."""
    if driver.name == "cp210x" and _kernel() < (5, 9):
        return replace(driver, reports=(), detail="no line errors before Linux 5.9")
    return driver


def _kernel() -> tuple[int, int]:
    match = re.match(r"(\d+)\.(\d+)", platform.release())
    if platform.system() != "Linux" or match is None:
        return (0, 0)
    return int(match[1]), int(match[2])
