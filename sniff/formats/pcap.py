"""Classic pcap: both byte orders, microseconds and nanoseconds. We write nanoseconds, or
microseconds where they are wanted, little-endian.

It keeps frames and their ends. It keeps neither line settings nor adapter, nor octets that are no whole frame.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from dissectors.frame import Chunk
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Completeness, Item, LineEvent, Session
from sniff.formats.files import NewFile, open_capture
from sniff.formats.linktypes import LINK_TYPES, OWN, USER1, USERS
from sniff.formats.linktypes import protocol_of as protocol_of_link
from sniff.formats.network import NETWORK
from sniff.formats.packet_rate import at_shown_rate
from sniff.formats.records import (
    LONGEST_PACKET,
    PacketRecord,
    cut_off,
    foreign_session,
    items_of,
    protocol_of,
)
from sniff.formats.set_back_clock import steady, steady_pieces
from sniff.formats.usb import USB

if TYPE_CHECKING:
    from dissectors.columns import Reads
    from sniff.engine.blocks import Block

MAGICS = {  # as read little-endian: (byte order, ns a tick)
    0xA1B2C3D4: ("<", 1000),
    0xA1B23C4D: ("<", 1),
    0xD4C3B2A1: (">", 1000),
    0x4D3CB2A1: (">", 1),
}
_NAMES = {1: " (Ethernet)", 101: " (IP)", 113: " (Linux cooked)", 228: " (IPv4)", 0: " (loopback)"}
FILE_HEADER, RECORD_HEADER = 24, 16
LINK_TYPE = 0xFFFF
"""What of the last word of the header is the link type; above it stands how long the check sum of a frame is."""
LONGEST = LONGEST_PACKET
"""A longer record is damage: no field bus has frames of that size."""


def read(path: Path) -> Capture:
    """Open a pcap file; the buses in it where it is one of a network or of USB. Raises CaptureError."""
    capture = PcapCapture(path)
    if capture.link_type in USB:
        from sniff.formats import usb_capture

        return usb_capture.read(capture)
    if capture.link_type in NETWORK:
        from sniff.formats import network_capture

        return network_capture.read(capture)
    return capture


class PcapCapture:
    """A pcap file as a capture."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with open_capture(path) as stream:
            header = stream.read(FILE_HEADER)
            self._order, self._tick = self._check(header)
            self._link_type: int = struct.unpack_from(self._order + "I", header, 20)[0] & LINK_TYPE
            if self._link_type not in LINK_TYPES and self._link_type not in NETWORK | USB:
                known = ", ".join(map(str, sorted(set(LINK_TYPES) - set(USERS)))) + f", {USERS[0]} to {USERS[-1]}"
                raise CaptureError(
                    f"{path}: link type {self._link_type}{_NAMES.get(self._link_type, '')} holds no serial frames; "
                    f"this program reads {known}, USB and networks"
                )
            first = next(self._records(stream), None)
        protocol = protocol_of(first) if first is not None else protocol_of_link(self._link_type)
        session = foreign_session(str(path), protocol, first.time if first is not None else 0, "pcap")
        self.session: Session = at_shown_rate(session, self.records() if self._link_type in LINK_TYPES else ())
        self._complete = Completeness(True)

    def _check(self, header: bytes) -> tuple[str, int]:
        magic = int.from_bytes(header[:4], "little")
        if magic not in MAGICS:
            raise CaptureError(f"{self.path}: not a pcap file (it begins with {header[:4].hex(' ') or 'nothing'})")
        if len(header) < FILE_HEADER:
            raise CaptureError(f"{self.path}: pcap file cut inside its header, at octet {len(header)}")
        return MAGICS[magic]

    @property
    def link_type(self) -> int:
        """What the records are."""
        return self._link_type

    def records(self) -> Iterator[PacketRecord]:
        """All records, as far as the file is whole. Raises CaptureError."""
        with open_capture(self.path) as stream:
            stream.seek(FILE_HEADER)
            yield from self._records(stream)

    def items(self) -> Iterator[Item]:
        """Chunks in the order of the file."""
        return steady(self._items(), self.session.timing.char)

    def _items(self) -> Iterator[Item]:
        with open_capture(self.path) as stream:
            stream.seek(FILE_HEADER)
            protocol = self.session.protocol
            if self._link_type == OWN and protocol == protocol_of_link(OWN):  # the record is the frame
                for record in self._records(stream):
                    if record.cut:
                        yield from items_of(record, protocol)
                    elif record.data:
                        yield Chunk(record.time, record.data)
                return
            for record in self._records(stream):
                yield from items_of(record, protocol)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns, without an object a record."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(steady_pieces(self._pieces(), self.session.timing.char))

    def completeness(self) -> Completeness:
        """Whether the last record was whole, as far as `items` has read."""
        return self._complete

    def _pieces(self) -> Iterator[Item | Reads]:
        from sniff.formats.packet_columns import pieces_of
        from sniff.formats.pcap_walk import PcapWalk

        protocol = self.session.protocol
        with open_capture(self.path) as stream:
            stream.seek(FILE_HEADER)
            walk = PcapWalk(stream, self._order, self._tick, self._link_type, LONGEST)
            for packets in walk.packets():
                yield from pieces_of(packets, protocol)
            stream.seek(walk.at)
            for record in self._records(stream):  # of what is cut or damaged
                yield from items_of(record, protocol)

    def _records(self, stream: BinaryIO) -> Iterator[PacketRecord]:
        self._complete = Completeness(True)
        layout = struct.Struct(self._order + "IIII")
        while header := stream.read(RECORD_HEADER):
            at = stream.tell() - len(header)
            if len(header) < RECORD_HEADER:
                self._complete = Completeness(False, f"cut inside a record header at octet {at}")
                return
            seconds, ticks, kept, on_wire = layout.unpack(header)
            if kept > LONGEST:
                self._complete = Completeness(False, f"damaged at octet {at}: a record of {kept} octets")
                return
            data = stream.read(kept)
            if len(data) < kept:
                self._complete = Completeness(False, f"cut inside a record at octet {at}: {len(data)} of {kept} octets")
                return
            time = seconds * 1_000_000_000 + ticks * self._tick
            yield PacketRecord(time, self._link_type, data, cut=cut_off(kept, on_wire))


def create(path: Path, session: Session, link_type: int, live: bool = False, microseconds: bool = False) -> PcapWriter:
    """Create a pcap file of one link type. Raises CaptureError."""
    return PcapWriter(path, link_type, live, microseconds)


class PcapWriter:
    """Writes the records of one link type; `losses` says what the format could not keep. `live`: pushed through.
    `microseconds`: times as old readers want them, rounded down.
    """

    def __init__(self, path: Path, link_type: int, live: bool = False, microseconds: bool = False) -> None:
        self.losses: list[str] = [
            "pcap keeps no line settings, adapter, line errors or read limits; .pcapng keeps more"
        ]
        self._live = live
        self._left_out = 0
        self._file = NewFile(path)
        self._tick = 1000 if microseconds else 1
        magic = 0xA1B2C3D4 if microseconds else 0xA1B23C4D
        self._file.write(struct.pack("<IHHiIII", magic, 2, 4, 0, 0, LONGEST, link_type))

    def put(self, records: Iterable[PacketRecord]) -> None:
        """Add records."""
        for record in records:
            self._put(record)
        if self._live:
            self._file.stream.flush()

    def close(self) -> None:
        """Finish the file."""
        if self._left_out:
            what = "1 octet that is" if self._left_out == 1 else f"{self._left_out} octets that are"
            was = "was" if self._left_out == 1 else "were"
            self.losses.append(f"{what} no whole frame {was} left out")
            self._left_out = 0
        self._file.close()

    def discard(self) -> None:
        """Give the file up."""
        self._file.discard()

    def _put(self, record: PacketRecord) -> None:
        if record.link_type == USER1:
            self._left_out += len(record.data)
            return
        seconds, rest = divmod(max(0, record.time), 1_000_000_000)
        size = len(record.data)
        self._file.write(struct.pack("<IIII", seconds & 0xFFFFFFFF, rest // self._tick, size, size) + record.data)
