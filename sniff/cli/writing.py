"""Writing a capture, shared by the commands that make one: where to, what it could not keep, progress."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from dissectors.frame import Chunk
from dissectors.profiles import Devices
from sniff.analysis.plain import plain
from sniff.bus.capture_writer import create
from sniff.cli import UNREADABLE, USAGE, Failure
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.engine import Output
from sniff.engine.session import Item, Session
from sniff.formats import parquet
from sniff.formats.parquet import Kind, ParquetWriter


def add_output(parser: argparse.ArgumentParser) -> None:
    """-o and -f."""
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="capture to write, by suffix")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")


def write(
    args: argparse.Namespace,
    session: Session,
    items: Iterable[Item],
    sources: Sequence[str],
    options: Mapping[str, str] | None = None,
    with_frames: bool = False,
    devices: Devices | None = None,
    notes: Mapping[int, str] | None = None,
) -> int:
    """Write items to `args.output`; say on standard error what it holds and what it lost. Gives the octets.

    `with_frames`: with what the engine finds in them, on /frames. `devices`: with their values, on /values.
    `notes`: by row number, for the comments of packets where OUT has such. Ends with exit code 2 when OUT is there.
    """
    target = Path(args.output)
    refuse_to_overwrite(target, sources, args.force)
    chunks = octets = 0
    progress = _Progress(target.name)
    try:
        with create(target, session, options, notes) as writer:
            frames = _Frames(writer, session) if with_frames else None
            values = _Values(writer, session, devices) if devices else None
            for item in items:
                writer.write(item)
                if frames is not None:
                    frames.add(item)
                if values is not None:
                    values.add(item)
                if isinstance(item, Chunk):
                    chunks += 1
                    octets += len(item.octets)
                    progress.show(chunks)
            if frames is not None:
                frames.close()
            if values is not None:
                values.close()
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    finally:
        progress.end()
    print(f"{plain(target)}: {octets} octets in {chunks} reads", file=sys.stderr)
    for loss in getattr(writer, "losses", ()):
        print(f"sniff485: {plain(target)}: {plain(loss)}", file=sys.stderr)
    return octets


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


def say_incomplete(path: str, capture: Capture) -> None:
    """Where a capture that was read ends too early; after what was printed of it."""
    complete = capture.completeness()
    if not complete.whole:
        sys.stdout.flush()
        print(f"sniff485: {plain(path)}: {plain(complete.text)}", file=sys.stderr)


class _Frames:
    """Runs the engine beside the writing; its results go to /frames."""

    AT_ONCE = 1000

    def __init__(self, writer: object, session: Session) -> None:
        from sniff.engine.follow_settings import engine_for
        from sniff.recording.frames import SCHEMA, FrameLog
        from sniff.recording.topics import FRAMES
        from sniff.recording.writer import McapWriter

        assert isinstance(writer, McapWriter)
        self._writer = writer
        self._engine = engine_for(session)
        self._log = FrameLog()
        self._topic, self._schema = FRAMES, SCHEMA.name
        self._count = 0

    def add(self, item: Item) -> None:
        output = self._engine.take(item)
        self._log.add(output)
        self._count += len(output.rows)
        if self._count >= self.AT_ONCE:
            self._take()

    def close(self) -> None:
        self._log.add(self._engine.close())
        self._take()

    def _take(self) -> None:
        self._count = 0
        message = self._log.take()
        if message is not None:
            self._writer.derived(self._topic, self._schema, *message)


class _Values:
    """Runs the engine beside the writing; the values of known devices go to /values."""

    def __init__(self, writer: object, session: Session, devices: Devices) -> None:
        from sniff.analysis.points import PointReader
        from sniff.bus.value_topics import ValueChannels
        from sniff.engine.follow_settings import engine_for
        from sniff.recording.writer import McapWriter

        assert isinstance(writer, McapWriter)
        self._writer = writer
        self._engine = engine_for(session)
        self._points = PointReader(self._engine.dissector, devices)
        self._channels = ValueChannels(session.bus, devices)

    def add(self, item: Item) -> None:
        self._take(self._engine.take(item))

    def close(self) -> None:
        self._take(self._engine.close())

    def _take(self, output: Output) -> None:
        for sample in self._points.add(output):
            message = self._channels.message(sample)
            if message is not None:
                self._writer.derived(
                    message.topic, message.schema, message.time, message.time, message.data, message.metadata
                )


class _Progress:
    """Says on a terminal, twice a second, how far a long work is."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.next = time.monotonic() + 1
        self.shown = False

    def show(self, chunks: int) -> None:
        if chunks % 1024 or not sys.stderr.isatty() or time.monotonic() < self.next:
            return
        self.next = time.monotonic() + 0.5
        self.shown = True
        print(f"\r{self.name}: {chunks} reads", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self.shown:
            print("\r\x1b[K", end="", file=sys.stderr)
