"""Capture files by suffix: one file a format, chosen here.

`read(path)` gives a Capture (session, items in order, completeness). `create_of_items(path, session)` gives a
CaptureWriter, which takes the same; `create_of_frames` a FrameFile, which takes frames as records of packets. Who has
items and wants a file of any kind asks `sniff.bus.capture_writer`, which has an engine.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from dissectors.frame import Chunk
from sniff.engine.capture import Capture, CaptureError, CaptureWriter
from sniff.engine.read_times import LOOKED_AT, ReadTimes
from sniff.engine.session import Item, LineEventKind, Session
from sniff.formats.records import FrameFile
from sniff.formats.several_buses import buses_in

READERS: dict[str, str] = {
    ".cap.txt": "sniff.formats.text:read",
    ".mcap": "sniff.recording.reader:read",
    ".pcap": "sniff.formats.pcap:read",
    ".cap": "sniff.formats.pcap:read",
    ".pcapng": "sniff.formats.pcapng:read",
    ".log": "sniff.formats.bytelog:read",
    ".hex": "sniff.formats.bytelog:read",
    ".csv": "sniff.formats.bytelog:read",
    ".txt": "sniff.formats.plain_text:read",
}
WRITERS: dict[str, str] = {
    ".cap.txt": "sniff.formats.text:create",
    ".mcap": "sniff.recording.writer:create",
}
FRAME_WRITERS: dict[str, str] = {
    ".pcap": "sniff.formats.pcap:create",
    ".pcapng": "sniff.formats.pcapng:create",
}


def read(path: str | Path) -> Capture:
    """Open a capture by its suffix, "-" for standard input. Raises CaptureError."""
    if str(path) == "-":
        from sniff.formats import standard_input

        return _with_reads(standard_input.read())
    if Path(path).is_dir():
        raise CaptureError(f"{path}: a directory, not a capture; name a file in it")
    found: Capture = _find(READERS, Path(path))(Path(path))
    return _with_reads(found)


def _with_reads(capture: Capture) -> Capture:
    """The capture; its session knows when its first reads came, and takes no times as exact that cannot be."""
    buses = buses_in(capture)
    if len(buses) > 1:
        for one in buses:
            _with_reads(one)
        return capture
    capture = buses[0]
    session = capture.session
    if session.unknown or session.reads is not None:
        return capture
    capture.session = with_first_reads(session, capture.items())
    return capture


def with_first_reads(session: Session, items: Iterable[Item]) -> Session:
    """The session with when its first reads came, and a latency that these allow; no reads after other settings."""
    reads: list[tuple[int, int]] = []  # time and octets; 0 octets for a hole
    try:
        for item in items:
            if isinstance(item, Chunk):
                reads.append((item.time, len(item.octets)))
            elif item.kind is LineEventKind.SETTINGS:
                break
            elif item.kind.is_hole:
                reads.append((item.time, 0))
            if len(reads) >= LOOKED_AT:
                break
    except CaptureError:
        pass  # whoever reads on is told
    return replace(session, reads=ReadTimes.of(reads)).with_latency_of_reads()


def keeps_frames(path: str | Path) -> bool:
    """Whether the format of a file to write keeps frames instead of reads."""
    return any(Path(path).name.lower().endswith(suffix) for suffix in FRAME_WRITERS)


def create_of_items(path: str | Path, session: Session) -> CaptureWriter:
    """Create a capture that keeps items as they are, by its suffix. Raises CaptureError."""
    made: CaptureWriter = _find(WRITERS, Path(path))(Path(path), session)
    return made


def create_of_frames(path: str | Path, session: Session, link_type: int, live: bool = False) -> FrameFile:
    """Create a packet file, by its suffix; `live` pushes everything through at once. Raises CaptureError."""
    made: FrameFile = _find(FRAME_WRITERS, Path(path))(Path(path), session, link_type, live)
    return made


def _find(table: dict[str, str], path: Path) -> Any:
    for suffix, target in table.items():
        if path.name.lower().endswith(suffix):
            module, _, attribute = target.partition(":")
            return getattr(import_module(module), attribute)
    raise CaptureError(f"{path}: unknown suffix; expected one of {' '.join(table)}")
