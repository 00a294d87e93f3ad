"""Packets of a packet file as columns: frames cut out of many records at once."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import Reads
from sniff.engine.blocks import plain_reads
from sniff.engine.session import Item
from sniff.formats.linktypes import (
    EXPORTED,
    LINK_TYPES,
    OWNS,
    RTAC,
    RTAC_HEADER,
    RTAC_LOST,
    USERS,
    exported_header,
    protocol_of,
)
from sniff.formats.linktypes import RTAC_ERROR_NAMES as RTAC_ERRORS
from sniff.formats.records import PacketRecord, cut_off, items_of

if TYPE_CHECKING:
    from dissectors.columns import Masks, Octets, Times

WINDOW = 1 << 19
"""Octets of a file that are looked at together; more than any record of a pcap file has."""
LEAST_RUN = 16
"""Fewer records in a row are not worth arrays."""
BARE = frozenset((*OWNS, *USERS))
"""Link types whose records are the frame and nothing else."""


@dataclass(frozen=True, slots=True)
class Packets:
    """Records that follow one another: where the data of each begin in `window`, how long they are, ns since the epoch,
    how long they were on the wire. No comment of theirs matters.
    """

    window: bytes
    begins: Times
    lengths: Times
    times: Times
    link_type: int
    on_wire: Times

    def __len__(self) -> int:
        return len(self.begins)

    def record(self, index: int) -> PacketRecord:
        """One of them."""
        begin, kept = int(self.begins[index]), int(self.lengths[index])
        cut = cut_off(kept, int(self.on_wire[index]))
        return PacketRecord(int(self.times[index]), self.link_type, self.window[begin : begin + kept], cut=cut)


def pieces_of(packets: Packets, protocol: str) -> Generator[Item | Reads, None, int]:
    """What `items_of` gives for the records, as columns where a record is a frame with nothing to be said about it.
    Returns how many records gave nothing.
    """
    if not len(packets):
        return 0
    ordinary, header, is_wanted = _ordinary(packets, protocol)
    ordinary = ordinary & (packets.on_wire <= packets.lengths)
    nothing = first = 0
    for odd in [*np.flatnonzero(~ordinary).tolist(), len(packets)]:
        if odd - first >= LEAST_RUN:
            if is_wanted:
                reads = _reads(packets, slice(first, odd), header)
                nothing += odd - first - len(reads)
                yield reads
            else:
                nothing += odd - first
            first = odd
        for index in range(first, min(odd + 1, len(packets))):
            items = list(items_of(packets.record(index), protocol))
            nothing += not items
            yield from items
        first = odd + 1
    return nothing


def _reads(packets: Packets, which: slice, header: int) -> Reads:
    lengths = packets.lengths[which] - header
    begins, times = packets.begins[which] + header, packets.times[which]
    if not lengths.all():
        held = lengths > 0
        begins, times, lengths = begins[held], times[held], lengths[held]
    octets = np.frombuffer(packets.window, np.uint8)
    before = np.cumsum(lengths) - lengths
    places = np.repeat(begins - before, lengths)
    places += np.arange(len(places))
    return plain_reads(octets[places], times, lengths)


# -- what lies before the frame --------------------------------------------------------------------------------


def _ordinary(packets: Packets, protocol: str) -> tuple[Masks, int, bool]:
    """Which records are a header of so many octets and then a frame, and whether it is of the protocol."""
    kind = packets.link_type
    is_wanted = kind in LINK_TYPES and protocol_of(kind) in (None, protocol)
    if kind == RTAC:
        ordinary = _heads(packets, RTAC_HEADER.size, _is_rtac_frame)
        return ordinary, RTAC_HEADER.size, is_wanted
    if kind == EXPORTED:
        return _exported(packets, protocol)
    return np.ones(len(packets), bool), 0, is_wanted


def _is_rtac_frame(heads: Octets) -> Masks:
    return ~np.isin(heads[:, 8], [*RTAC_ERRORS, RTAC_LOST])


def _exported(packets: Packets, protocol: str) -> tuple[Masks, int, bool]:
    """Records whose tags are those of the first, with the same dissector's name; addresses may differ."""
    first = packets.record(0).data
    decoded, fixed = LINK_TYPES[EXPORTED].read(first), exported_header(first)
    if decoded is None or fixed is None:
        return np.zeros(len(packets), bool), 0, False
    size = len(first) - len(decoded.octets)
    template = np.frombuffer(first, np.uint8)[fixed]
    ordinary = _heads(packets, size, lambda heads: (heads[:, fixed] == template).all(axis=1))
    return ordinary, size, decoded.protocol in (None, protocol)


def _heads(packets: Packets, size: int, test: Callable[[Octets], Masks]) -> Masks:
    """A test of the first `size` octets of each record that has so many; False for shorter ones."""
    passed = packets.lengths >= size
    passed[passed] = test(heads_at(packets.window, packets.begins[passed], size))
    return passed


def heads_at(window: bytes, places: Times, size: int) -> Octets:
    """uint8[k, size]: the octets at each place; all lie within the window."""
    if not len(places):
        return np.zeros((0, size), np.uint8)
    rows = np.ndarray((len(window) - size + 1,), f"V{size}", window, strides=(1,))
    heads: Octets = rows[places].view(np.uint8).reshape(-1, size)
    return heads
