"""Notifications of a service to systemd: one datagram a word, to the socket that the environment names.

Source: sd_notify(3), sd_watchdog_enabled(3): NOTIFY_SOCKET is a path, or a name of the abstract namespace where it
begins with "@"; WATCHDOG_USEC is the time after which a silent service is restarted, for the process WATCHDOG_PID.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping

READY, STOPPING, WATCHDOG = "READY=1", "STOPPING=1", "WATCHDOG=1"
_LONGEST = 200


class Notifier:
    """Tells whoever started this process, if anybody listens; never waits and never raises.

    `watchdog`: seconds within which WATCHDOG must be told; None where nobody asks for it.
    """

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        environment = os.environ if environment is None else environment
        self.watchdog = _watchdog(environment)
        self._address: str | None = None
        self._socket: socket.socket | None = None
        address = environment.get("NOTIFY_SOCKET", "")
        if address[:1] in ("/", "@") and hasattr(socket, "AF_UNIX"):
            self._address = "\0" + address[1:] if address[0] == "@" else address
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self._socket.setblocking(False)

    def tell(self, *words: str) -> bool:
        """Send assignments (READY, WATCHDOG …) as one message; whether somebody took it."""
        if self._socket is None or self._address is None:
            return False
        try:
            self._socket.sendto("\n".join(words).encode(), self._address)
        except OSError:
            return False
        return True

    def status(self, text: str) -> bool:
        """Send one line for people who ask the service manager."""
        return self.tell("STATUS=" + " ".join(text.split())[:_LONGEST])

    def close(self) -> None:
        """Nothing more will be told."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _watchdog(environment: Mapping[str, str]) -> float | None:
    text, pid = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", "")
    if not (text.isascii() and text.isdigit()) or int(text) == 0 or (pid and pid != str(os.getpid())):
        return None
    return int(text) / 1e6
