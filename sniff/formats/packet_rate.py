"""A slower baud rate than the usual one, told by the ends of packets; for packet files that name none.

A packet takes as long as its octets do, so it cannot end sooner behind the one before. At too high a rate long packets
seem to come after a silence that grows with their length. Only what long packets of different lengths show alike is
believed: they fill the time since the packet before them, and none needs more.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import islice

from dissectors.frame import Chunk
from dissectors.line import LineSettings, Timing
from sniff.engine.session import Session
from sniff.formats.records import PacketRecord, items_of

LOOKED_AT = 4096
"""Packets from the begin of a file."""

_RATES = (1200, 2400, 4800, 9600, 19200, 38400, 57600)
_LONG = 48  # octets: with so many the time that they take stands out from pauses
_LEAST = 8  # long packets
_FILLED = 1.6  # times as long as its octets take: hardly more than the time to begin was before them
_QUICKEST = 0.1  # of the long packets
_ROUNDED = 1_000_000  # ns by which a time may be off
_STRANGE = 0.002  # of all packets: late reads, and clocks that jump


def at_shown_rate(session: Session, records: Iterable[PacketRecord]) -> Session:
    """What is known of a file, with the rate that its packets show where it is slower than the one assumed."""
    items = (item for record in islice(records, LOOKED_AT) for item in items_of(record, session.protocol))
    slower = slower_line((item for item in items if isinstance(item, Chunk)), session.line)
    return session if slower is None else replace(session, line=slower)


def slower_line(chunks: Iterable[Chunk], usual: LineSettings) -> LineSettings | None:
    """The settings with the rate that packets show, where it is slower than `usual`; None where they show none."""
    rooms: list[tuple[int, int]] = []
    before: int | None = None
    for chunk in chunks:
        if chunk.octets:
            if before is not None:
                rooms.append((len(chunk.octets), chunk.time - before))
            before = chunk.time
    of_length = sorted(room for room in rooms if room[0] >= _LONG)
    if len(of_length) < _LEAST or 3 * of_length[0][0] > 2 * of_length[-1][0]:
        return None
    for baud in _RATES:
        line = replace(usual, baud=baud)
        if baud < usual.baud and _fits(rooms, of_length, line):
            return line
    return None


def _fits(rooms: Sequence[tuple[int, int]], of_length: Sequence[tuple[int, int]], line: LineSettings) -> bool:
    """Whether all packets have room at that rate, and long and longer ones fill it."""
    char = Timing(line).char
    strange = sum(room + _ROUNDED < count * char for count, room in rooms)
    if strange > _STRANGE * len(rooms):
        return False
    half = len(of_length) // 2
    return all(_quickest(some) <= _FILLED * char for some in (of_length[:half], of_length[half:]))


def _quickest(rooms: Sequence[tuple[int, int]]) -> float:
    """Time for each octet that the quicker of them have, ns."""
    each = sorted(room / count for count, room in rooms)
    return each[int(_QUICKEST * len(each))]
