"""Results of the engine in a recording that is written from a capture: each kind of them an observer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from dissectors.frame import Chunk
from dissectors.profiles import Devices
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.table_points import samples_of
from sniff.bus.offline import outputs
from sniff.bus.offline_topics import OfflineTopics
from sniff.bus.value_topics import ValueChannels
from sniff.engine.blocks import Block
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe, observe_tables
from sniff.engine.session import Item, LineEvent, Session
from sniff.engine.table import Table
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.frame_log import FrameLog
from sniff.recording.frames import SCHEMA
from sniff.recording.mcap_writer import McapWriter
from sniff.recording.topics import FRAMES_RECORD

Part = TypeVar("Part", Block | LineEvent, Item)


class WrittenResults:
    """What is written of one capture: /values, /bus, /nodes and /findings as live, and /frames where that is wanted."""

    def __init__(self, writer: McapWriter, session: Session, devices: Devices, with_frames: bool) -> None:
        """`devices`: each of their values is written; of a bus without them as many as a recording has room for."""
        self._session = session
        self._frames = _Frames(writer, session) if with_frames else None
        values = [_Values(writer, session, devices)] if devices else []
        topics = [] if session.unknown else [_Topics(writer, session, devices, with_values=not devices)]
        frames = [] if self._frames is None else [self._frames]
        self._observers: list[_Frames | _Values | _Topics] = [*frames, *values, *topics]

    def __bool__(self) -> bool:
        return bool(self._observers)

    def take_blocks(self, blocks: Iterable[Block | LineEvent]) -> None:
        """Find and write what is in them. Raises what `blocks` raises, and CaptureError."""
        observe_tables(tables(self._heard(blocks), self._session), *self._observers)
        self._close()

    def take_items(self, items: Iterable[Item]) -> None:
        """The same one by one."""
        observe(outputs(self._heard(items), self._session), *self._observers)
        self._close()

    def _heard(self, parts: Iterable[Part]) -> Iterator[Part]:
        """Reads are told before what is found in them."""
        for part in parts:
            if self._frames is not None and not isinstance(part, LineEvent):
                self._frames.hear(part)
            yield part

    def _close(self) -> None:
        for observer in self._observers:
            observer.close()


class _Frames:
    """Writes what the engine finds to /frames."""

    def __init__(self, writer: McapWriter, session: Session) -> None:
        self._writer = writer
        self._log = FrameLog(session)

    def hear(self, part: Block | Chunk) -> None:
        """Reads came."""
        if isinstance(part, Block):
            self._log.hear_many(part.reads.times)
        elif part.octets:
            self._log.hear(part.time)

    def add(self, output: Output) -> None:
        self._log.add(output)
        self._put()

    def add_table(self, table: Table) -> None:
        self._log.add_table(table)
        self._put()

    def add_line_event(self, event: LineEvent) -> None:
        self._log.add_line_event(event)
        self._put()

    def close(self) -> None:
        self._log.close()
        self._put()
        if (record := self._log.record()) is not None:
            self._writer.note(FRAMES_RECORD, record)

    def _put(self) -> None:
        made = self._log.take()
        if made:
            self._writer.add_frames(made, SCHEMA)


class _Topics:
    """Writes what a live recording has: /bus, /nodes, /findings, and values unless others do."""

    def __init__(self, writer: McapWriter, session: Session, devices: Devices, with_values: bool) -> None:
        self._writer = writer
        self._topics = OfflineTopics(session, devices, with_values)
        self._protocol = session.protocol
        self._next = 1

    def add(self, output: Output) -> None:
        first = output.rows[0].no if output.rows else self._next
        self._next = first + len(output.rows)
        self.add_table(Table.of_outputs(self._protocol, first, [output]))

    def add_table(self, table: Table) -> None:
        self._put(self._topics.add_table(table))

    def add_line_event(self, event: LineEvent) -> None:
        self._topics.add_line_event(event)

    def close(self) -> None:
        self._put(self._topics.close())

    def _put(self, messages: Iterable[DerivedMessage]) -> None:
        for one in messages:
            self._writer.derived(one)


class _Values:
    """Writes the values of known devices to /values."""

    def __init__(self, writer: McapWriter, session: Session, devices: Devices) -> None:
        self._writer = writer
        self._points = PointReader(dissector_for(session), devices)
        self._channels = ValueChannels(session.bus, devices)

    def add(self, output: Output) -> None:
        self._put(self._points.add(output))

    def add_table(self, table: Table) -> None:
        self._put(samples_of(self._points, table).in_order())

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is kept here."""

    def close(self) -> None:
        """Nothing is held."""

    def _put(self, samples: Iterable[Sample]) -> None:
        for sample in samples:
            message = self._channels.message(sample)
            if message is not None:
                self._writer.derived(message)
