"""Octets in place of answers: are they always the same, and do they look like a line at a fraction of the baud rate?

A UART that listens k times too fast sees each bit of the line k bits long. Of a character it shows, in the order of
the line, the start bit, then the data bits, the lowest first:

    78h     0 000 1111 0|      two whole runs of 4, and one that the stop bit cuts off: 1/4 of the baud rate fits

So all runs but the last one of a character are multiples of k. Noise is not like that, nor is another protocol at the
same baud rate. Where that one speaks in text, its octets are printable, with a parity in bit 7 perhaps. Pure.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from math import log2
from string import ascii_letters, digits
from typing import Final

from dissectors.findings import Tally
from dissectors.modbus.functions import ITEMS_ASKED
from dissectors.modbus.lengths import MIN_FRAME

_FACTORS: Final = (8, 6, 5, 4, 3, 2)
_STRETCHES_KEPT = 32
_DIFFERENT_KEPT = 64
_LEAST = 3
_CERTAIN = 24  # bits: chance makes octets that fit so well once in 16 million
_MOST: Final = _FACTORS[0]
_LATE_EDGE: Final = 0x80  # a bit of eight: low up to the last data bit, or up to the end
_LONG = 6  # octets
_STRAY = 20  # one octet in so many may not fit: an edge that jitter moved
_PRINTABLE: Final = frozenset(b"\r\n\t") | frozenset(range(0x20, 0x7F))
_TEXT_BITS: Final = log2(256 / len(_PRINTABLE))  # that one of them is no chance
_LETTERS: Final = frozenset(ascii_letters.encode() + digits.encode())
_WORDY = 3  # of so many characters one is a letter or a digit
_KEPT_LEAST = 12  # bits
_CHANGED_LEAST = 3  # the same; fewer are noise on a copy
_MIXED = 8  # octets of text with bit 7 as parity that have it set, and so many that have not


def whole_runs(octet: int) -> list[int]:
    """Lengths of the runs of equal bits in a character, start bit first; without the last, which may go on."""
    bits = [0, *(octet >> bit & 1 for bit in range(8))]
    return [len(list(run)) for _, run in groupby(bits)][:-1]


def _fits(octet: int, factor: int) -> bool:
    return all(run % factor == 0 for run in whole_runs(octet))


_FITTING: Final = {factor: frozenset(o for o in range(256) if _fits(o, factor)) for factor in _FACTORS}


def slower_by(stretches: Iterable[bytes]) -> int | None:
    """The factor by which the sender is slower than the line is set, if the octets show it; None otherwise."""
    each = list(stretches)
    telling = [octet for octet in b"".join(each) if octet]  # a long low is 00 at any baud rate
    if len(set(telling)) < 2:
        return _MOST if set(telling) == {_LATE_EDGE} and _are_of_two_levels(each) else None
    for factor in _FACTORS:
        fitting = _FITTING[factor]
        strays = sum(octet not in fitting for octet in telling)
        if strays * _STRAY > len(telling):
            continue
        if (len(telling) - strays) * log2(255 / (len(fitting) - 1)) >= _CERTAIN:
            return factor
    return None


def text_of(stretches: Iterable[bytes]) -> tuple[str, str] | None:
    """The newest stretch as text, where all of them are text, and the parity that bit 7 is ("even", "odd", or "" where
    it is always 0); None otherwise."""
    each = list(stretches)
    octets = b"".join(each)
    if len(octets) * _TEXT_BITS < _CERTAIN:
        return None
    low = bytes(octet & 0x7F for octet in octets)
    if sum(octet in _PRINTABLE for octet in low) * _STRAY < (_STRAY - 1) * len(low):
        return None
    if _WORDY * sum(octet in _LETTERS for octet in low) < len(low):
        return None  # bits that ring are signs, too: @, space, `
    high = sum(octet > 0x7F for octet in octets)
    parity = ""
    if high * _STRAY > len(octets):
        odd = sum(octet.bit_count() & 1 for octet in octets)
        if min(odd, len(octets) - odd) * _STRAY > len(octets) or min(high, len(octets) - high) < _MIXED:
            return None
        parity = "odd" if odd else "even"
    return bytes(octet & 0x7F for octet in each[-1]).decode("ascii"), parity


def parity_of(stretches: Iterable[bytes]) -> str:
    """The parity that all octets have as seven bits and a parity bit read as eight ("even", "odd"); "" where they have
    none, or too few tell."""
    octets = b"".join(stretches)
    high = sum(octet > 0x7F for octet in octets)
    if min(high, len(octets) - high) < _MIXED or len(octets) < _CERTAIN:
        return ""
    odd = sum(octet.bit_count() & 1 for octet in octets)
    if min(odd, len(octets) - odd) * _STRAY > len(octets):
        return ""
    return "odd" if 2 * odd > len(octets) else "even"


def is_bad_copy(request: bytes, octets: bytes) -> bool:
    """Whether octets are a read given back in which several bits were read as 1 that were sent as 0, or the other way,
    and none otherwise: chance keeps so many bits of another frame hardly ever. (What repeats a write is its answer.)"""
    if len(octets) != len(request) or len(request) < MIN_FRAME or request[1] not in ITEMS_ASKED:
        return False
    sent, came = int.from_bytes(request, "big"), int.from_bytes(octets, "big")
    if (sent ^ came).bit_count() < _CHANGED_LEAST:
        return False
    if sent & came == sent:  # no 1 was read as 0
        return sent.bit_count() >= _KEPT_LEAST
    zeros = 8 * len(request) - sent.bit_count()
    return sent | came == sent and zeros >= _KEPT_LEAST


def _are_of_two_levels(stretches: Sequence[bytes]) -> bool:
    """Whether most are long and change between the only two octets there are where a bit outlasts a character: a
    break has none of the one, the ringing of a driver none of the other."""
    mixed = sum(len(one) >= _LONG and 4 * min(one.count(0), one.count(_LATE_EDGE)) >= len(one) for one in stretches)
    return mixed >= _LEAST and 4 * mixed >= 3 * len(stretches)


@dataclass(slots=True)
class Garbage:
    """What came in place of the answers of one station, and was none."""

    tally: Tally = field(default_factory=Tally)
    stretches: deque[bytes] = field(default_factory=lambda: deque(maxlen=_STRETCHES_KEPT))
    marked: int = 0  # of them with line errors
    begun: int = 0  # of them that begin as the answer should
    copied: int = 0  # of them the request, badly heard
    of_text: bool = False  # what should have come is text, too
    _counts: Counter[bytes] = field(default_factory=Counter)

    def add(
        self,
        octets: bytes,
        time: int,
        *frames: int | None,
        is_marked: bool = False,
        begins: bool = False,
        request: bytes = b"",
    ) -> None:
        """Count one more; `is_marked`: with line errors; `begins`: as the answer should; `request`: what was asked."""
        self.marked += is_marked
        self.copied += is_bad_copy(request, octets)
        self.begun += begins
        self.tally.add(time, *frames)
        self.stretches.append(octets)
        if octets in self._counts or len(self._counts) < _DIFFERENT_KEPT:
            self._counts[octets] += 1

    def always(self) -> bytes | None:
        """The octets, if they were the same nearly every time (at least three times and 3 in 4); None otherwise."""
        if not self._counts:
            return None
        octets, count = self._counts.most_common(1)[0]
        return octets if count >= _LEAST and 4 * count >= 3 * self.tally.count else None

    def slower_by(self) -> int | None:
        """See the function of that name; None where there is too little of it."""
        return slower_by(self.stretches) if self.tally.count >= _LEAST else None

    def text(self) -> tuple[str, str] | None:
        """See `text_of`; None where there is too little of it, or text is what should have come."""
        is_any = self.tally.count >= _LEAST and not self.of_text and 2 * self.begun <= self.tally.count
        return text_of(self.stretches) if is_any else None

    def parity(self) -> str:
        """See `parity_of`; "" where there is too little of it."""
        return parity_of(self.stretches) if self.tally.count >= _LEAST and not self.of_text else ""

    @property
    def is_copy(self) -> bool:
        """Whether nearly all of it is what was asked, badly heard."""
        return self.copied >= _LEAST and 4 * self.copied >= 3 * self.tally.count

    @property
    def is_system(self) -> bool:
        """Whether the sender makes it so: always the same, in longer bits, or text; not what spoils octets."""
        if self.is_copy or self.slower_by() is not None or self.text() is not None or self.parity():
            return True
        broken_on_the_way = 2 * self.marked > self.tally.count and 2 * self.begun > self.tally.count
        return self.always() is not None and not broken_on_the_way
