"""The identity of a port: how it is recognised when it comes back after it was unplugged."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sniff.sources.ports import is_pty

if TYPE_CHECKING:
    from serial.tools.list_ports_common import ListPortInfo


@dataclass(frozen=True, slots=True)
class PortIdentity:
    """What was known of a port while it was open. `spec`: as the user named it.

    `serial_number`, `location`: of a USB adapter, "" where it has none. A location is socket and interface
    ("1-2.3:1.1"); adapters with several ports have one serial number and differ by the interface. `link`: inode, change
    time and target of a symbolic link, None for other names.
    """

    spec: str
    serial_number: str = ""
    location: str = ""
    link: tuple[int, int, str] | None = None

    @classmethod
    def of(cls, spec: str) -> PortIdentity:
        """Of a port that is there now."""
        real = os.path.realpath(spec)
        for port in [] if is_pty(spec) else _ports():
            if port.device in (spec, real):
                return cls(spec, str(port.serial_number or ""), str(port.location or ""), _link(spec))
        return cls(spec, link=_link(spec))

    def renewed(self) -> PortIdentity:
        """The same adapter, after its name was made anew."""
        return replace(self, link=_link(self.spec))

    def find(self) -> str | None:
        """Where the port is now, None while it is absent. The user's name is kept where it leads to the same port.

        The number of a pseudo-terminal is soon given to somebody else's terminal: only a link made anew is followed.
        """
        found = self._find_usb()
        if found is not None:
            return self.spec if os.path.realpath(self.spec) == os.path.realpath(found) else found
        if self.serial_number or not os.path.exists(self.spec):
            return None
        if is_pty(self.spec) and (self.link is None or _link(self.spec) == self.link):
            return None
        return self.spec

    def _find_usb(self) -> str | None:
        """The same serial number and interface; for an adapter without number, the same socket."""
        if not self.serial_number and not self.location:
            return None
        for port in _ports():
            location = str(port.location or "")
            if self.serial_number:
                same = port.serial_number == self.serial_number and _interface(location) == _interface(self.location)
            else:
                same = location == self.location
            if same:
                return str(port.device)
        return None


def _ports() -> list[ListPortInfo]:
    from serial.tools import list_ports

    return list(list_ports.comports())


def _interface(location: str) -> str:
    """The interface of a location: "1-2.3:1.1" gives "1.1"."""
    return location.partition(":")[2]


def _link(spec: str) -> tuple[int, int, str] | None:
    try:
        found = os.lstat(spec)
        return found.st_ino, found.st_ctime_ns, os.readlink(spec)
    except OSError:
        return None
