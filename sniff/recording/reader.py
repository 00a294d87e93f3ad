"""Reading MCAP recordings, whole or not: live ones, cut ones, damaged ones, ones made to do harm.

A file that is no recording raises CaptureError. All other files give what can be read: a damaged chunk is passed over,
the hole shows in the numbering and is an event of its own (`LineEventKind.DROPPED`), and `completeness` says in
words what is wrong and where the file ends.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from dissectors.columns import Reads
from sniff.engine.blocks import BLOCK_OCTETS, Block, blocks_of, plain_reads
from sniff.engine.event_texts import SettingsChange, settings_change
from sniff.engine.session import Completeness, Item, LineEvent, LineEventKind, Session
from sniff.formats.files import explain, open_capture
from sniff.formats.several_buses import SeveralBuses
from sniff.recording import scan
from sniff.recording.batch import Batch
from sniff.recording.batch_run import BatchRun, run_of
from sniff.recording.beginning import read_beginning
from sniff.recording.clean_batches import CleanBatches
from sniff.recording.completeness import completeness_of
from sniff.recording.joiner import Joiner
from sniff.recording.line_messages import line_event
from sniff.recording.messages import Head, MessagePass
from sniff.recording.topics import topics_of

if TYPE_CHECKING:
    from sniff.engine.table import Table

FAR = (1 << 63) - 1
"""ns; after everything."""


def read(path: str | Path) -> McapCapture | SeveralBuses:
    """Open a recording, of one bus or of several. Raises CaptureError."""
    buses = buses_of(path)
    return buses[0] if len(buses) == 1 else SeveralBuses(buses[0].path, buses)


def buses_of(path: str | Path) -> list[McapCapture]:
    """Every bus of a recording, at least one. Raises CaptureError."""
    first = McapCapture(Path(path))
    return [first, *(McapCapture(first.path, bus) for bus in range(1, len(first.sessions)))]


class McapCapture:
    """A recording opened for reading; each pass reads the file again, a live one up to where it is then.

    `bus`: which of the buses in it, from 0; `sessions`: of all of them.
    """

    def __init__(self, path: Path, bus: int = 0) -> None:
        self.path = path
        self.bus = bus
        self._completeness: Completeness | None = None
        self._index = scan.ChunkIndex()
        self._only: Sequence[int] = ()
        try:
            begin = read_beginning(path, bus)
            self.sessions, self.session, self._began = begin.sessions, begin.session, begin.session
            self._place = begin.place
            own = topics_of([session.bus for session in self.sessions] or [""])
            self._known = [topic for each in own for topic in each.values()]
            self._raw_topic, self._line_topic = own[min(bus, len(own) - 1)].values()
            if self.session.unknown:
                self._look_for_what_was_found()
        except OSError as error:
            raise explain(path, error) from None

    @property
    def part(self) -> int:
        """Number among the parts of its recording, from 1."""
        return self._place.part

    @property
    def first_chunk(self) -> int:
        """Number of its first read: so many are in the parts before it."""
        return self._place.first_chunk or 0

    @property
    def octets_before(self) -> int:
        """In the parts before it."""
        return self._place.octets_before

    # what a capture gives

    def items(self, since: int | None = None, followed_by: Sequence[McapCapture] = ()) -> Iterator[Item]:
        """Chunks and line events as they were recorded.

        `since`: only those at or after that time (ns), without reading the chunks of the file before it.
        `followed_by`: the parts of the recording after this one, given as one with it.
        Raises CaptureError only when the file cannot be read any more at all.
        """
        pieces = self._pieces(since, followed_by, columns=False)
        items = cast("Iterator[Item]", pieces)  # nothing else without columns
        return items if since is None else (item for item in items if item.time >= since)

    def blocks(self, since: int | None = None, followed_by: Sequence[McapCapture] = ()) -> Iterator[Block | LineEvent]:
        """The same as columns: batches that nothing happened to without an object a read. Parameters as of `items`.
        Raises CaptureError.
        """
        pieces = self._pieces(since, followed_by, columns=True)
        return blocks_of(pieces if since is None else _from(since, pieces))

    def _pieces(
        self, since: int | None, followed_by: Sequence[McapCapture], *, columns: bool
    ) -> Iterator[Item | Reads]:
        """`columns`: give clean batches as columns."""
        pieces = self._in_order(since, followed_by, columns)
        return self._searching_first(pieces) if self._began.unknown else pieces

    def _searching_first(self, pieces: Iterator[Item | Reads]) -> Iterator[Item | Reads]:
        """What a recording gives that begins within a search for settings: the first of it says so."""
        first = next((piece for piece in pieces if not isinstance(piece, Reads) or len(piece)), None)
        if first is None:
            return
        change = None if isinstance(first, Reads) else settings_change(first)
        if change is None or not change.searching:
            began = SettingsChange(self._began.line, searching=True)
            time = int(first.times[0]) if isinstance(first, Reads) else first.time
            yield LineEvent(time, LineEventKind.SETTINGS, str(began))
        yield first
        yield from pieces

    def _in_order(self, since: int | None, followed_by: Sequence[McapCapture], columns: bool) -> Iterator[Item | Reads]:
        joiner = self._joiner(since)
        yield from self._joined(joiner, since, columns, alone=since is None)
        for part in followed_by:
            yield from part._joined(joiner, since, columns, alone=False)
        yield from joiner.close()

    def _joined(self, joiner: Joiner, since: int | None, columns: bool, *, alone: bool) -> Iterator[Item | Reads]:
        """What this file gives to a joiner; `alone`: which has seen no other file, so that it says what is missing."""
        clean = CleanBatches()
        with self.reading(since) as one:
            try:
                for piece in self._runs_of(one, joiner, columns and since is None):
                    if isinstance(piece, BatchRun):
                        yield from clean.add(piece)
                        continue
                    head, batch = piece
                    if one.jumped:
                        joiner.next, one.jumped = None, False
                    if since is not None and head[2] < since:
                        joiner.skip(head[1], batch)
                    elif columns and clean.takes(batch) and joiner.follows(head[1], batch.count):
                        yield from clean.add(BatchRun.alone(batch))
                    else:
                        yield from clean.rest()
                        yield from joiner.raw(head[1], batch)
            except OSError:
                yield from clean.rest()
                raise
            yield from clean.rest()
            if alone:
                self._note(one, joiner)

    def completeness(self) -> Completeness:
        """Whether the file is whole; reads all of it, once."""
        if self._completeness is not None:
            return self._completeness
        joiner = self._joiner(None)
        with self.reading() as one:
            for head, batch in self.batches_of(one, joiner):
                joiner.skip(head[1], batch)
            return self._note(one, joiner)

    def chunk_index(self) -> scan.ChunkIndex:
        """Where the chunks of the file are; none of them is read. Raises CaptureError."""
        with self.reading(FAR) as one:
            for _ in one.messages():
                pass
            self._index = one.report.chunks
        return self._index

    # what else is in the file

    def only(self, places: Sequence[int]) -> McapCapture:
        """The same, read from the chunks that begin at these octets of the file (`scan.records_at`); the others hold
        nothing of it."""
        other = copy(self)
        other._only = places
        return other

    def know_from(self, other: McapCapture) -> None:
        """Take over what reading another one of the same file has found out."""
        self._completeness = other._completeness

    def batches(self, since: int | None = None) -> Iterator[Batch]:
        """The batches of /raw as they are, for work on columns; those that end before `since` (ns) left out."""
        with self.reading(since) as one:
            for topic, head, data in one.messages():
                if topic == self._raw_topic and (since is None or head[2] >= since):
                    batch = one.batch(head, data)
                    if batch is not None:
                        yield batch

    def stored_tables(self, session: Session) -> Iterator[Table | LineEvent] | None:
        """What the engine would give with this session, where the file holds it. Raises CaptureError."""
        from sniff.recording.stored_tables import stored_tables  # most files hold none

        return stored_tables(self, session)

    def stored_fit(self, session: Session) -> bool | None:
        """Whether the tables that the file holds are what the engine would give with this session; None where it holds
        none. Raises CaptureError."""
        from sniff.recording.stored_tables import fit

        return fit(self, session)

    def messages(self, prefix: str = "/") -> Iterator[tuple[str, int, bytes]]:
        """Topic, log time (ns) and data of all messages whose topic begins so, as they are in the file."""
        with self.reading() as one:
            for topic, head, data in one.messages():
                if topic.startswith(prefix):
                    yield topic, head[2], data

    # inside

    def batches_of(self, one: MessagePass, joiner: Joiner) -> Iterator[tuple[Head, Batch]]:
        """Batches of a pass; what is on /line goes to the joiner."""
        for held in one.holds():
            yield from self._batches_in(held, one, joiner)

    def _batches_in(
        self, held: bytes | tuple[int, bytes], one: MessagePass, joiner: Joiner
    ) -> Iterator[tuple[Head, Batch]]:
        for topic, head, data in one.messages_in(held):
            if topic == self._line_topic:
                joiner.line(head[2], data)
            elif topic == self._raw_topic and (batch := one.batch(head, data)) is not None:
                yield head, batch

    def _runs_of(self, one: MessagePass, joiner: Joiner, together: bool) -> Iterator[BatchRun | tuple[Head, Batch]]:
        """The same with all batches of a chunk `together`, where that is plain."""
        others = frozenset((self._line_topic,))
        for held in one.holds():
            run = None
            if together and isinstance(held, bytes) and len(held) <= BLOCK_OCTETS * 4:
                run = run_of(held, one.channels, self._raw_topic, others)
            if run is not None and CleanBatches.takes_run(run) and joiner.follows(run.sequence, run.entries):
                one.last = run.last
                yield run
            else:
                yield from self._batches_in(held, one, joiner)

    @contextmanager
    def reading(self, since: int | None = None) -> Iterator[MessagePass]:
        """The messages of the file. Raises CaptureError."""
        with open_capture(self.path) as stream:
            try:
                start = None if since is None else self._index.find(since)
                yield MessagePass(
                    stream, scan.Report(os.fstat(stream.fileno()).st_size), since, start, self._known, self._only
                )
            except OSError as error:
                raise explain(self.path, error) from None

    @property
    def known_topics(self) -> list[str]:
        """Of the first channels, by number: known before the file says so."""
        return self._known

    def joiner(self) -> Joiner:
        """What puts the batches of this file in order from its begin."""
        return self._joiner(None)

    def _joiner(self, since: int | None) -> Joiner:
        return Joiner(self._place.first_chunk if since is None else None)

    def _note(self, one: MessagePass, joiner: Joiner) -> Completeness:
        """Keep what a whole pass found, and where the chunks are, for later jumps."""
        self._index = one.report.chunks
        self._completeness = completeness_of(one, joiner)
        return self._completeness

    # the start

    def _look_for_what_was_found(self) -> None:
        """The session with what a search found, if it did: said on /line, since it was not known at the start."""
        for _, _, data in self.messages(self._line_topic):
            event = line_event(data, 0)
            change = None if event is None else settings_change(event)
            if change is not None and change.found:
                self.session = self.session.found(change.line, change.protocol)
                return


def _from(since: int, pieces: Iterator[Item | Reads]) -> Iterator[Item | Reads]:
    """Those at or after a time (ns)."""
    for piece in pieces:
        if not isinstance(piece, Reads):
            if piece.time >= since:
                yield piece
        elif (late := piece.times >= since).all():
            yield piece
        else:
            octets = piece.octets[np.repeat(late, piece.lengths)]
            yield plain_reads(octets, piece.times[late], piece.lengths[late])
