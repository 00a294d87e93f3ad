"""Writing a capture, shared by the commands that make one: where to, what it could not keep, progress."""

from __future__ import annotations

import argparse
import heapq
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from dissectors.profiles import Devices
from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure
from sniff.cli.progress import Watched
from sniff.engine.capture import BlockWriter, CaptureError, CaptureWriter
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for, engine_for
from sniff.engine.read_source import ReadSource
from sniff.engine.session import Item, LineEvent, Session
from sniff.formats import parquet
from sniff.formats.parquet import Kind, ParquetWriter

if TYPE_CHECKING:
    from sniff.analysis.point_reader import Sample
    from sniff.bus.derived_topics import DerivedMessage
    from sniff.engine.blocks import Block
    from sniff.engine.table import Table


def add_output(parser: argparse.ArgumentParser) -> None:
    """-o and -f."""
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="capture to write, by suffix")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")


def write(
    args: argparse.Namespace,
    session: Session,
    source: ReadSource,
    sources: Sequence[str],
    options: Mapping[str, str] | None = None,
    with_frames: bool = False,
    devices: Devices | None = None,
    notes: Mapping[int, str] | None = None,
    marks: Mapping[int, str] | None = None,
) -> int:
    """Write a capture to `args.output`; say on standard error what it holds and what it lost. Gives the octets.

    An .mcap gets what a live recording has: /values, /bus, /nodes and /findings. `with_frames`: what the engine finds
    in the octets too, on /frames. `devices`: whose values are written, each of them; None: those of the session.
    `notes`, `marks`: by row number, for the comments of packets where OUT has such. Ends with exit code 2 when OUT is
    there.
    """
    target = Path(args.output)
    refuse_to_overwrite(target, sources, args.force)
    counts = _Counts()
    watched = Watched(with_comments(source))
    from sniff.bus.capture_writer import create  # with the formats that are written
    from sniff.devices import noted_devices

    try:
        with create(target, session, options, notes, marks) as writer:
            takers: list[_Frames | _Values | _Topics] = [_Frames(writer, session)] if with_frames else []
            known = noted_devices(session) if devices is None else devices
            if _is_recording(writer):
                if known:
                    takers.append(_Values(writer, session, known))
                if not session.unknown:
                    takers.append(_Topics(writer, session, known, with_values=not known))
            if isinstance(writer, BlockWriter) and not args.reference:
                _write_blocks(writer, watched.blocks(), session, takers, counts)
            else:
                _write_items(writer, watched.items(), session, takers, counts)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    print(f"{sanitized(target)}: {counts.octets} octets in {counts.reads} reads", file=sys.stderr)
    for loss in getattr(writer, "losses", ()):
        print(f"sniff485: {sanitized(target)}: {sanitized(loss)}", file=sys.stderr)
    return counts.octets


def refuse_to_overwrite(target: Path, sources: Sequence[str], force: bool) -> None:
    """Ends with exit code 2 for a file that is there, and always for one of the sources."""
    if target.exists() and any(name != "-" and Path(name).samefile(target) for name in sources):
        raise Failure(f"{target}: is a capture to read; name another file", USAGE)
    if target.exists() and not force and not target.is_char_device():
        raise Failure(f"{target}: exists; add --force to overwrite it", USAGE)


def parquet_file(args: argparse.Namespace, columns: Mapping[str, Kind]) -> AbstractContextManager[ParquetWriter | None]:
    """The table that --parquet names; None without it. Ends with exit code 2 when it cannot be, or is there."""
    if args.parquet is None:
        return nullcontext()
    if not parquet.available():
        raise Failure("--parquet needs polars: pip install 'sniff485[parquet]'", USAGE)
    target = Path(args.parquet)
    refuse_to_overwrite(target, args.files, args.force)
    return parquet.ParquetWriter(target, columns)


@dataclass(slots=True)
class _Counts:
    """What was written."""

    reads: int = 0
    octets: int = 0


def _write_blocks(
    writer: CaptureWriter,
    blocks: Iterator[Block | LineEvent],
    session: Session,
    takers: Sequence[_Frames | _Values | _Topics],
    counts: _Counts,
) -> None:
    from sniff.engine.bulk import BulkEngine

    assert isinstance(writer, BlockWriter)
    engine = BulkEngine(session) if takers else None
    logs = [taker.log for taker in takers if isinstance(taker, _Frames)]
    for item in blocks:
        if isinstance(item, LineEvent):
            writer.write(item)
        else:
            writer.write_block(item)
            counts.reads += len(item)
            counts.octets += len(item.reads.octets)
            for log in logs:
                log.hear_many(item.reads.times)
        if engine is not None:
            table = engine.take(item)
            for taker in takers:
                if isinstance(item, LineEvent) and item.kind.is_hole:  # before what it ends
                    taker.add_line_event(item)
                taker.add_table(table)
                if isinstance(item, LineEvent) and not item.kind.is_hole:
                    taker.add_line_event(item)
    if engine is not None:
        table = engine.close()
        for taker in takers:
            taker.add_table(table)
            taker.close()


def _write_items(
    writer: CaptureWriter,
    items: Iterator[Item],
    session: Session,
    takers: Sequence[_Frames | _Values | _Topics],
    counts: _Counts,
) -> None:
    engine = engine_for(session) if takers else None
    logs = [taker.log for taker in takers if isinstance(taker, _Frames)]
    for item in items:
        writer.write(item)
        if isinstance(item, Chunk) and item.octets:
            counts.reads += 1
            counts.octets += len(item.octets)
            for log in logs:
                log.hear(item.time)
        if engine is not None:
            output = engine.take(item)
            for taker in takers:
                if isinstance(item, LineEvent) and item.kind.is_hole:  # before what it ends
                    taker.add_line_event(item)
                taker.add(output)
                if isinstance(item, LineEvent) and not item.kind.is_hole:
                    taker.add_line_event(item)
    if engine is not None:
        output = engine.close()
        for taker in takers:
            taker.add(output)
            taker.close()


def with_comments(capture: ReadSource) -> ReadSource:
    """What is to be written, with what people wrote into it where it can tell (a text capture)."""
    comments = getattr(capture, "comments", None)
    if comments is None or next(comments(), None) is None:
        return capture
    return Items(heapq.merge(capture.items(), comments(), key=lambda item: item.time))


class Items:
    """Items that something makes, as a capture to be written."""

    def __init__(self, items: Iterator[Item]) -> None:
        self._items = items

    def items(self) -> Iterator[Item]:
        """Once."""
        return self._items

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns, once."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self._items)


def _is_recording(writer: object) -> bool:
    """Whether it takes what is derived."""
    from sniff.recording.mcap_writer import McapWriter

    return isinstance(writer, McapWriter)


class _Frames:
    """Writes what the engine finds to /frames."""

    def __init__(self, writer: object, session: Session) -> None:
        from sniff.recording.frame_log import FrameLog
        from sniff.recording.mcap_writer import McapWriter

        assert isinstance(writer, McapWriter)
        self._writer = writer
        self.log = FrameLog(session)

    def add(self, output: Output) -> None:
        self.log.add(output)
        self._put()

    def add_table(self, table: Table) -> None:
        self.log.add_table(table)
        self._put()

    def add_line_event(self, event: LineEvent) -> None:
        self.log.add_line_event(event)
        self._put()

    def close(self) -> None:
        self.log.close()
        self._put()
        if (record := self.log.record()) is not None:
            from sniff.recording.topics import FRAMES_RECORD

            self._writer.note(FRAMES_RECORD, record)

    def _put(self) -> None:
        made = self.log.take()
        if made:
            from sniff.recording.frames import SCHEMA

            self._writer.add_frames(made, SCHEMA)


class _Topics:
    """Writes what a live recording has: /bus, /nodes, /findings, and values unless others do."""

    def __init__(self, writer: object, session: Session, devices: Devices, with_values: bool) -> None:
        from sniff.bus.offline_topics import OfflineTopics
        from sniff.recording.mcap_writer import McapWriter

        assert isinstance(writer, McapWriter)
        self._writer = writer
        self._topics = OfflineTopics(session, devices, with_values)
        self._protocol = session.protocol
        self._next = 1

    def add(self, output: Output) -> None:
        from sniff.engine.table import Table

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
            self._writer.derived(one.topic, one.schema, one.log_time, one.publish_time, one.data, one.metadata)


class _Values:
    """Writes the values of known devices to /values."""

    def __init__(self, writer: object, session: Session, devices: Devices) -> None:
        from sniff.analysis.point_reader import PointReader
        from sniff.bus.value_topics import ValueChannels
        from sniff.recording.mcap_writer import McapWriter

        assert isinstance(writer, McapWriter)
        self._writer = writer
        self._points = PointReader(dissector_for(session), devices)
        self._channels = ValueChannels(session.bus, devices)

    def add(self, output: Output) -> None:
        self._put(self._points.add(output))

    def add_table(self, table: Table) -> None:
        from sniff.analysis.table_points import samples_of

        self._put(samples_of(self._points, table).in_order())

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is kept here."""

    def close(self) -> None:
        """Nothing is held."""

    def _put(self, samples: Iterable[Sample]) -> None:
        for sample in samples:
            message = self._channels.message(sample)
            if message is not None:
                self._writer.derived(
                    message.topic, message.schema, message.time, message.time, message.data, message.metadata
                )
