"""Telnet (RFC 854) around serial octets, as gateways of RFC 2217 speak it: commands out, doubled 255 once. Pure."""

from __future__ import annotations

from enum import Enum, auto

IAC, SB, SE, WILL, DONT = 255, 250, 240, 251, 254


def begins(octets: bytes) -> bool:
    """Whether a stream that begins so negotiates, which no frame of a field bus looks like."""
    if len(octets) < 3 or octets[0] != IAC:
        return False
    return (WILL <= octets[1] <= DONT or octets[1] == SB) and octets[2] < 64


class _State(Enum):
    DATA = auto()
    COMMAND = auto()  # behind IAC
    OPTION = auto()  # behind WILL … DONT
    WITHIN = auto()  # of a subnegotiation
    WITHIN_COMMAND = auto()


class Telnet:
    """One direction of a connection."""

    def __init__(self) -> None:
        self._state = _State.DATA

    def strip(self, octets: bytes) -> bytes:
        """The serial octets in what came."""
        if self._state is _State.DATA and IAC not in octets:
            return octets
        kept = bytearray()
        for octet in octets:
            if self._state is _State.DATA and octet != IAC:
                kept.append(octet)
            elif self._state is _State.COMMAND and octet == IAC:
                kept.append(octet)
                self._state = _State.DATA
            else:
                self._state = self._after(octet)
        return bytes(kept)

    def _after(self, octet: int) -> _State:
        state = self._state
        if state is _State.DATA:
            return _State.COMMAND
        if state is _State.COMMAND:
            if WILL <= octet <= DONT:
                return _State.OPTION
            return _State.WITHIN if octet == SB else _State.DATA
        if state is _State.WITHIN:
            return _State.WITHIN_COMMAND if octet == IAC else _State.WITHIN
        if state is _State.WITHIN_COMMAND:
            return _State.DATA if octet == SE else _State.WITHIN
        return _State.DATA
