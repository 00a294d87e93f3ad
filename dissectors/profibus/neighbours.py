"""What begins and ends its frames as PROFIBUS does: FT 1.2, the form of M-Bus and of IEC 60870-5-101 to -103. Pure.

    10 C A CS 16              fixed; where an address has two octets 10 C A A CS 16, and 10 C CS 16 where there is none
    68 L L 68 C A … CS 16     of any length, with the sum of PROFIBUS
    E5                        all is well

Its frames of five octets tell it, which are most of what a master of it sends; PROFIBUS has six (10 DA SA FC FCS 16).
With addresses of two octets it has six, too: then what would be the frame control is their upper octet, and never asks.
"""

from __future__ import annotations

from dissectors.profibus.control import REQUEST
from dissectors.profibus.telegram import ED, FIXED, SD1, SD2

FT12 = "FT 1.2 (M-Bus, IEC 60870-5-101 to -103)"

_LEAST, _LEAST_OF_SIX = 2, 3
"""Frames that are no chance."""

_SHORT = (5, 4)


def neighbour(octets: bytes) -> str:
    """The protocol that these octets are, told by all of them together; "" where they may be PROFIBUS."""
    short, fixed, long = 0, list[int](), list[int]()
    at = 0
    while at < len(octets):
        size = _long(octets, at)
        if size:
            long.append(octets[at + 6])
        elif _fits(octets, at, FIXED[SD1]):
            size = FIXED[SD1]
            fixed.append(octets[at + 3])
        else:
            size = next((one for one in _SHORT if _fits(octets, at, one)), 0)
            short += size > 0
        at += size or 1
    if short >= _LEAST and short > len(fixed):
        return FT12
    are_addresses = len(fixed) >= _LEAST_OF_SIX and long and len({*fixed, *long}) == 1 and not fixed[0] & REQUEST
    return FT12 if are_addresses else ""


def _fits(octets: bytes, at: int, size: int) -> bool:
    """Whether a fixed frame of so many octets stands there: its last but one is the sum of those before."""
    frame = octets[at : at + size]
    return len(frame) == size and frame[0] == SD1 and frame[-1] == ED and sum(frame[1:-2]) & 0xFF == frame[-2]


def _long(octets: bytes, at: int) -> int:
    """Octets of the long frame that stands there, 0 for none."""
    head = octets[at : at + 4]
    if len(head) < 4 or head[0] != SD2 or head[3] != SD2 or head[1] != head[2] or head[1] < 3:
        return 0
    frame = octets[at : at + head[1] + 6]
    is_whole = len(frame) == head[1] + 6 and frame[-1] == ED and sum(frame[4:-2]) & 0xFF == frame[-2]
    return len(frame) if is_whole else 0
