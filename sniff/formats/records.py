"""Records of a packet file, and what they are as items of a capture; shared by pcap and pcapng.

The other way needs an engine, so it is above: `sniff/bus/packet_records.py`.

A record's time is taken as the end of its last octet (what serial capture programs stamp). Another program's stamps
are as good as that program and its host were, which nobody knows: `FOREIGN_LATENCY` is assumed and said.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from dissectors import registry
from dissectors.findings import counted
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import ASSUMED, LINE_NOTE, PROTOCOL_NOTE, Adapter, Item, LineEvent, LineEventKind, Session
from sniff.formats.linktypes import LINK_TYPES
from sniff.formats.linktypes import protocol_of as protocol_of_link

FOREIGN_LATENCY = 20_000_000
"""ns; a usual USB adapter's latency timer and some scheduling."""


NOT_KEPT = "not kept by who captured: only the begin of each packet"
"""What is said of octets that a limit of the capture cut off."""
LONGEST_PACKET = 262_144
"""Octets of a packet that is no damage; a longer one is nobody's length."""


def cut_off(kept: int, on_wire: int) -> int:
    """Octets that a packet lost in the capture, by its two lengths; -1 where what it says cannot be."""
    if on_wire <= kept:
        return 0
    return on_wire - kept if on_wire <= LONGEST_PACKET else -1


@dataclass(frozen=True, slots=True)
class PacketRecord:
    """One packet of a packet file: `time` ns since the epoch, `comment` "" when none, `crc_error` as flagged.

    `searched`: line settings that a search listened with when these octets were heard; None outside a search. `mark`:
    what a person wrote about it, None for nothing. `cut`: octets at its end that were on the wire and are not in the
    file, since only so many of a packet were kept; -1 for nobody knows how many. `dropped`: packets before it that
    whoever captured dropped.
    """

    time: int
    link_type: int
    data: bytes
    comment: str = ""
    crc_error: bool = False
    searched: LineSettings | None = None
    mark: str | None = None
    cut: int = 0
    dropped: int = 0


class FrameFile(Protocol):
    """A packet file opened for writing. `losses`: what it cannot keep, complete after `close`."""

    losses: list[str]

    def put(self, records: Iterable[PacketRecord]) -> None:
        """Add records, in order of time."""
        ...

    def close(self) -> None:
        """Finish the file."""
        ...

    def discard(self) -> None:
        """Give it up; nothing is left of it."""
        ...


def foreign_session(path: str, protocol: str | None, started: int, kind: str) -> Session:
    """What is known of a packet file that we did not write; its folder is nobody else's business."""
    name = protocol or registry.DEFAULT
    return Session(
        port=Path(path).name.encode("utf-8", "backslashreplace").decode(),  # a name need not be text
        line=LineSettings.parse(registry.get(name).default_line),
        protocol=name,
        started=started,
        adapter=Adapter(name=f"another program's {kind}", latency=FOREIGN_LATENCY, latency_from="assumed"),
        notes={LINE_NOTE: ASSUMED, **({PROTOCOL_NOTE: ASSUMED} if protocol is None else {})},
    )


class SearchMarks:
    """Gives back to a file's items the settings that a search listened with, which packets keep with them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._with: LineSettings | None = None

    @property
    def searching(self) -> bool:
        """Whether the record before belonged to a search: the next one has something before it, or is of it too."""
        return self._with is not None

    def before(self, record: PacketRecord) -> Iterator[LineEvent]:
        """What happened before a record."""
        searched = record.searched
        if searched == self._with:
            return
        line = self._session.line
        if searched is None:
            changes = [SettingsChange(line), SettingsChange(line, self._session.protocol, found=True)]
        else:
            changes = [SettingsChange(searched, searching=True)]
        for change in changes:
            yield LineEvent(record.time, LineEventKind.SETTINGS, str(change))
        self._with = searched


def items_of(record: PacketRecord, protocol: str) -> Iterator[Item]:
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
    if record.dropped:
        words = f"{counted(record.dropped, 'packet')} dropped by who captured"
        yield LineEvent(record.time, LineEventKind.DROPPED, words, -1)
    if decoded.octets:
        yield Chunk(record.time, decoded.octets)
    if record.cut:
        yield LineEvent(record.time, LineEventKind.DROPPED, NOT_KEPT, record.cut)


def protocol_of(record: PacketRecord) -> str | None:
    """The protocol that a record's link type (or its own tag) names; None when neither does."""
    kind = LINK_TYPES.get(record.link_type)
    if kind is None:
        return None
    decoded = kind.read(record.data)
    return protocol_of_link(kind.number) or (decoded.protocol if decoded is not None else None)
