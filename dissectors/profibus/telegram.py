"""A telegram taken apart, and put together. README.md draws the five kinds.

`parse` is total: what is cut off is empty. Whether the check and the end are right is `envelope.py`'s.
"""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.checksums import sum8
from dissectors.profibus.control import Control
from dissectors.quick_values import quickly_made

SD1, SD2, SD3, SD4, SC, ED = 0x10, 0x68, 0xA2, 0xDC, 0xE5, 0x16
BROADCAST = 127
SYN = 33
"""Bit times of silence that a master keeps before each request, at least (TSYN)."""

HIGHEST = 126
"""The highest address of a station."""

LEAST_LE, MOST_LE = 3, 249
LONGEST = MOST_LE + 6
FIXED = {SD1: 6, SD3: 14, SD4: 3, SC: 1}
"""Octets of the telegrams whose length their start says."""

_EXTENSION = 0x80
_SEGMENT = 0x40


@quickly_made
@dataclass(frozen=True, slots=True)
class Telegram:
    """One telegram. `start`: its start delimiter. None where it has no such thing, or ended before it.

    `destination`, `source`: 0 … 127. `control`: the frame control octet. `dsap`, `ssap`: service access points, the
    first of several extensions that is one. `data`: what follows them, up to the check. `extended`: octets of address
    extensions in front of `data`.
    """

    start: int
    destination: int | None = None
    source: int | None = None
    control: Control | None = None
    dsap: int | None = None
    ssap: int | None = None
    data: bytes = b""
    extended: int = 0

    @property
    def is_token(self) -> bool:
        """Whether it passes the right to send."""
        return self.start == SD4

    @property
    def is_short(self) -> bool:
        """Whether it is a short acknowledgement."""
        return self.start == SC

    @property
    def is_request(self) -> bool:
        """Whether a master sends it to others; a token is none."""
        return self.control is not None and self.control.is_request


def body_of(octets: bytes) -> bytes:
    """What is checked: from the destination to the last octet of data; without the check of a whole telegram."""
    length = _spoilt_length(octets)
    begin = 4 if length or octets[:1] == bytes((SD2,)) else 1
    if begin == 4 and len(octets) > 4:
        end = begin + (length or octets[1])
        return octets[begin : min(end, len(octets))]
    size = FIXED.get(octets[0], len(octets)) if octets else 0
    return octets[begin : size - 2] if len(octets) >= size else octets[begin:]


def _spoilt_length(octets: bytes) -> int:
    """The length of a telegram of which one octet of the head is spoilt, and nothing missing; else 0."""
    for length in dict.fromkeys(octets[1:3]):
        if len(octets) == length + 6 and length >= LEAST_LE:
            head = bytes((SD2, length, length, SD2))
            if sum(a == b for a, b in zip(head, octets, strict=False)) == 3:
                return length
    return 0


def parse(octets: bytes) -> Telegram:
    """The parts of a telegram; total."""
    if not octets:
        return Telegram(0)
    start = octets[0]
    if start == SC:
        return Telegram(start)
    if start == SD4:
        return _addressed(start, octets[1:3])
    body = body_of(octets)
    if len(body) < 3:
        return _addressed(start, body)
    at = 3
    dsap, at = _extensions(body, at) if body[0] & _EXTENSION else (None, at)
    ssap, at = _extensions(body, at) if body[1] & _EXTENSION else (None, at)
    return Telegram(start, body[0] & 0x7F, body[1] & 0x7F, Control(body[2]), dsap, ssap, body[at:], at - 3)


def _addressed(start: int, octets: bytes) -> Telegram:
    """A telegram of which the addresses, or less, are there."""
    destination, source = (octets[at] & 0x7F if len(octets) > at else None for at in (0, 1))
    return Telegram(start, destination, source)


def _extensions(body: bytes, at: int) -> tuple[int | None, int]:
    """The service access point in a row of extensions, and where the row ends."""
    point = None
    while at < len(body):
        octet = body[at]
        at += 1
        if not octet & _SEGMENT and point is None:
            point = octet & 0x3F
        if not octet & _EXTENSION:
            break
    return point, at


def telegram(
    destination: int,
    source: int,
    control: int,
    data: bytes = b"",
    dsap: int | None = None,
    ssap: int | None = None,
) -> bytes:
    """A whole telegram, check and end included: SD1 without data, else SD2."""
    extensions = bytes(point for point in (dsap, ssap) if point is not None)
    head = bytes(
        (
            destination | (_EXTENSION if dsap is not None else 0),
            source | (_EXTENSION if ssap is not None else 0),
            control,
        )
    )
    body = head + extensions + data
    if len(body) == 3:
        return bytes((SD1,)) + body + bytes((sum8(body), ED))
    return bytes((SD2, len(body), len(body), SD2)) + body + bytes((sum8(body), ED))


def token(destination: int, source: int) -> bytes:
    """A token."""
    return bytes((SD4, destination, source))
