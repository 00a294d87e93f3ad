"""MCAP files of captures that are already there: of a conversion, of a stretch, of what was recovered."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sniff.engine.session import Item, LineEvent, Session
from sniff.formats.files import NewFile, explain
from sniff.recording.batcher import Batcher
from sniff.recording.block_batches import add_block
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.part import PartFile
from sniff.recording.topic_message import Message, of_derived, stamp
from sniff.recording.topics import FRAMES, LINE, RAW, SchemaText

if TYPE_CHECKING:
    from sniff.engine.blocks import Block


def create(path: str | Path, session: Session) -> McapWriter:
    """Create an MCAP capture; it takes its name when it is closed. Raises CaptureError."""
    return McapWriter(NewFile(Path(path)), session)


@dataclass(frozen=True, slots=True)
class PartPlace:
    """Where in a recording a part stands: its number, and what the parts before it held of each bus (number of the
    first read, octets)."""

    number: int = 1
    first_chunks: tuple[int, ...] = (0,)
    octets_before: tuple[int, ...] = (0,)

    def before(self) -> list[dict[str, int]]:
        """As `PartFile` takes it."""
        pairs = zip(self.first_chunks, self.octets_before, strict=True)
        return [{"first_chunk": first, "octets_before": octets} for first, octets in pairs]


def create_part(path: str | Path, sessions: Sequence[Session], place: PartPlace) -> McapWriter:
    """The same for a part of a recording, of one bus or of several. Raises CaptureError."""
    return McapWriter(NewFile(Path(path)), *sessions, place=place)


class McapWriter:
    """Writes a capture that is already there. An empty chunk says nothing and is not written."""

    def __init__(self, file: NewFile, *sessions: Session, place: PartPlace | None = None) -> None:
        self._file = file
        place = place or PartPlace(1, (0,) * len(sessions), (0,) * len(sessions))
        self._batchers = [Batcher(first) for first in place.first_chunks]
        self._part = PartFile(file.stream, sessions, place.number, place.before())
        self._sequences: dict[str, int] = {}

    def derived(self, one: DerivedMessage) -> None:
        """Add a result of the engine. Raises CaptureError."""
        if one.topic in (RAW, LINE):
            return
        self._part.hold(of_derived(one, self._sequences), one.schema, one.metadata)
        if self._part.holds_enough:
            self._part.release()

    def add_frames(self, messages: Iterable[tuple[int, int, bytes]], schema: SchemaText) -> None:
        """Add messages of /frames (log time, publish time, data), each in a chunk of its own. Raises CaptureError."""
        self._part.define(schema)
        for log_time, publish_time, data in messages:
            sequence = self._sequences[FRAMES] = self._sequences.get(FRAMES, -1) + 1
            self._part.hold(Message(FRAMES, stamp(log_time), stamp(publish_time), sequence, data), schema.name)
            self._part.release()
            self._add([])

    def note(self, name: str, words: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._part.note(name, words)

    def write(self, item: Item, bus: int = 0) -> None:
        """Add a chunk or line event. Raises CaptureError."""
        if isinstance(item, LineEvent):
            self._batchers[bus].add_event(item)
        else:
            self._add(self._batchers[bus].add(item), bus)

    def write_block(self, block: Block, bus: int = 0) -> None:
        """Add reads; the same file as one after the other. Raises CaptureError."""
        for messages in add_block(self._batchers[bus], block):
            self._add(messages, bus)

    def close(self) -> None:
        """Finish the file and give it its name; again is harmless. Raises CaptureError."""
        if self._file.stream.closed:
            return
        for bus, batcher in enumerate(self._batchers):
            self._add(batcher.close(), bus)
        try:
            self._part.finish()
        except OSError as error:
            self._file.discard()
            raise explain(self._file.path, error) from None
        self._file.close()

    def _add(self, messages: list[Message], bus: int = 0) -> None:
        for message in messages:
            self._part.add(message, bus=bus)
        if self._part.waiting > 1 << 20:
            try:
                self._part.flush()
            except OSError as error:
                raise explain(self._file.path, error) from None

    def __enter__(self) -> McapWriter:
        return self

    def __exit__(self, kind: object, *exc: object) -> None:
        if kind is None:
            self.close()
        else:
            self._file.discard()
