"""Writing a capture, shared by the commands that make one: where to, what it could not keep, progress."""

from __future__ import annotations

import argparse
import heapq
import sys
from collections import deque
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
from sniff.engine.read_source import ReadSource
from sniff.engine.session import Item, LineEvent, Session
from sniff.formats import parquet
from sniff.formats.parquet import Kind, ParquetWriter

if TYPE_CHECKING:
    from sniff.bus.capture_writer import PacketOptions
    from sniff.cli.written_results import WrittenResults
    from sniff.engine.blocks import Block


def add_output(parser: argparse.ArgumentParser) -> None:
    """-o and -f."""
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="capture to write, by suffix")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")


def write(
    args: argparse.Namespace,
    session: Session,
    source: ReadSource,
    sources: Sequence[str],
    with_frames: bool = False,
    devices: Devices | None = None,
    packets: PacketOptions | None = None,
) -> int:
    """Write a capture to `args.output`; say on standard error what it holds and what it lost. Gives the octets.

    An .mcap gets what a live recording has: /values, /bus, /nodes and /findings. `with_frames`: what the engine finds
    in the octets too, on /frames. `devices`: whose values are written, each of them; None: those of the session.
    `packets`: how, where OUT is a packet file. Ends with exit code 2 when OUT is there.
    """
    target = Path(args.output)
    refuse_to_overwrite(target, sources, args.force)
    counts = _Counts()
    watched = Watched(with_comments(source))
    from sniff.bus.capture_writer import PLAIN, create  # with the formats that are written

    try:
        with create(target, session, packets or PLAIN) as writer:
            results = _results(writer, session, devices, with_frames)
            if isinstance(writer, BlockWriter) and not args.reference:
                blocks = _blocks_written(writer, watched.blocks(), counts)
                _exhaust(blocks) if results is None else results.take_blocks(blocks)
            else:
                items = _items_written(writer, watched.items(), counts)
                _exhaust(items) if results is None else results.take_items(items)
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


def _results(
    writer: CaptureWriter, session: Session, devices: Devices | None, with_frames: bool
) -> WrittenResults | None:
    """What is found and written beside the octets; None where the format takes nothing of it."""
    from sniff.recording.mcap_writer import McapWriter

    if not isinstance(writer, McapWriter):
        return None
    from sniff.cli.written_results import WrittenResults  # with the engine for many rows
    from sniff.devices import noted_devices

    known = noted_devices(session) if devices is None else devices
    return WrittenResults(writer, session, known, with_frames) or None


def _exhaust(parts: Iterable[object]) -> None:
    """Have all of them made, for what making them does."""
    deque(parts, 0)


def _blocks_written(
    writer: BlockWriter, blocks: Iterable[Block | LineEvent], counts: _Counts
) -> Iterator[Block | LineEvent]:
    """Each of them, once it is written."""
    for item in blocks:
        if isinstance(item, LineEvent):
            writer.write(item)
        else:
            writer.write_block(item)
            counts.reads += len(item)
            counts.octets += len(item.reads.octets)
        yield item


def _items_written(writer: CaptureWriter, items: Iterable[Item], counts: _Counts) -> Iterator[Item]:
    """The same one by one."""
    for item in items:
        writer.write(item)
        if isinstance(item, Chunk) and item.octets:
            counts.reads += 1
            counts.octets += len(item.octets)
        yield item


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
