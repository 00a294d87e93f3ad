"""Access to the browser's page: viewers of this machine; others with a token. Pure.

A page of somebody else's, open in the same browser, can send requests here, too: so the name by which the server is
called must be its own (else a name that is made to point here would do), and a connection for the screen must come from
its own page.
"""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

LEAST_TOKEN = 16
"""Characters of a token."""

COOKIE = "sniff485"


def is_loopback(host: str) -> bool:
    """Whether an address is of this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True, slots=True)
class Access:
    """`token`: what viewers must know; empty: nothing. `remote`: whether others than this machine may come."""

    token: str = ""
    remote: bool = False

    def refusal(self, headers: Mapping[str, str], said: str, for_screen: bool) -> str:
        """Why a request is refused; empty where it may be answered. `said`: the token that came with it.

        `for_screen`: it is for the connection that carries keys and the screen.
        """
        host = headers.get("Host", "")
        if not self.remote and not is_loopback(_name(host)):
            return "this server is for this machine alone"
        origin = headers.get("Origin")
        if for_screen and (origin is None or urlsplit(origin).netloc != host):
            return "a screen is shown on this server's own page alone"
        if self.token and not self.knows(said):
            return "the token is wrong or missing: the page's address ends in ?token=…"
        return ""

    def knows(self, said: str) -> bool:
        """Whether that is the token; takes as long for any."""
        return hmac.compare_digest(said.encode(errors="replace"), self.token.encode())


def _name(host: str) -> str:
    """Of a Host header, without the port: "[::1]:8485" is ::1."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
