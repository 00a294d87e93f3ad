"""One MCAP file being written: session first, messages in compressed chunks, cut off whenever it is flushed.

Octets of the bus must be in the file within a second, in small chunks; results of the engine need not, and are kept
back until there are enough for a chunk of their own: JSON of two minutes packs many times smaller than by the second.

What the file does not take (disk full) waits in memory, so that the file stays whole up to where it ends and goes on
without a seam when there is room again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import BinaryIO

from sniff.engine.session import Session
from sniff.recording.chunk_indices import ChunkIndices
from sniff.recording.topic_message import Message, stamp
from sniff.recording.topics import (
    BUS,
    FIXED_CHANNELS,
    PART_RECORD,
    PROFILE,
    PROFILE_MEDIA_TYPE,
    PROFILE_SUFFIX,
    SCHEMAS,
    SESSION_RECORD,
    VERSION,
    SchemaText,
    topics_of,
)
from sniff.version import __version__

CHUNK_SIZE = 1 << 20

HELD_SIZE = 1 << 17
"""Octets of results that are kept back at most."""

_WRITTEN_AT_ONCE = 1 << 18


class _Pending:
    """The stream that the MCAP writer sees: never fails; `written` of its octets are in the file."""

    def __init__(self) -> None:
        self.octets = bytearray()
        self.written = 0

    def write(self, octets: bytes) -> int:
        self.octets += octets
        return len(octets)

    def tell(self) -> int:
        return self.written + len(self.octets)

    def flush(self) -> None:
        pass


@dataclass(frozen=True, slots=True)
class _Held:
    """A message of a bus with what its channel needs when it is new."""

    message: Message
    schema: str
    metadata: Mapping[str, str] | None
    bus: int


class PartFile:
    """A part, of one bus or of several. `before`: what the parts before it held of each, as words → numbers."""

    def __init__(
        self, stream: BinaryIO, sessions: Sequence[Session], number: int = 1, before: Sequence[Mapping[str, int]] = ()
    ) -> None:
        from mcap.writer import Writer

        self.stream = stream
        self._pending = _Pending()
        self._writer = Writer(self._pending, chunk_size=CHUNK_SIZE, enable_data_crcs=True)  # type: ignore[arg-type]
        self._writer._Writer__chunk_indices = ChunkIndices()  # type: ignore[attr-defined]
        self._held: list[_Held] = []
        self._held_size = 0
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._known = dict(SCHEMAS)
        self._writer.start(PROFILE, f"sniff485 {__version__}")
        for session in sessions:
            self._writer.add_metadata(SESSION_RECORD, session.to_metadata())
        for bus, held in enumerate(before or [{}] * len(sessions)):
            counters = {"first_chunk": 0, "octets_before": 0, **held}
            record = {"version": VERSION, "part": number, **counters, **({BUS: bus} if len(sessions) > 1 else {})}
            self._writer.add_metadata(PART_RECORD, {key: str(value) for key, value in record.items()})
        self._attach_profiles(sessions)
        self._topics = topics_of([session.bus for session in sessions])
        for own in self._topics:
            for (_, schema), topic in zip(FIXED_CHANNELS, own.values(), strict=True):
                self._register(topic, schema.name, {})

    def _attach_profiles(self, sessions: Sequence[Session]) -> None:
        documents = {name: document for session in sessions for name, document in session.profiles.items()}
        started = stamp(sessions[0].started)
        for name, document in documents.items():
            self._writer.add_attachment(started, started, name + PROFILE_SUFFIX, PROFILE_MEDIA_TYPE, document.encode())

    def define(self, schema: SchemaText) -> None:
        """A schema that messages may name, beside those that all recordings have."""
        self._known[schema.name] = schema

    def note(self, name: str, words: Mapping[str, str]) -> None:
        """Add a metadata record. Writes nothing out."""
        self.release()
        self._writer.add_metadata(name, dict(words))

    @property
    def size(self) -> int:
        """Octets of the file, with those that wait."""
        return self._pending.tell()

    @property
    def waiting(self) -> int:
        """Octets that the file did not take yet."""
        return len(self._pending.octets)

    def add(self, message: Message, schema: str = "", metadata: Mapping[str, str] | None = None, bus: int = 0) -> None:
        """Add a message; `schema` and `metadata` are for a topic that is new. Writes nothing out."""
        self._add(_Held(message, schema, metadata, bus))

    def hold(self, message: Message, schema: str = "", metadata: Mapping[str, str] | None = None, bus: int = 0) -> None:
        """Add a message that may be kept back; arguments as for `add`."""
        self._held.append(_Held(message, schema, metadata, bus))
        self._held_size += len(message.data)

    @property
    def holds_enough(self) -> bool:
        """Whether it is time for `release`."""
        return self._held_size >= HELD_SIZE

    def release(self) -> None:
        """Put what was kept back into a chunk of its own. Writes nothing out."""
        held, self._held, self._held_size = self._held, [], 0
        if held:
            self._writer.flush()  # type: ignore[no-untyped-call]
            for one in held:
                self._add(one)
            self._writer.flush()  # type: ignore[no-untyped-call]

    def _add(self, one: _Held) -> None:
        message = one.message
        topic = self._topics[one.bus].get(message.topic, message.topic)
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._register(topic, one.schema, dict(one.metadata or {}))
        self._writer.add_message(
            channel, message.log_time, message.data, message.publish_time, sequence=message.sequence
        )

    def flush(self) -> None:
        """Write everything out. Raises OSError; what was not taken waits for the next call."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._drain()

    def finish(self) -> None:
        """Write summary and footer. Raises OSError. The stream stays open."""
        self.release()
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._drain()
        self.stream.flush()

    def _drain(self) -> None:
        waiting = self._pending.octets
        while waiting:
            done = self.stream.write(bytes(waiting[:_WRITTEN_AT_ONCE])) or 0
            del waiting[:done]
            self._pending.written += done

    def _register(self, topic: str, name: str, metadata: dict[str, str]) -> int:
        schema = self._known.get(name)
        if schema is None:
            channel: int = self._writer.register_channel(topic, "json", 0, metadata)
        else:
            number = self._schemas.get(name)
            if number is None:
                number = self._writer.register_schema(schema.name, schema.encoding, schema.text.encode())
                self._schemas[name] = number
            channel = self._writer.register_channel(topic, schema.message, number, metadata)
        self._channels[topic] = channel
        return channel
