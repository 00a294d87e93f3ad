"""The station that a damaged frame names, where its first octets do not say so rightly. Pure.

A frame to or from a station that nobody ever heard of names it wrongly, more likely than not. An LRC is a sum: if all
but the unit came right, it tells what the unit was. That is believed where it is a station that is known, and where one
of the two characters of the unit agrees: by chance that is so once in some hundred frames.
"""

from __future__ import annotations

from collections.abc import Collection

from dissectors.frame import Check, Damage, Frame, Role
from dissectors.modbus.envelope import ASCII_NAME, ascii_octets
from dissectors.modbus.exchange import Seen
from dissectors.modbus.functions import EXCEPTION_BIT, FUNCTIONS

_LEAST = 4  # unit, function, one octet of data, LRC
_NAMED = 3  # octets of a frame, characters in ASCII, that say whose it is


def unit_of(frame: Frame, unit: int | None, known: Collection[int]) -> int | None:
    """The station that a damaged frame names: `unit`, as read, or what its check makes of it."""
    if unit is None or unit in known or frame.protocol != ASCII_NAME:
        return unit
    if frame.damage is not Damage.CHECK or frame.check is not Check.BAD:
        return unit
    octets = ascii_octets(frame)
    if len(octets) < _LEAST:
        return unit
    meant = -sum(octets[1:]) & 0xFF
    is_near = meant >> 4 == unit >> 4 or meant & 0x0F == unit & 0x0F
    return meant if meant in known and is_near else unit


def names_another(seen: Seen, asked: int, known: Collection[int]) -> bool:
    """Whether a damaged frame names a station that is known, and another one than was `asked`.

    What has the shape of an answer came from the one that was asked, whatever is left of its name; and where the
    adapter marked the name, it is not to be relied on.
    """
    if any(mark.offset < _NAMED for mark in seen.frame.marks):
        return False
    if seen.unit == asked or seen.unit not in known or seen.header.role is Role.RESPONSE:
        return False
    return len(seen.octets) < 2 or seen.octets[1] & ~EXCEPTION_BIT in FUNCTIONS
