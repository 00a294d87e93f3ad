"""Capture files: one file a format, chosen by content (`table.py` lists them), written by suffix.

`read(path)` gives a Capture (session, items in order, completeness). `create_of_items(path, session)` gives a
CaptureWriter, which takes the same; `create_of_frames` a FrameFile, which takes frames as records of packets. Who has
items and wants a file of any kind asks `sniff.bus.capture_writer`, which has an engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dissectors.frame import Chunk
from sniff.engine.capture import Capture, CaptureError, CaptureWriter
from sniff.engine.read_times import LOOKED_AT, ReadTimes
from sniff.engine.session import NO_TIMES_OF_PACKETS, UNNAMED, Item, LineEventKind, Session
from sniff.formats import compressed, table
from sniff.formats.cut_capture import cut_short
from sniff.formats.files import explain, open_capture
from sniff.formats.mark_file import with_marks
from sniff.formats.several_buses import SeveralBuses, buses_in
from sniff.formats.timeless import IN_PACKETS

if TYPE_CHECKING:
    from sniff.formats.records import FrameFile

SAMPLE = 6000
"""Octets at the begin of a capture that are kept with its session, to tell its protocol."""

ITEMS, FRAMES = "items_writer", "frames_writer"
"""Kinds of writers in the table."""


def read(path: str | Path) -> Capture:
    """Open a capture by what is in it, "-" for standard input. Raises CaptureError."""
    if str(path) == "-":
        from sniff.formats import standard_input

        return _with_reads(standard_input.read(), path)
    if Path(path).is_dir():
        raise CaptureError(f"{path}: a directory, not a capture; name a file in it")
    opened = _with_reads(_opened(Path(path)), path)
    if isinstance(opened, SeveralBuses):
        opened.buses = tuple(with_marks(one, path) for one in opened.buses)
        return opened
    return with_marks(opened, path)


def _opened(path: Path) -> Capture:
    """The capture in a file, whatever it is wrapped in."""
    place, damage, around = path, "", []
    while (wrapping := compressed.wrapping_of(start := start_of(place))) is not None:
        around.append(wrapping.name)
        if len(around) > compressed.DEEPEST:
            raise CaptureError(f"{path}: {' in '.join(reversed(around))}; unpack it first")
        from sniff.formats.unpacking import unpack  # with what unpacks: most captures are as they were written

        unpacked = unpack(place, wrapping)
        place, damage = unpacked.path, damage or unpacked.damage
    try:
        found = _reader(place, start)(place)
    except CaptureError as error:
        said = str(error).replace(str(place), str(path))
        raise CaptureError(f"{said} ({damage})" if damage else said) from None
    return cut_short(path, found, damage) if damage else found


def _reader(path: Path, start: bytes) -> Callable[[Path], Capture]:
    """The function that opens it. Raises CaptureError, which says what was recognised and what to do."""
    if not start:
        raise CaptureError(f"{path}: an empty file")
    found = table.told(start, path.name)
    other = table.unreadable(start)  # it holds frames by chance only
    damaged = found is not None and not found.last and not found.recognises(start) and other is None
    if damaged and found is not None and _holds_frames(start):
        from sniff.formats import raw_dump

        return lambda place: raw_dump.RawDump(place, f"; its name says {found.name}, and it is none")
    if (found is None or found.last) and other is not None:
        raise CaptureError(f"{path}: {other}")
    if found is None:
        raise CaptureError(f"{path}: no capture that this program reads")
    opened: Callable[[Path], Capture] = table.function(found.reader)
    return opened if found.last or found.recognises(start) else _named_only(opened)


def _named_only(opened: Callable[[Path], Capture]) -> Callable[[Path], Capture]:
    """A reader of a file that is not what its name says; its error says the way out too."""

    def read(path: Path) -> Capture:
        try:
            return opened(path)
        except CaptureError as error:
            raise CaptureError(f"{error}; name it .bin if it is octets as they were heard") from None

    return read


def _holds_frames(start: bytes) -> bool:
    """Whether octets without any heading are frames of a field bus, for the most part."""
    from sniff.formats.network_capture import SAMPLE as NEEDED
    from sniff.formats.network_capture import protocol_of

    return protocol_of([Chunk(0, start[:NEEDED])]) is not None


def start_of(path: Path) -> bytes:
    """The first octets of a file, enough to tell what it is. Raises CaptureError."""
    try:
        with open_capture(path) as stream:
            return stream.read(table.SEEN)
    except OSError as error:
        raise explain(path, error) from None


def _with_reads(capture: Capture, path: Path | str) -> Capture:
    """The capture; its session knows when its first reads came, and takes no times as exact that cannot be."""
    buses = buses_in(capture, path)
    if len(buses) > 1:
        for one in buses:
            _with_reads(one, path)
        return capture
    capture = buses[0]
    session = capture.session
    if session.unknown or (session.reads is not None and session.sample):
        return capture
    looked = with_first_reads(session, capture.items())
    known = session.reads is not None  # by a format that knows how exact its times are
    capture.session = replace(session, sample=looked.sample) if known else looked
    return capture


def with_first_reads(session: Session, items: Iterable[Item]) -> Session:
    """The session with when its first reads came, and a latency that these allow; no reads after other settings."""
    reads: list[tuple[int, int]] = []  # time and octets; 0 octets for a hole
    sample: list[Chunk] = []
    left = SAMPLE
    try:
        for item in items:
            if isinstance(item, Chunk):
                reads.append((item.time, len(item.octets)))
                if left > 0:
                    sample.append(item if len(item.octets) <= left else Chunk(item.time, item.octets[:left]))
                    left -= len(item.octets)
            elif item.kind is LineEventKind.SETTINGS:
                break
            elif item.kind.is_hole:
                reads.append((item.time, 0))
            if len(reads) >= LOOKED_AT:
                break
    except CaptureError:
        pass  # whoever reads on is told
    told = replace(session, reads=ReadTimes.of(reads), sample=tuple(sample))
    adapter = session.adapter
    is_foreign = adapter.latency > 0 and adapter.latency_from in UNNAMED
    if is_foreign and told.reads is not None and told.reads.are_none:
        return replace(told, adapter=replace(adapter, latency=IN_PACKETS, latency_from=NO_TIMES_OF_PACKETS))
    return told.with_latency_of_reads()


def keeps_frames(path: str | Path) -> bool:
    """Whether the format of a file to write keeps frames instead of reads."""
    return any(Path(path).name.lower().endswith(suffix) for suffix in table.writers(FRAMES))


def create_of_items(path: str | Path, session: Session) -> CaptureWriter:
    """Create a capture that keeps items as they are, by its suffix. Raises CaptureError."""
    made: CaptureWriter = _find(table.writers(ITEMS), Path(path))(Path(path), session)
    return made


def create_of_frames(path: str | Path, session: Session, link_type: int, live: bool = False) -> FrameFile:
    """Create a packet file, by its suffix; `live` pushes everything through at once. Raises CaptureError."""
    made: FrameFile = _find(table.writers(FRAMES), Path(path))(Path(path), session, link_type, live)
    return made


def _find(written: dict[str, str], path: Path) -> Any:
    for suffix, target in written.items():
        if path.name.lower().endswith(suffix):
            return table.function(target)
    every = {**table.writers(ITEMS), **table.writers(FRAMES)}  # whoever asks may have chosen among both
    raise CaptureError(f"{path}: unknown suffix; expected one of {' '.join(every)}")
