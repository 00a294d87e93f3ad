"""Records of a packet file ↔ items of a capture; shared by pcap and pcapng.

A record's time is taken as the end of its last octet (what serial capture programs stamp). Another program's stamps
are as good as that program and its host were, which nobody knows: `FOREIGN_LATENCY` is assumed and said.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings
from dissectors.manifest import PacketFile
from sniff.analysis.wording import describe, duration
from sniff.engine.engine import Output
from sniff.engine.follow_settings import engine_for
from sniff.engine.session import ASSUMED, LINE_NOTE, Adapter, Item, LineEvent, LineEventKind, Session, SettingsChange
from sniff.engine.verdict_join import Settled, Settling
from sniff.formats.linktypes import LINK_TYPES, RTAC, RTAC_ERRORS, USER1, link_type_for, rtac_record
from sniff.formats.linktypes import protocol_of as protocol_of_link

FOREIGN_LATENCY = 20_000_000
"""ns; a usual USB adapter's latency timer and some scheduling."""


@dataclass(frozen=True, slots=True)
class Record:
    """One packet of a packet file: `time` ns since the epoch, `comment` "" when none, `crc_error` as flagged."""

    time: int
    link_type: int
    data: bytes
    comment: str = ""
    crc_error: bool = False


def foreign_session(path: str, protocol: str | None, started: int, kind: str) -> Session:
    """What is known of a packet file that we did not write; its folder is nobody else's business."""
    name = protocol or registry.DEFAULT
    return Session(
        port=Path(path).name.encode("utf-8", "backslashreplace").decode(),  # a name need not be text
        line=LineSettings.parse(registry.get(name).default_line),
        protocol=name,
        started=started,
        adapter=Adapter(name=f"another program's {kind}", latency=FOREIGN_LATENCY, latency_from="assumed"),
        notes={LINE_NOTE: ASSUMED},
    )


SEARCHED = "heard while searching for the settings, with "
_SEARCHED = re.compile(rf"{SEARCHED}(\S+?)(?:;|$)")
"""What `describe` says of a row of a search, in the comment of its packet."""


class SearchMarks:
    """Gives back to a file's items the settings that a search listened with, which packets keep as comments."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._with: str | None = None

    @property
    def searching(self) -> bool:
        """Whether the record before belonged to a search: the next one has something before it, or is of it too."""
        return self._with is not None

    def before(self, record: Record) -> Iterator[LineEvent]:
        """What happened before a record."""
        match = _SEARCHED.search(record.comment)
        searched = match[1] if match is not None else None
        if searched == self._with:
            return
        line = self._session.line
        if searched is None:
            changes = [SettingsChange(line), SettingsChange(line, self._session.protocol, found=True)]
        else:
            changes = [SettingsChange(SettingsChange.parse(f"line={searched}").line, searching=True)]
        for change in changes:
            yield LineEvent(record.time, LineEventKind.SETTINGS, str(change))
        self._with = searched


def items_of(record: Record, protocol: str) -> Iterator[Item]:
    """The chunk and line events that a record stands for; nothing when it is of another protocol."""
    kind = LINK_TYPES.get(record.link_type)
    decoded = kind.read(record.data) if kind is not None else None
    if decoded is None or decoded.protocol not in (None, protocol):
        return
    if kind is not None and protocol_of_link(kind.number) not in (None, protocol):
        return
    if decoded.event:
        dropped = decoded.event == "dropped"
        yield LineEvent(record.time, LineEventKind.DROPPED if dropped else LineEventKind.ERRORS, decoded.event, 1)
    if decoded.octets:
        yield Chunk(record.time, decoded.octets)


def protocol_of(record: Record) -> str | None:
    """The protocol that a record's link type (or its own tag) names; None when neither does."""
    kind = LINK_TYPES.get(record.link_type)
    if kind is None:
        return None
    decoded = kind.read(record.data)
    return protocol_of_link(kind.number) or (decoded.protocol if decoded is not None else None)


class RecordMaker:
    """Items → records, one frame each, by way of the engine; verdict and doubts go into the comment.

    `live`: give each frame at once instead of waiting for its verdict.
    """

    def __init__(self, session: Session, wanted: int | None = None, live: bool = False) -> None:
        self.session = session
        self.link_type = link_type_for(session.protocol, wanted)
        self.engine = engine_for(session)
        self.live = live
        self.notes: Mapping[int, str] = {}  # by row number: what else to say in the comment
        self._settling = Settling()

    def add(self, item: Item) -> Iterator[Record]:
        """Take one item; give the records that it completes."""
        yield from self._settled(self.engine.take(item))
        if isinstance(item, LineEvent) and self.link_type == RTAC and item.kind is LineEventKind.DROPPED:
            yield Record(item.time, RTAC, rtac_record(item.time - self.session.started, 5, b""))

    def advance(self, now: int) -> Iterator[Record]:
        """Say that no read returned up to `now` (ns)."""
        yield from self._settled(self.engine.advance(now))

    def close(self) -> Iterator[Record]:
        """Give the records still held."""
        yield from self._settled(self.engine.close())
        for item in self._settling.flush():
            yield from self._records(item)

    def _settled(self, output: Output) -> Iterator[Record]:
        if self.live:
            for row in output.rows:
                yield from self._records(Settled(row, None))
            return
        for item in self._settling.add(output):
            yield from self._records(item)

    def _records(self, item: Settled) -> Iterator[Record]:
        row = item.row
        event = row.event
        time = event.end
        if self.link_type == RTAC:
            for mark in event.marks:
                for error, number in RTAC_ERRORS.items():
                    if error in mark.error:
                        yield Record(time, RTAC, rtac_record(time - self.session.started, number, b""))
        comment = self._comment(item)
        if not isinstance(event, Frame) or not _readable(event):
            yield Record(time, USER1, event.octets, comment)
            return
        header, placement = row.header, row.placement
        assert header is not None
        role = placement.role if placement is not None else header.role
        station = header.destination if header.destination is not None else header.source
        data = LINK_TYPES[self.link_type].write(event, role, station, time - self.session.started)
        yield Record(time, self.link_type, data, comment, not event.ok)

    def _comment(self, item: Settled) -> str:
        row, transaction = item.row, item.transaction
        notes = [] if isinstance(row.event, Frame) and row.event.ok else [describe(self.engine.dissector, row)]
        if row.header is not None and row.header.error:
            notes.append(row.header.error)
        if transaction is not None and row.no in (transaction.request, transaction.response):
            shown = transaction.verdict.words
            if transaction.latency is not None:
                shown += f", response after {duration(transaction.latency)}"
            if shown not in {"answered", "data", "broadcast"}:
                notes.append(shown)
        if row.event.marks:
            notes.append(f"{len(row.event.marks)} octets with line errors")
        if row.no in self.notes:
            notes.append(self.notes[row.no])
        return "; ".join(notes)


def _readable(frame: Frame) -> bool:
    """Whether Wireshark's dissector gets all the octets it expects: cut frames would be shown as malformed."""
    if frame.ok:
        return True
    held = registry.get(frame.protocol).packet_file or PacketFile(())
    count = len(frame.octets)
    if frame.expected is None or min(count, frame.expected) < held.least:
        return False
    return count == frame.expected or (held.longer and count > frame.expected)
