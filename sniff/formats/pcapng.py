"""pcapng: nanoseconds, comments with our verdict, the CRC-error flag; octets that are no frame on an interface of
their own. The session travels as a comment of the section, so that our own files come back with their settings.
Read: section header, interface description, enhanced and simple packet blocks and those that came before them, both
byte orders, any resolution. Other blocks are skipped.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import NO_TIMES_OF_PACKETS, Completeness, Item, LineEvent, LineEventKind, Session
from sniff.formats.files import NewFile, open_capture
from sniff.formats.linktypes import LINK_TYPES, USER1
from sniff.formats.network import NETWORK
from sniff.formats.packet_rate import at_shown_rate
from sniff.formats.pcapng_interface import OPT_END, OPT_TSRESOL, Interface, interface_of, options
from sniff.formats.pcapng_packet import (
    CRC_ERROR_FLAG,
    ENHANCED,
    LATEST,
    MARK,
    OBSOLETE,
    OPT_COMMENT,
    OPT_FLAGS,
    SEARCH_MARK,
    SIMPLE,
    packet_of,
)
from sniff.formats.records import PacketRecord, SearchMarks, foreign_session, items_of, protocol_of
from sniff.formats.set_back_clock import steady, steady_pieces
from sniff.formats.timeless import IN_PACKETS, Laid
from sniff.formats.usb import USB

if TYPE_CHECKING:
    from dissectors.columns import Reads
    from sniff.engine.blocks import Block
    from sniff.formats.pcapng_walk import PlainPackets

SECTION, INTERFACE = 0x0A0D0D0A, 1
BYTE_ORDER = 0x1A2B3C4D
OPT_NAME = 2  # of an interface
LONGEST = 4 * 1024 * 1024
"""A longer block is damage."""
SEEN_OF_NETWORK = 1000
"""Packets of a network or of USB before any serial frame, from which on it is a capture of such."""
LONGEST_OPTION = 60_000
"""Octets of a text in an option, whose length has sixteen bits."""
_SHORT = 200
SESSION_MARK = "sniff485 session: "


def read(path: Path) -> Capture:
    """Open a pcapng file; the buses in it where it is one of a network or of USB. Raises CaptureError."""
    capture = PcapngCapture(path)
    if capture.is_of_usb:
        from sniff.formats import usb_capture

        return usb_capture.read(capture)
    if capture.is_of_network:
        from sniff.formats import network_capture

        return network_capture.read(capture)
    return capture


class PcapngCapture:
    """A pcapng file as a capture: all interfaces of one protocol, merged."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._complete = Completeness(True)
        self._metadata: dict[str, str] = {}
        self._other = 0
        self._of_network = self._of_usb = 0
        self._laid = Laid()
        self._is_timeless = False
        with open_capture(path) as stream:
            first = self._first(stream)
        self._is_without_frames = first is None
        if self._metadata:
            self.session: Session = Session.from_metadata(self._metadata)
        else:
            protocol = protocol_of(first) if first is not None else None
            foreign = foreign_session(str(path), protocol, first.time if first is not None else 0, "pcapng")
            self.session = foreign if self._is_timeless else at_shown_rate(foreign, self.records())
            self._metadata = {}  # what a later section says is told when it comes
        if self._is_timeless:
            unknown = replace(self.session.adapter, latency=IN_PACKETS, latency_from=NO_TIMES_OF_PACKETS)
            self.session = replace(self.session, adapter=unknown)

    def _first(self, stream: BinaryIO) -> PacketRecord | None:
        start = stream.read(12)
        if start[:4] != SECTION.to_bytes(4, "little"):
            raise CaptureError(f"{self.path}: not a pcapng file (it begins with {start[:4].hex(' ') or 'nothing'})")
        stream.seek(0)
        fallback = None
        for record in self._records(stream):
            if record.link_type not in LINK_TYPES:
                self._of_network += record.link_type in NETWORK
                self._of_usb += record.link_type in USB
                if max(self._of_network, self._of_usb) >= SEEN_OF_NETWORK and fallback is None and not self._metadata:
                    return None
                continue
            if self._metadata or protocol_of(record) is not None:
                return record
            fallback = fallback or record
        return fallback

    @property
    def is_of_network(self) -> bool:
        """Whether what it holds first, and at all in a short file, is a network's."""
        return self._of_network > 0 and self._is_without_frames

    @property
    def is_of_usb(self) -> bool:
        """The same of USB, where there is more of it."""
        return self._of_usb > self._of_network and self._is_without_frames

    def records(self) -> Iterator[PacketRecord]:
        """All records, as far as the file is whole. Raises CaptureError."""
        with open_capture(self.path) as stream:
            yield from self._records(stream)

    def items(self) -> Iterator[Item]:
        """Chunks in the order of the file."""
        return steady(self._all_items(), self.session.timing.char)

    def _all_items(self) -> Iterator[Item]:
        self._other = 0
        marks = SearchMarks(self.session)
        with open_capture(self.path) as stream:
            for record in self._records(stream):
                yield from self._items(record, marks)
        self._say_what_was_passed_over()

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns, without an object a packet but in a search."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(steady_pieces(self._pieces(), self.session.timing.char))

    def completeness(self) -> Completeness:
        """Whether the last block was whole, as far as `items` has read."""
        return self._complete

    def _items(self, record: PacketRecord, marks: SearchMarks) -> Iterator[Item]:
        found = False
        yield from marks.before(record)
        said = self._written(record)
        if said is not None:
            yield LineEvent(record.time, LineEventKind.MARK, said)
        for item in items_of(record, self.session.protocol):
            found = True
            yield item
        self._other += not found

    def _written(self, record: PacketRecord) -> str | None:
        """What a person wrote about a packet: in a file of another program every comment is somebody's."""
        return record.mark if record.mark is not None or self._metadata else record.comment or None

    def _commented(self, packets: PlainPackets, interfaces: list[Interface]) -> set[int]:
        """The places of packets that a person wrote about, or before which others were dropped."""
        if self._metadata and MARK.encode() not in packets.window:
            return set()
        kept = packets.heads[:, 5].astype("i8")
        options = packets.heads[:, 1] - 32 - kept - -kept % 4
        found = set()
        for index in (options > 4).nonzero()[0].tolist():
            record = packet_of(packets.order, ENHANCED, packets.body(index), interfaces)
            if record is not None and (record.dropped or self._written(record) is not None):
                found.add(index)
        return found

    def _say_what_was_passed_over(self) -> None:
        if self._other and self._complete.whole:
            were = "record of another kind was" if self._other == 1 else "records of other kinds were"
            self._complete = Completeness(True, f"complete; {self._other} {were} passed over")

    def _pieces(self) -> Iterator[Item | Reads]:
        from sniff.formats.pcapng_walk import OtherBlock, PcapngWalk

        self._other = 0
        self._laid = Laid()
        marks = SearchMarks(self.session)
        interfaces: list[Interface] = []
        with open_capture(self.path) as stream:
            walk = PcapngWalk(stream, LONGEST, SEARCH_MARK.encode())
            for one in walk.blocks():
                if isinstance(one, OtherBlock):
                    record = self._record(one.order, one.kind, one.body, interfaces)
                    if record is not None:
                        yield from self._items(record, marks)
                else:
                    yield from self._plain(one, interfaces, marks)
            stream.seek(walk.at)
            self._complete = Completeness(True)
            for order, kind, body in self._blocks(stream, walk.order):  # of what is cut or damaged
                record = self._record(order, kind, body, interfaces)
                if record is not None:
                    yield from self._items(record, marks)
        self._say_what_was_passed_over()

    def _plain(self, packets: PlainPackets, interfaces: list[Interface], marks: SearchMarks) -> Iterator[Item | Reads]:
        """What packets hold whose comments do not matter."""
        from sniff.formats.packet_columns import LEAST_RUN, pieces_of
        from sniff.formats.pcapng_columns import alike

        commented = self._commented(packets, interfaces)
        for first, end, some in alike(packets, interfaces, self.session.protocol, LATEST):
            is_said = any(first <= index < end for index in commented)
            if some is None or end - first < LEAST_RUN or marks.searching or is_said:
                for index in range(first, end):
                    record = packet_of(packets.order, ENHANCED, packets.body(index), interfaces)
                    if record is not None:
                        yield from self._items(record, marks)
            else:
                self._other += yield from pieces_of(some, self.session.protocol)

    def _records(self, stream: BinaryIO) -> Iterator[PacketRecord]:
        self._complete = Completeness(True)
        self._laid = Laid()
        interfaces: list[Interface] = []
        for order, kind, body in self._blocks(stream):
            record = self._record(order, kind, body, interfaces)
            if record is not None:
                yield record

    def _record(self, order: str, kind: int, body: bytes, interfaces: list[Interface]) -> PacketRecord | None:
        """The record in a block; what others say of the section is taken."""
        if kind == SECTION:
            interfaces.clear()
            self._take_session(order, body)
        elif kind == INTERFACE and len(body) >= 8:
            interfaces.append(interface_of(order, body))
        elif kind in (ENHANCED, SIMPLE, OBSOLETE):
            record = packet_of(order, kind, body, interfaces)
            if record is not None and kind == SIMPLE:
                self._is_timeless = True
                return replace(record, time=self._laid.end_of(len(record.data)))
            return record
        return None

    def _blocks(self, stream: BinaryIO, order: str = "<") -> Iterator[tuple[str, int, bytes]]:
        while head := stream.read(8):
            at = stream.tell() - len(head)
            if len(head) < 8:
                self._complete = Completeness(False, f"cut inside a block header at octet {at}")
                return
            kind, size = struct.unpack(order + "II", head)
            if kind == SECTION:
                magic = stream.read(4)
                order = "<" if magic == BYTE_ORDER.to_bytes(4, "little") else ">"
                if order == ">" and magic != BYTE_ORDER.to_bytes(4, "big"):
                    self._complete = Completeness(False, f"damaged at octet {at}: no byte order mark")
                    return
                size = struct.unpack_from(order + "I", head, 4)[0]
                stream.seek(-len(magic), 1)
            if size < 12 or size % 4 or size > LONGEST:
                self._complete = Completeness(False, f"damaged at octet {at}: a block of {size} octets")
                return
            body = stream.read(size - 8)
            if len(body) < size - 8:
                self._complete = Completeness(
                    False, f"cut inside a block at octet {at}: {len(body) + 8} of {size} octets"
                )
                return
            yield order, kind, body[:-4]

    def _take_session(self, order: str, body: bytes) -> None:
        for code, value in options(order, body[16:]):
            text = value.decode("utf-8", "replace")
            if code == OPT_COMMENT and text.startswith(SESSION_MARK):
                try:
                    found = json.loads(text[len(SESSION_MARK) :])
                except (ValueError, RecursionError):
                    continue
                if isinstance(found, dict):
                    self._metadata = {str(key): str(item) for key, item in found.items()}


def create(path: Path, session: Session, link_type: int, live: bool = False) -> PcapngWriter:
    """Create a pcapng file whose frames are of one link type. Raises CaptureError."""
    return PcapngWriter(path, session, link_type, live)


class PcapngWriter:
    """Writes records, those that are no frame on interface 1; `losses` says what the format could not keep.

    `live`: pushed through at once, for somebody who reads while we write.
    """

    def __init__(self, path: Path, session: Session, link_type: int, live: bool = False) -> None:
        self.losses: list[str] = [
            "pcapng keeps one time a frame (its end), no limits of reads, no line events; of line errors only how many "
            "octets of a frame had one, in its comment"
        ]
        self._live = live
        self._file = NewFile(path)
        section = struct.pack("<IHHq", BYTE_ORDER, 1, 0, -1) + self._about(session) + _option(OPT_END)
        self._block(SECTION, section)
        for number, name in ((link_type, session.bus), (USER1, f"{session.bus}: no frame")):
            described = struct.pack("<HHI", number, 0, 0) + _option(OPT_NAME, _fitting(name))
            self._block(INTERFACE, described + _option(OPT_TSRESOL, b"\x09") + _option(OPT_END))
        self._flush()

    def put(self, records: Iterable[PacketRecord]) -> None:
        """Add records."""
        for record in records:
            self.packet_of(record)
        self._flush()

    def close(self) -> None:
        """Finish the file."""
        self._file.close()

    def discard(self) -> None:
        """Give the file up."""
        self._file.discard()

    def _about(self, session: Session) -> bytes:
        """The option that holds the session, its notes only where there is room for them."""
        record = session.to_metadata()
        about = SESSION_MARK + json.dumps(record)
        if len(about) > LONGEST_OPTION:
            self.losses.append("notes of the session longer than pcapng can hold were left out")
            record = {key: value[:_SHORT] for key, value in record.items() if not key.startswith("note_")}
            about = SESSION_MARK + json.dumps(record)
        return _option(OPT_COMMENT, about.encode())

    def _flush(self) -> None:
        if self._live:
            self._file.stream.flush()

    def packet_of(self, record: PacketRecord) -> None:
        time, size = max(0, record.time), len(record.data)
        number = 1 if record.link_type == USER1 else 0
        options = _option(OPT_FLAGS, struct.pack("<I", CRC_ERROR_FLAG)) if record.crc_error else b""
        if record.comment:
            options += _option(OPT_COMMENT, _fitting(record.comment))
        if record.mark is not None:
            options += _option(OPT_COMMENT, _fitting(f"{MARK}{record.mark}"))
        if record.searched is not None:
            options += _option(OPT_COMMENT, f"{SEARCH_MARK}{record.searched}".encode())
        head = struct.pack("<IIIII", number, time >> 32 & 0xFFFFFFFF, time & 0xFFFFFFFF, size, size)
        data = record.data + b"\0" * (-size % 4)
        self._block(ENHANCED, head + data + (options + _option(OPT_END) if options else b""))

    def _block(self, kind: int, body: bytes) -> None:
        size = struct.pack("<I", len(body) + 12)
        self._file.write(struct.pack("<I", kind) + size + body + size)


def _fitting(text: str) -> bytes:
    """A text as an option can hold it."""
    return text.encode("utf-8", "backslashreplace")[:LONGEST_OPTION]


def _option(code: int, value: bytes = b"") -> bytes:
    return struct.pack("<HH", code, len(value)) + value + b"\0" * (-len(value) % 4)
