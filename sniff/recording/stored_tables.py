"""The tables that a recording holds on /frames, given in place of what an engine would find, where they are just that.

They are taken where the record behind them says that this very program made them, for the protocol and the times that
are asked for, and where the check over the whole file agrees: nothing was changed, lost or added since. Each table
says which octets it was made of; one that contradicts them, or all that was said, is an error. Who makes a file to
deceive, with all its checks, is believed, as with any octets that he writes: `--reference` finds everything anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dissectors import registry
from dissectors.columns import Octets
from sniff.engine.capture import CaptureError
from sniff.engine.session import LineEvent, Session
from sniff.formats.files import explain
from sniff.recording.frames import SCHEMA, VERSION, StoredTable
from sniff.recording.program import program
from sniff.recording.topics import FRAMES, FRAMES_RECORD, LINE, RAW
from sniff.recording.whole_file import WholeFile, whole_file

if TYPE_CHECKING:
    from sniff.engine.table import Table
    from sniff.recording.reader import McapCapture


@dataclass(frozen=True, slots=True)
class StoredRecord:
    """How much a file holds: rows, exchanges that closed, octets of the rows, events on /line."""

    rows: int
    closed: int
    octets: int
    events: int


def record_of(session: Session, counted: StoredRecord) -> dict[str, str]:
    """The record behind the /frames that this program makes for a session."""
    counts, timing = {name: str(number) for name, number in asdict(counted).items()}, session.timing
    return {
        "version": str(VERSION),
        "program": program(),
        "protocol": session.protocol,
        "timing": f"{timing.line} {timing.latency} {timing.is_told} {timing.has_rate} {timing.has_times}",
        **counts,
    }


def is_kept(session: Session) -> bool:
    """Whether what is found with a session is kept in a file: not where settings are searched for, nor what a plug-in
    finds, for nobody knows whether it would still find it."""
    return not session.unknown and (session.protocol in registry.BUILT_IN or session.protocol in registry.RELATIVES)


def stored_tables(capture: McapCapture, session: Session) -> Iterator[Table | LineEvent] | None:
    """What `engine.bulk.tables` gives of this capture with this session; None where the file does not hold it. Raises
    CaptureError, then and while they are taken."""
    if not is_kept(session) or len(capture.sessions) > 1:
        return None
    found = _found_in(capture)
    counted = None if found is None else _counted_for(session, found)
    return None if found is None or counted is None else _tables(capture, session.protocol, counted, found)


def fit(capture: McapCapture, session: Session) -> bool | None:
    """Whether the tables that a file holds are what the engine would give with this session; None where it holds none.
    Raises CaptureError."""
    found = _found_in(capture)
    if found is None:
        return None
    return is_kept(session) and len(capture.sessions) == 1 and _counted_for(session, found) is not None


def _found_in(capture: McapCapture) -> WholeFile | None:
    try:
        return whole_file(capture.path, FRAMES_RECORD)
    except OSError as error:
        raise explain(capture.path, error) from None


def _counted_for(session: Session, found: WholeFile) -> StoredRecord | None:
    """How much the file holds, if it was made by this program for such a session."""
    counted = _counted(found.record)
    return None if counted is None or found.record != record_of(session, counted) else counted


def _counted(told: Mapping[str, str]) -> StoredRecord | None:
    try:
        return StoredRecord(*(int(told[name]) for name in StoredRecord.__slots__))
    except (KeyError, ValueError):
        return None


def _tables(
    capture: McapCapture, protocol: str, counted: StoredRecord, found: WholeFile
) -> Iterator[Table | LineEvent]:
    bus = capture.only(found.places(RAW, LINE))
    wire = _Wire(bus)
    rows = closed = events = octets = 0
    for stored in _messages(capture.only(found.places(FRAMES))):
        while stored is not None and events < stored.events:
            event = wire.event()
            if event is None:
                break
            events += 1
            yield event
        table = None
        left = counted.octets - octets
        if stored is not None and (stored.first, stored.events) == (rows + 1, events) and stored.octets <= left:
            own = wire.octets(stored.octets)
            table = None if own is None else stored.table(protocol, own)
        if table is None:
            raise _strange(capture.path)
        rows, closed, octets = rows + len(table), closed + len(table.transactions), octets + len(table.octets)
        yield table
    while (event := wire.event()) is not None:
        events += 1
        yield event
    if StoredRecord(rows, closed, octets, events) != counted or wire.left:
        raise _strange(capture.path)
    capture.know_from(bus)


def _messages(capture: McapCapture) -> Iterator[StoredTable | None]:
    with capture.reading() as one:
        for topic, head, data in one.messages():
            if topic == FRAMES and one.channels[head[0]].same(SCHEMA, {}):
                yield StoredTable.decode(data)


def _strange(path: Path) -> CaptureError:
    return CaptureError(
        f"{path}: what it holds on {FRAMES} is not what this program wrote; --reference reads the octets alone"
    )


class _Wire:
    """The octets of a capture and what happened on its line, each in its order. `left`: octets that wait."""

    def __init__(self, capture: McapCapture) -> None:
        self._blocks = capture.blocks()
        self._events: deque[LineEvent] = deque()
        self._octets: deque[Octets] = deque()
        self.left = 0

    def event(self) -> LineEvent | None:
        """The next event; None where there is none."""
        while not self._events and self._read():
            pass
        return self._events.popleft() if self._events else None

    def octets(self, count: int) -> Octets | None:
        """The next octets; None where there are not as many."""
        while self.left < count and self._read():
            pass
        if self.left < count:
            return None
        parts: list[Octets] = []
        wanted = count
        while wanted:
            part = self._octets.popleft()
            parts.append(part[:wanted])
            if len(part) > wanted:
                self._octets.appendleft(part[wanted:])
            wanted -= len(parts[-1])
        self.left -= count
        return parts[0] if len(parts) == 1 else np.concatenate(parts) if parts else np.zeros(0, np.uint8)

    def _read(self) -> bool:
        item = next(self._blocks, None)
        if isinstance(item, LineEvent):
            self._events.append(item)
        elif item is not None and len(item.reads.octets):
            self._octets.append(item.reads.octets)
            self.left += len(item.reads.octets)
        return item is not None
