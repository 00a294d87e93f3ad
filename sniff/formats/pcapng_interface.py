"""An interface of a pcapng file: whose packets, in which unit of time."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

OPT_END, OPT_TSRESOL, OPT_TSOFFSET = 0, 9, 14
ANY = 1 << 32


@dataclass(frozen=True, slots=True)
class Interface:
    """What a section says of an interface."""

    link_type: int
    resolution: tuple[int, int] = (1000, 1)  # ns per tick as a fraction
    offset: int = 0  # s
    longest: int = ANY  # octets of a packet that are kept


def interface_of(order: str, body: bytes) -> Interface:
    """The interface that a block describes. Total."""
    resolution, offset = (1000, 1), 0
    for code, value in options(order, body[8:]):
        if code == OPT_TSRESOL and value:
            power = value[0] & 0x7F
            ticks = 2**power if value[0] & 0x80 else 10 ** min(power, 30)
            resolution = (1_000_000_000, ticks)
        elif code == OPT_TSOFFSET and len(value) == 8:
            offset = struct.unpack(order + "q", value)[0]
    link_type, longest = struct.unpack_from(order + "HxxI", body)
    return Interface(link_type, resolution, offset, longest or ANY)


def options(order: str, data: bytes) -> Iterator[tuple[int, bytes]]:
    """Code and value of each option. Total."""
    at = 0
    while at + 4 <= len(data):
        code, size = struct.unpack_from(order + "HH", data, at)
        if code == OPT_END or at + 4 + size > len(data):
            return
        yield code, data[at + 4 : at + 4 + size]
        at += 4 + size + (-size % 4)
