"""Take Telnet apart: data here, commands there (RFC 854, RFC 855). Pure, total, bounded.

FF FF                    data octet FF
FF FB…FE option          WILL, WONT, DO, DONT
FF FA … FF F0            subnegotiation
FF anything else         a command without meaning here

Within a subnegotiation only FF F0 ends it; FF and anything else is passed over there. What grows beyond all that RFC
2217 knows has lost its end: nobody can say any more what is data, so nothing is, until the connection is made anew.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

_IAC, _SB, _SE = 0xFF, 0xFA, 0xF0
_NEGOTIATIONS = range(0xFB, 0xFF)
LONGEST = 1024
"""Octets that a subnegotiation may have; RFC 2217 needs fewer than 260."""


@dataclass(frozen=True, slots=True)
class Data:
    """Octets of the line."""

    octets: bytes


@dataclass(frozen=True, slots=True)
class Negotiation:
    """WILL, WONT, DO or DONT (`command`) for an `option`."""

    command: int
    option: int


@dataclass(frozen=True, slots=True)
class Subnegotiation:
    """What was between SB and SE."""

    octets: bytes


@dataclass(frozen=True, slots=True)
class OutOfStep:
    """A subnegotiation that does not end: from here on everything is dropped. `octets`: how many of it there were."""

    octets: int


Token = Data | Negotiation | Subnegotiation | OutOfStep


class _State(Enum):
    DATA = auto()
    COMMAND = auto()
    OPTION = auto()
    SUB = auto()
    SUB_COMMAND = auto()
    LOST = auto()


class TelnetDecoder:
    """Gives what a stream says, in its order; any cut of the stream gives the same data."""

    def __init__(self) -> None:
        self._state = _State.DATA
        self._command = 0
        self._sub = bytearray()

    def feed(self, octets: bytes) -> list[Token]:
        """Tokens that are complete now. Never raises."""
        if self._state is _State.LOST:
            return []
        if self._state is _State.DATA and _IAC not in octets:
            return [Data(octets)] if octets else []
        tokens: list[Token] = []
        data = bytearray()
        for octet in octets:
            token = self._step(octet, data)
            if token is not None:
                if data:
                    tokens.append(Data(bytes(data)))
                    data.clear()
                tokens.append(token)
        if data:
            tokens.append(Data(bytes(data)))
        return tokens

    def _step(self, octet: int, data: bytearray) -> Token | None:
        state = self._state
        if state is _State.DATA:
            if octet == _IAC:
                self._state = _State.COMMAND
            else:
                data.append(octet)
        elif state is _State.COMMAND:
            self._state = _State.DATA
            if octet == _IAC:
                data.append(_IAC)
            elif octet == _SB:
                self._sub.clear()
                self._state = _State.SUB
            elif octet in _NEGOTIATIONS:
                self._command = octet
                self._state = _State.OPTION
        elif state is _State.OPTION:
            self._state = _State.DATA
            return Negotiation(self._command, octet)
        elif state is _State.SUB:
            if octet == _IAC:
                self._state = _State.SUB_COMMAND
            else:
                return self._keep(octet)
        elif state is _State.SUB_COMMAND:
            self._state = _State.SUB
            if octet == _SE:
                self._state = _State.DATA
                return Subnegotiation(bytes(self._sub))
            if octet == _IAC:
                return self._keep(octet)
        return None

    def _keep(self, octet: int) -> Token | None:
        self._sub.append(octet)
        if len(self._sub) <= LONGEST:
            return None
        self._state = _State.LOST
        return OutOfStep(len(self._sub))
