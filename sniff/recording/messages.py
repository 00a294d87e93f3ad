"""The messages of a recording, one pass from its beginning, through chunks and channels, past what is damaged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

from sniff.recording import scan
from sniff.recording.batch import Batch
from sniff.recording.topics import LINE, RAW, SchemaText

MOST_CHANNELS = 65536
Head = tuple[int, int, int, int]
"""Of a message: channel, sequence, log time (ns), publish time (ns)."""


@dataclass(frozen=True, slots=True)
class Channel:
    """What the file says of a channel; `schema` and `layout` are its schema's name and text."""

    topic: str
    schema: str = ""
    layout: bytes = b""
    metadata: Mapping[str, str] = field(default_factory=dict)

    def same(self, schema: SchemaText, metadata: Mapping[str, str]) -> bool:
        """Whether this very program wrote it."""
        return self.schema == schema.name and self.layout == schema.text.encode() and self.metadata == metadata


class MessagePass:
    """`since`: chunks that end before that time (ns) are not read. `start`: offset of the chunk to begin with, None
    for the beginning of the file.

    `known`: the topics of the first channels. `only`: where the chunks begin that are read, of a file that is whole
    (`scan.records_at`).

    `last`: time of the last chunk read from the bus that was found. `jumped`: set when a chunk of the file was not
    read because of `since`.
    """

    def __init__(
        self,
        stream: BinaryIO,
        report: scan.Report,
        since: int | None = None,
        start: int | None = None,
        known: Sequence[str] = (RAW, LINE),
        only: Sequence[int] = (),
    ) -> None:
        self.report = report
        self.last: int | None = None
        self.jumped = False
        self._records = scan.records_at(stream, report, only) if only else scan.records(stream, report, since, start)
        self._schemas: dict[int, tuple[str, bytes]] = {}
        # known before the file says so: the chunk that says so may be damaged
        self.channels = {number: Channel(topic) for number, topic in enumerate(known, 1)}

    def messages(self) -> Iterator[tuple[str, Head, bytes]]:
        """Topic, head and data of all messages that can be read."""
        for held in self.holds():
            yield from self.messages_in(held)

    def holds(self) -> Iterator[bytes | tuple[int, bytes]]:
        """What holds messages: unpacked chunks, and records by opcode that stand alone, in the order of the file."""
        for record in self._records:
            if record.body is None:
                self.jumped = self.jumped or record.opcode == scan.CHUNK
            elif record.opcode != scan.CHUNK:
                yield record.opcode, record.body
            else:
                octets = scan.unpack_chunk(record.body)
                if isinstance(octets, str):
                    self.report.problem(f"chunk at octet {record.offset}: {octets}", len(record.body))
                else:
                    yield octets

    def messages_in(self, held: bytes | tuple[int, bytes]) -> Iterator[tuple[str, Head, bytes]]:
        """Topic, head and data of the messages in one of `holds`."""
        for opcode, body in scan.inner_records(held) if isinstance(held, bytes) else iter([held]):
            if opcode == scan.MESSAGE and len(body) >= scan.MESSAGE_HEAD.size:
                head: Head = scan.MESSAGE_HEAD.unpack_from(body)
                channel = self.channels.get(head[0])
                if channel is not None:
                    yield channel.topic, head, body[scan.MESSAGE_HEAD.size :]
            elif opcode in (scan.CHANNEL, scan.SCHEMA):
                self._define(opcode, body)

    def batch(self, head: Head, data: bytes) -> Batch | None:
        """A message of /raw; None, and reported, when its sizes contradict each other."""
        batch = Batch.decode(data)
        if batch is None:
            self.report.problem(f"the sizes in the batch of reads {head[1]} contradict each other", len(data))
        elif batch.count:
            self.last = head[2]
        return batch

    def _define(self, opcode: int, body: bytes) -> None:
        from mcap import records

        if opcode == scan.SCHEMA:
            schema = scan.parse(records.Schema, body)
            if schema is not None:
                self._schemas[schema.id] = (schema.name, schema.data)
            return
        channel = scan.parse(records.Channel, body)
        if channel is not None:
            name, layout = self._schemas.get(channel.schema_id, ("", b""))
            self.channels[channel.id] = Channel(channel.topic, name, layout, channel.metadata)
