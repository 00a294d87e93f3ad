"""What the packets of a network carry, one after the other; IP packets that came in pieces are put together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from dissectors.line import NS_PER_S
from sniff.formats.network import NETWORK, Fragment, Segment, Snap, carried
from sniff.formats.records import PacketRecord

MOST_OPEN = 64
"""IP packets of which pieces are waited for; then the oldest is given up."""
MOST_PIECES = 64
PATIENCE = 60 * NS_PER_S
"""ns that the pieces of a packet may lie apart (RFC 1122, 3.3.2); the same number is another packet's then."""
LONGEST = 65_535
"""Octets of an IP packet."""

_Key = tuple[bytes, bytes, int, int]


def carried_by(records: Iterable[PacketRecord]) -> Iterator[tuple[PacketRecord, Segment | Snap | None]]:
    """Each record with what it carries, the last piece of an IP packet with what its whole carries; None where that is
    nothing of these, or not whole yet."""
    pieces = Pieces()
    for record in records:
        found = carried(record.link_type, record.data) if record.link_type in NETWORK else None
        yield record, pieces.add(record.time, found) if isinstance(found, Fragment) else found


class Pieces:
    """IP packets of which not all pieces have come. Bounded."""

    def __init__(self) -> None:
        self._open: dict[_Key, tuple[int, list[Fragment]]] = {}

    def add(self, time: int, fragment: Fragment) -> Segment | None:
        """Take a piece that was captured at that time (ns); what the packet carries, when it is whole by it."""
        key = fragment.source, fragment.destination, fragment.packet, fragment.kind
        if key in self._open and abs(time - self._open[key][0]) > PATIENCE:
            del self._open[key]  # of an earlier packet of that number
        _, held = self._open.setdefault(key, (time, []))
        held.append(fragment)
        octets = _whole(held)
        if octets is not None or len(held) >= MOST_PIECES:
            del self._open[key]
        while len(self._open) > MOST_OPEN:
            del self._open[next(iter(self._open))]
        return None if octets is None else fragment.joined(octets)


def _whole(pieces: list[Fragment]) -> bytes | None:
    """The octets of a packet; None while there is a hole in them."""
    octets, ends = b"", False
    for piece in sorted(pieces, key=lambda one: one.at):
        if piece.at > len(octets) or piece.at + len(piece.octets) > LONGEST:
            return None
        octets += piece.octets[len(octets) - piece.at :]
        ends = ends or piece.is_last
    return octets if ends else None
