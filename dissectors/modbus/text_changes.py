"""Octets that something on the way took for text: what it made of them, and whether the check agrees without that.

A port in text mode, software flow control, Telnet and gateways that translate line ends change single values, whatever
they stand for in an RTU frame:

    sent       01 03 04 00 0D 11 27 …
    read       01 03 04 00 0A 11 27 …     CR read as LF (ICRNL of a terminal, text mode of a language)
    read       01 03 04 00 0D 27 …        XON and XOFF (11, 13) taken away by flow control

Noise changes other octets each time, and leaves those of text where they are. Pure.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import chain, combinations, product
from math import log2
from typing import Final

from dissectors.checksums import crc16_modbus
from dissectors.modbus.functions import EXCEPTION_BIT, answer_length
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME

Changed = tuple[bytes, int | None]
"""A damaged frame as it was read, and how long it was sent; None where nobody knows."""


class TextChange(Enum):
    """What became of octets, in words."""

    CR_AS_LF = "0D arrives as 0A"
    LF_AS_CR = "0A arrives as 0D"
    CR_BEFORE_LF = "0A arrives as 0D 0A"
    CR_MISSING = "0D never arrives"
    LF_MISSING = "0A never arrives"
    FLOW_MISSING = "11 and 13 never arrive"
    FF_TWICE = "FF arrives twice"
    FF_MISSING = "FF never arrives"


_REPLACED: Final = {TextChange.CR_AS_LF: (b"\n", b"\r"), TextChange.LF_AS_CR: (b"\r", b"\n")}
_JOINED: Final = {TextChange.CR_BEFORE_LF: (b"\r\n", b"\n"), TextChange.FF_TWICE: (b"\xff\xff", b"\xff")}
_MISSING: Final = {
    TextChange.CR_MISSING: b"\r",
    TextChange.LF_MISSING: b"\n",
    TextChange.FLOW_MISSING: b"\x11\x13",
    TextChange.FF_MISSING: b"\xff",
}
_KEPT: Final = 32
_TRIED_MOST: Final = 512  # ways in which one frame may be undone: with more, chance makes a check right too often
_MISSING_MOST: Final = 2
_LEAST: Final = 3  # frames
_CERTAIN: Final = 24  # bits: chance makes checks that agree so well once in 16 million
_CHECK_BITS: Final = 16
_REQUEST: Final = 8  # octets of those that ask for registers or coils, or write one
_OF_THAT_LENGTH: Final = range(1, 7)  # functions


def sent_length(request: bytes, octets: bytes) -> int | None:
    """Octets of the answer to a request, as it was sent, by the begin of what came."""
    return MIN_FRAME + 1 if octets[1:2] and octets[1] & EXCEPTION_BIT else answer_length(request)


def request_length(octets: bytes) -> int | None:
    """Octets of a request as it was sent, by what came of it."""
    return _REQUEST if octets[1:2] and octets[1] in _OF_THAT_LENGTH and len(octets) < _REQUEST else None


@dataclass(slots=True)
class TextDamage:
    """The newest damaged frames of one sender."""

    _frames: deque[Changed] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _count: int = 0
    _told: tuple[int, TextChange | None] = (0, None)  # of how many, and what

    def add(self, octets: bytes, length: int | None) -> None:
        """Take the next one."""
        self._frames.append((octets, length))
        self._count += 1

    @property
    def change(self) -> TextChange | None:
        """What nearly all of them have in common; None where the line may have damaged them."""
        if self._count != self._told[0]:
            shown = (change for change in TextChange if self.shows(change) >= _CERTAIN)
            self._told = self._count, next(shown, None)
        return self._told[1]

    def shows(self, change: TextChange) -> float:
        """How surely that one thing was done to them, in bits: those of all that differ; 0 where fewer than three, or
        3 in 4 of those that can tell, are good once it is undone."""
        each = ((octets, _agreement(change, octets, length)) for octets, length in self._frames)
        told = [(octets, bits) for octets, bits in each if bits is not None]
        count = sum(bits > 0 for _, bits in told)
        return sum(dict(told).values()) if count >= _LEAST and 4 * count >= 3 * len(told) else 0


def _agreement(change: TextChange, octets: bytes, length: int | None) -> float | None:
    """How surely a frame was changed so, in bits; 0 where it was not, None where it may have been."""
    ways = _ways_to_undo(change, octets, length)
    if ways is None:
        return None
    made = list(ways)
    agrees = any(MIN_FRAME <= len(one) <= MAX_FRAME and crc16_modbus(one[:length]) == 0 for one in made)
    return _CHECK_BITS - log2(len(made)) if agrees else 0


def _ways_to_undo(change: TextChange, octets: bytes, length: int | None) -> Iterator[bytes] | None:
    """What a frame may have been before that change; none where it cannot have happened to it, None where there are too
    many ways to tell."""
    if change in _REPLACED:
        came, sent = _REPLACED[change]
        octets = octets[:length]  # others may follow in the same read
        places = [place for place, octet in enumerate(octets) if octet == came[0]]
        if sent in octets:
            return iter(())
        return _with(octets, places, sent[0]) if 1 << len(places) <= _TRIED_MOST else None
    if change in _JOINED:
        twice, once = _JOINED[change]
        return iter(() if once in octets.replace(twice, b"") or twice not in octets else (octets.replace(twice, once),))
    values = _MISSING[change]
    if length is None:
        return None
    missing = length - len(octets)
    if missing < 1 or any(value in octets for value in values):
        return iter(())
    too_many = missing > _MISSING_MOST or (length * len(values)) ** missing > _TRIED_MOST * missing
    return None if too_many else _filled(octets, missing, values)


def _with(octets: bytes, places: Sequence[int], value: int) -> Iterator[bytes]:
    """A frame with that value at some of these places."""
    for chosen in chain.from_iterable(combinations(places, count) for count in range(1, len(places) + 1)):
        made = bytearray(octets)
        for place in chosen:
            made[place] = value
        yield bytes(made)


def _filled(octets: bytes, missing: int, values: bytes) -> Iterator[bytes]:
    """A frame with so many more octets of these values, anywhere."""
    for places in combinations(range(len(octets) + missing), missing):
        for filling in product(values, repeat=missing):
            made = bytearray(octets)
            for place, value in zip(places, filling, strict=True):
                made.insert(place, value)
            yield bytes(made)
