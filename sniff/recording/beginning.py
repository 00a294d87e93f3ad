"""The records before the first chunk of a recording: its buses, the profiles in force, its place among other parts."""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

from sniff.engine.capture import CaptureError
from sniff.engine.session import Session
from sniff.formats.files import open_capture
from sniff.recording import scan
from sniff.recording.topics import (
    BUS,
    PART_RECORD,
    PROFILE,
    PROFILE_MEDIA_TYPE,
    PROFILE_SUFFIX,
    RAW,
    SESSION_RECORD,
    VERSION,
)

MOST_PROFILE = 1 << 20
"""Octets of an attached device profile; a longer one is passed over."""
MOST_PROFILES = 64

MOST_BUSES = 256
"""In one file: as many as a capture can have."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a file stands among the parts of a recording, of one bus.

    `part`: its number, from 1. `first_chunk`: number of its first read, None where the file does not say.
    `octets_before`: in the parts before it.
    """

    part: int = 1
    first_chunk: int | None = None
    octets_before: int = 0


@dataclass(frozen=True, slots=True)
class Beginning:
    """`sessions`: of all buses, in order. `session`, `place`: of the bus that was asked for, `session` with the
    profiles in force."""

    sessions: tuple[Session, ...]
    session: Session
    place: Place


def read_beginning(path: Path, bus: int) -> Beginning:
    """`bus`: which of them, from 0. Raises CaptureError for what is no recording of a serial line, and OSError."""
    with open_capture(path) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise CaptureError(f"{path}: not a regular file; copy it to one first")
        if status.st_size == 0:
            raise CaptureError(f"{path}: empty file; nothing was recorded in it")
        magic = stream.read(len(scan.MAGIC))
        if magic != scan.MAGIC:
            raise CaptureError(f"{path}: not an MCAP file; {_looks_like(magic)}")
        records = _FirstRecords(path, bus)
        if not records.take(stream, scan.Report(status.st_size)):
            raise CaptureError(f"{path}: an MCAP file, but not a recording of a serial line (no {RAW} in it)")
    session = records.sessions[bus] if bus < len(records.sessions) else Session.from_metadata({})
    return Beginning(tuple(records.sessions), replace(session, profiles=records.profiles), records.place)


class _FirstRecords:
    """What the records say, one by one."""

    def __init__(self, path: Path, bus: int) -> None:
        self.sessions: list[Session] = []
        self.profiles: dict[str, str] = {}
        self.place = Place()
        self._path, self._bus = path, bus

    def take(self, stream: BinaryIO, report: scan.Report) -> bool:
        """Those before the first chunk; whether they begin a recording of a serial line."""
        from mcap.records import Header

        ours = False
        for record in scan.records(stream, report):
            if record.body is None:
                continue
            if record.opcode == scan.CHUNK:
                return ours or any(topic.startswith(RAW) for topic in _topics(record.body))
            if record.opcode == scan.HEADER:
                header = scan.parse(Header, record.body)
                ours = ours or (header is not None and header.profile == PROFILE)
            elif record.opcode == scan.METADATA:
                ours = self._take_metadata(record.body) or ours
            elif record.opcode == scan.ATTACHMENT:
                self._take_profile(record.body)
        return ours

    def _take_profile(self, body: bytes) -> None:
        from mcap.records import Attachment

        found = scan.parse(Attachment, body) if len(body) <= MOST_PROFILE else None
        if found is not None and found.media_type == PROFILE_MEDIA_TYPE and len(self.profiles) < MOST_PROFILES:
            self.profiles[found.name.removesuffix(PROFILE_SUFFIX)] = found.data.decode("utf-8", "replace")

    def _take_metadata(self, body: bytes) -> bool:
        from mcap.records import Metadata

        found = scan.parse(Metadata, body)
        if found is None or found.name not in (SESSION_RECORD, PART_RECORD):
            return False
        if found.name == SESSION_RECORD:
            self._take_session(found.metadata)
        else:
            self._take_place(found.metadata)
        return True

    def _take_session(self, record: Mapping[str, str]) -> None:
        if len(self.sessions) >= MOST_BUSES:
            raise CaptureError(f"{self._path}: over {MOST_BUSES} buses in it; no recording of sniff485 has as many")
        self.sessions.append(Session.from_metadata(record))

    def _take_place(self, record: Mapping[str, str]) -> None:
        version = _number(record.get("version"), VERSION)
        if version > VERSION:
            raise CaptureError(
                f"{self._path}: written by a newer sniff485 (layout {version}, known is {VERSION}); use that one"
            )
        if _number(record.get(BUS), self._bus) == self._bus:
            first = _number(record["first_chunk"], 0) if "first_chunk" in record else None
            self.place = Place(_number(record.get("part"), 1), first, _number(record.get("octets_before"), 0))


def _topics(chunk: bytes) -> set[str]:
    """Topics of the channels that a chunk record defines."""
    from mcap.records import Channel

    octets = scan.unpack_chunk(chunk)
    if isinstance(octets, str):
        return set()
    found = (scan.parse(Channel, body) for opcode, body in scan.inner_records(octets) if opcode == scan.CHANNEL)
    return {channel.topic for channel in found if channel is not None}


def _number(text: str | None, default: int) -> int:
    return int(text) if text is not None and text.isascii() and text.isdigit() and len(text) < 20 else default


def _looks_like(magic: bytes) -> str:
    if magic.startswith(b"#!sniff"):
        return "it is a text capture; name it *.cap.txt"
    if magic[:4] in (b"\n\r\r\n", b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d"):
        return "it is a packet capture; name it *.pcap or *.pcapng"
    return "choose a recording of sniff485, or the suffix that fits it"
