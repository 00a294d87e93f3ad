"""Reading MCAP recordings, whole or not: live ones, cut ones, damaged ones, ones made to do harm.

A file that is no recording raises CaptureError. All other files give what can be read: a damaged chunk is passed over,
the hole shows in the numbering and is an event of its own (`LineEventKind.DROPPED`), and `completeness` says in
words what is wrong and where the file ends.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from dissectors.frame import Chunk
from sniff.formats import CaptureError
from sniff.formats.files import explain, open_capture
from sniff.formats.text import iso
from sniff.recording import scan
from sniff.recording.batch import Batch, Joiner
from sniff.recording.topics import FIXED_CHANNELS, LINE, PART_RECORD, PROFILE, RAW, SESSION_RECORD, VERSION
from sniff.session import Completeness, Item, Session


def read(path: str | Path) -> McapCapture:
    """Open a recording. Raises CaptureError."""
    return McapCapture(Path(path))


class McapCapture:
    """A recording opened for reading; each pass reads the file again, a live one up to where it is then.

    `part`, `first_chunk`, `octets_before`: what the file says about the parts before it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.session = Session.from_metadata({})
        self.part = 1
        self.first_chunk = 0
        self.octets_before = 0
        self._known_first = False
        self._completeness: Completeness | None = None
        try:
            self._read_start()
        except OSError as error:
            raise explain(path, error) from None

    # what a capture gives

    def items(self, since: int | None = None) -> Iterator[Item]:
        """Chunks and line events as they were recorded.

        `since`: only those at or after that time (ns), without reading the chunks of the file before it.
        Raises CaptureError only when the file cannot be read any more at all.
        """
        joiner = self._joiner(since)
        last: int | None = None
        with self._open() as (stream, report):
            for item in self._joined(stream, report, joiner, since):
                if since is None or item.time >= since:
                    yield item
                if isinstance(item, Chunk):
                    last = item.time
            if since is None:
                self._completeness = self._judge(report, joiner, last)

    def completeness(self) -> Completeness:
        """Whether the file is whole; reads all of it, once."""
        if self._completeness is None:
            for _ in self.items():
                pass
        assert self._completeness is not None
        return self._completeness

    # one pass

    @contextmanager
    def _open(self) -> Iterator[tuple[BinaryIO, scan.Report]]:
        """The file after its magic, and a report for one pass over it. Raises CaptureError."""
        with open_capture(self.path) as stream:
            try:
                stream.seek(len(scan.MAGIC))
                yield stream, scan.Report(os.fstat(stream.fileno()).st_size)
            except OSError as error:
                raise explain(self.path, error) from None

    def _joiner(self, since: int | None) -> Joiner:
        return Joiner(self.first_chunk if since is None and self._known_first else None)

    def _joined(self, stream: BinaryIO, report: scan.Report, joiner: Joiner, since: int | None) -> Iterator[Item]:
        for topic, head, data in _messages(stream, report, since):
            if topic == LINE:
                joiner.line(head[2], data)
            elif topic == RAW:
                batch = Batch.decode(data)
                if batch is None:
                    report.problem(f"the sizes in the batch of reads {head[1]} contradict each other", len(data))
                else:
                    yield from joiner.raw(head[1], batch)
        yield from joiner.close()

    def _judge(self, report: scan.Report, joiner: Joiner, last: int | None) -> Completeness:
        """What a whole pass found, in words."""
        said: list[str] = []
        when = f"last chunk read at {iso(last)}" if last is not None else "no chunk in it"
        if not report.footer:
            said.append(
                f"cut at octet {report.end} of {report.size}, or still being written; {when}; "
                f"{report.size - report.end} octets of an unfinished record not read"
            )
        said.extend(report.problems[:5])
        if len(report.problems) > 5:
            said.append(f"{len(report.problems) - 5} more such places")
        if report.problems and report.unread:
            said.append(f"{report.unread} octets of the file lost")
        for count, words in (
            (joiner.missing, "reads missing in the numbering"),
            (joiner.backward, "batches numbered backwards"),
            (joiner.strange, "messages on /line that belong to nothing"),
        ):
            if count:
                said.append(f"{count} {words}")
        return Completeness(not said, "; ".join(said) if said else "complete")

    # the start

    def _read_start(self) -> None:
        with open_capture(self.path) as stream:
            status = os.fstat(stream.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise CaptureError(f"{self.path}: not a regular file; copy it to one first")
            if status.st_size == 0:
                raise CaptureError(f"{self.path}: empty file; nothing was recorded in it")
            magic = stream.read(len(scan.MAGIC))
            if magic != scan.MAGIC:
                raise CaptureError(f"{self.path}: not an MCAP file; {_looks_like(magic)}")
            ours = self._read_first_records(stream, scan.Report(status.st_size))
        if not ours:
            raise CaptureError(f"{self.path}: an MCAP file, but not a recording of a serial line (no {RAW} in it)")

    def _read_first_records(self, stream: BinaryIO, report: scan.Report) -> bool:
        """Take the session from the records before the first chunk; whether this is a recording of ours."""
        from mcap.records import Header

        ours = False
        for record in scan.records(stream, report):
            if record.body is None:
                continue
            if record.opcode == scan.CHUNK:
                topics = _topics(scan.unpack_chunk(record.body))
                return ours or RAW in topics.values()
            if record.opcode == scan.HEADER:
                header = scan.parse(Header, record.body)
                ours = ours or (header is not None and header.profile == PROFILE)
            elif record.opcode == scan.METADATA:
                ours = self._take_metadata(record.body) or ours
        return ours

    def _take_metadata(self, body: bytes) -> bool:
        from mcap.records import Metadata

        found = scan.parse(Metadata, body)
        if found is None or found.name not in (SESSION_RECORD, PART_RECORD):
            return False
        if found.name == SESSION_RECORD:
            self.session = Session.from_metadata(found.metadata)
            return True
        version = _number(found.metadata.get("version"), VERSION)
        if version > VERSION:
            raise CaptureError(
                f"{self.path}: written by a newer sniff485 (layout {version}, known is {VERSION}); use that one"
            )
        self.part = _number(found.metadata.get("part"), 1)
        self._known_first = "first_chunk" in found.metadata
        self.first_chunk = _number(found.metadata.get("first_chunk"), 0)
        self.octets_before = _number(found.metadata.get("octets_before"), 0)
        return True


def _messages(
    stream: BinaryIO, report: scan.Report, since: int | None
) -> Iterator[tuple[str, tuple[int, int, int, int], bytes]]:
    """Topic, head (`scan.MESSAGE_HEAD`) and data of all messages that can be read."""
    topics = {number: topic for number, (topic, _) in enumerate(FIXED_CHANNELS, 1)}
    for record in scan.records(stream, report, since):
        if record.body is None:
            continue
        if record.opcode == scan.CHUNK:
            octets = scan.unpack_chunk(record.body)
            if isinstance(octets, str):
                report.problem(f"chunk at octet {record.offset}: {octets}", len(record.body))
                continue
            inner = scan.inner_records(octets)
        else:
            inner = iter([(record.opcode, record.body)])
        for opcode, body in inner:
            if opcode == scan.MESSAGE and len(body) >= scan.MESSAGE_HEAD.size:
                head = scan.MESSAGE_HEAD.unpack_from(body)
                topic = topics.get(head[0])
                if topic is not None:
                    yield topic, head, body[scan.MESSAGE_HEAD.size :]
            elif opcode == scan.CHANNEL:
                topics.update(_channel(body))


def _topics(octets: bytes | str) -> dict[int, str]:
    topics: dict[int, str] = {}
    if isinstance(octets, bytes):
        for opcode, body in scan.inner_records(octets):
            if opcode == scan.CHANNEL:
                topics.update(_channel(body))
    return topics


def _channel(body: bytes) -> dict[int, str]:
    from mcap.records import Channel

    channel = scan.parse(Channel, body)
    return {} if channel is None else {channel.id: channel.topic}


def _number(text: str | None, default: int) -> int:
    return int(text) if text is not None and text.isascii() and text.isdigit() and len(text) < 20 else default


def _looks_like(magic: bytes) -> str:
    if magic.startswith(b"#!sniff"):
        return "it is a text capture; name it *.cap.txt"
    if magic[:4] in (b"\n\r\r\n", b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d"):
        return "it is a packet capture; name it *.pcap or *.pcapng"
    return "choose a recording of sniff485, or the suffix that fits it"
