"""A capture's items as records of a packet file, one frame each, by way of the engine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from dissectors import registry
from dissectors.findings import counted
from dissectors.frame import Frame
from dissectors.manifest import PacketFile
from sniff.analysis.wording import describe, duration
from sniff.engine.engine import Output
from sniff.engine.follow_settings import engine_for
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.engine.verdict_join import JudgedRow, VerdictJoin
from sniff.formats.linktypes import LINK_TYPES, RTAC, RTAC_ERRORS, USER1, rtac_record
from sniff.formats.records import PacketRecord


class RecordMaker:
    """Items → records of one link type, a frame each; verdict and doubts go into the comment.

    `live`: give each frame at once instead of waiting for its verdict. `notes`: by row number, what else to say in the
    comment. `marks`: by row number, what a person wrote.
    """

    def __init__(
        self,
        session: Session,
        link_type: int,
        live: bool = False,
        notes: Mapping[int, str] | None = None,
        marks: Mapping[int, str] | None = None,
    ) -> None:
        self.session = session
        self.link_type = link_type
        self.engine = engine_for(session)
        self.live = live
        self.notes: Mapping[int, str] = notes or {}
        self.marks: Mapping[int, str] = marks or {}
        self._settling = VerdictJoin()

    def add(self, item: Item) -> Iterator[PacketRecord]:
        """Take one item; give the records that it completes."""
        yield from self._settled(self.engine.take(item))
        if isinstance(item, LineEvent) and self.link_type == RTAC and item.kind is LineEventKind.DROPPED:
            yield PacketRecord(item.time, RTAC, rtac_record(item.time - self.session.started, 5, b""))

    def advance(self, now: int) -> Iterator[PacketRecord]:
        """Say that no read returned up to `now` (ns)."""
        yield from self._settled(self.engine.advance(now))

    def close(self) -> Iterator[PacketRecord]:
        """Give the records still held."""
        yield from self._settled(self.engine.close())
        for item in self._settling.flush():
            yield from self._records(item)

    def _settled(self, output: Output) -> Iterator[PacketRecord]:
        if self.live:
            for row in output.rows:
                yield from self._records(JudgedRow(row, None))
            return
        for item in self._settling.add(output):
            yield from self._records(item)

    def _records(self, item: JudgedRow) -> Iterator[PacketRecord]:
        row = item.row
        event = row.event
        time = event.end
        if self.link_type == RTAC:
            for mark in event.marks:
                for error, number in RTAC_ERRORS.items():
                    if error in mark.error:
                        yield PacketRecord(time, RTAC, rtac_record(time - self.session.started, number, b""))
        comment = self._comment(item)
        if not isinstance(event, Frame) or not _readable(event):
            yield PacketRecord(time, USER1, event.octets, comment, searched=row.searched, mark=self.marks.get(row.no))
            return
        header, placement = row.header, row.placement
        assert header is not None
        role = placement.role if placement is not None else header.role
        station = header.destination if header.destination is not None else header.source
        data = LINK_TYPES[self.link_type].write(event, role, station, time - self.session.started)
        yield PacketRecord(time, self.link_type, data, comment, not event.ok, mark=self.marks.get(row.no))

    def _comment(self, item: JudgedRow) -> str:
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
            notes.append(f"{counted(len(row.event.marks), 'octet')} with line errors")
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
