"""The open request: what the bus waits for, and how well octets fit as its answer.

A framer needs only this much memory of the exchange, to weigh candidates; pairing for people is the tracker's.
"""

from __future__ import annotations

from typing import NamedTuple

from dissectors.modbus.functions import (
    BROADCAST,
    DIAGNOSTIC_LISTEN_ONLY,
    EXCEPTION_BIT,
    EXCEPTION_LENGTH,
    FUNCTIONS,
    answer_length,
)
from dissectors.modbus.lengths import Octets
from dissectors.modbus.notation import CHECK

EXACT = 14
"""Bits that an answer of the right station, function and length is worth."""

LOOSE = 12
"""The same where the request leaves the length open."""

REPEATED = 14
"""Bits for the open request once more, octet for octet: a retry, or an answer that echoes."""

ODD = 2
"""Bits for an answer of the right station and function with another length than was asked for."""

SAME_UNKNOWN = 14
"""Bits for a station and a function of unknown layout that were named just before: nothing else makes them likely."""


SEARCHED = 8
"""Bits for the open request once more, octet for octet, to the unit behind: a master that looks who is there."""


class Expected(NamedTuple):
    """A request without an answer yet. `length`: octets of its normal answer, None when only its data tell."""

    unit: int
    function: int
    length: int | None
    octets: bytes

    def is_for(self, octets: Octets, start: int) -> bool:
        """Whether the head at `start` names the station and the function asked, as an exception or not."""
        return octets[start] == self.unit and octets[start + 1] & ~EXCEPTION_BIT == self.function

    def is_searched_on(self, octets: bytes) -> bool:
        """Whether a frame asks the unit behind for the same, which nobody does who waits for this one."""
        return octets[0] == self.unit + 1 and octets[1:-CHECK] == self.octets[1:-CHECK]

    def fit(self, octets: bytes, response: bool) -> int:
        """Bits that a complete frame gains from being expected (0: it is not); `response`: whether it can be one."""
        if octets[0] != self.unit:
            return SEARCHED if self.is_searched_on(octets) else 0
        code, length = octets[1], len(octets)
        if code == self.function | EXCEPTION_BIT:
            return EXACT if length == EXCEPTION_LENGTH else 0
        if code != self.function:
            return 0
        if octets == self.octets:
            return EXACT if self.length == length else self._loose(REPEATED)
        if self.length is None:
            return self._loose(LOOSE)
        if not response:
            return 0
        return EXACT if length == self.length else ODD

    def hope(self, octets: Octets, start: int, length: int) -> int:
        """The same for a frame that is not complete: what it may gain."""
        if octets[start] != self.unit or octets[start + 1] != self.function:
            return 0
        if self.length is None:
            return LOOSE
        return EXACT if length in (self.length, len(self.octets)) else ODD

    def _loose(self, bits: int) -> int:
        return bits if self.function in FUNCTIONS else SAME_UNKNOWN


def expectation(open_request: Expected | None, octets: bytes, request: bool, response: bool) -> Expected | None:
    """What the bus waits for after a good frame.

    `request`, `response`: what its length allows it to be. A frame that can be the open request's answer is; what
    else can be a request is one.
    """
    if open_request is not None and response and _answers(open_request, octets):
        return None
    if not request or octets[0] == BROADCAST or octets[1] & EXCEPTION_BIT:
        return None
    if octets[1] == 0x08 and octets[2:4] == bytes((0, DIAGNOSTIC_LISTEN_ONLY)):
        return None
    known = octets[1] in FUNCTIONS
    return Expected(octets[0], octets[1], answer_length(octets) if known else None, octets)


def _answers(request: Expected, octets: bytes) -> bool:
    if octets[0] != request.unit or octets[1] & ~EXCEPTION_BIT != request.function:
        return False
    if octets[1] & EXCEPTION_BIT or request.length is None or request.length == len(octets):
        return True
    # a wrong length from the right station is its answer all the same, unless the frame reads as the next request
    return octets[1] not in FUNCTIONS or len(octets) != len(request.octets)
