"""Tables that a file holds are those that would be found; where they may not be, they are not taken."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.offline import outputs
from sniff.engine import bulk
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.bulk import BulkEngine, tables, tables_of
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.engine import Output
from sniff.engine.session import Completeness, Item, LineEvent, LineEventKind, Session
from sniff.engine.table import Table
from sniff.formats import read
from sniff.formats.several_buses import buses_in
from sniff.recording import reader, stored_tables
from sniff.recording.frame_log import FrameLog
from sniff.recording.frames import SCHEMA, encode
from sniff.recording.mcap_writer import create
from sniff.recording.reader import McapCapture
from sniff.recording.topics import FRAMES_RECORD
from tests.seeds import in_turn, some

ROOT = Path(__file__).parents[3]
CAPTURES = ROOT / "captures"
OTHERS = ROOT.parent / "shared/captures"
FAULTS = CAPTURES / "rtu-usual-faults.cap.txt"
CHUNK_INDEX, METADATA_INDEX = 0x08, 0x0D
LONG = 200_000
"""Octets of a capture of others that is not read here."""


def keep(capture: Capture, path: Path, session: Session | None = None, *, by_rows: bool = False) -> bool:
    """Write a capture with what is found in it; whether it is kept."""
    session = session or capture.session
    log, engine = FrameLog(session), BulkEngine(session)
    with create(path, session) as writer:
        if by_rows:
            for item in capture.items():
                writer.write(item)
                if isinstance(item, Chunk):
                    log.hear(item.time)
            for given in outputs(capture.items(), session):
                (log.add if isinstance(given, Output) else log.add_line_event)(given)  # type: ignore[arg-type]
        else:
            for part in capture.blocks():
                (writer.write if isinstance(part, LineEvent) else writer.write_block)(part)  # type: ignore[arg-type]
                if not isinstance(part, LineEvent):
                    log.hear_many(part.reads.times)
                is_hole = isinstance(part, LineEvent) and part.kind.is_hole
                if isinstance(part, LineEvent) and is_hole:
                    log.add_line_event(part)
                log.add_table(engine.take(part))
                if isinstance(part, LineEvent) and not is_hole:
                    log.add_line_event(part)
            log.add_table(engine.close())
        log.close()
        writer.add_frames(log.take(), SCHEMA)
        record = log.record()
        if record is not None:
            writer.note(FRAMES_RECORD, record)
    return log.fits


def flat(items: Iterable[Table | LineEvent]) -> Iterator[Any]:
    """Rows, exchanges and line events, each in the order in which an observer is told of it."""
    for item in items:
        if isinstance(item, LineEvent):
            yield item
            continue
        for output in item.outputs():
            yield from output.rows
            yield from output.transactions


def opened(path: Path) -> McapCapture:
    capture = reader.read(path)
    assert isinstance(capture, McapCapture)
    return capture


def held(capture: McapCapture) -> list[Any] | None:
    found = capture.stored_tables(capture.session)
    return None if found is None else list(flat(found))


@pytest.mark.parametrize("by_rows", [False, True])
def test_what_is_held_is_what_would_be_found(by_rows: bool, tmp_path: Path) -> None:
    kept = 0
    for path in in_turn(some(sorted(CAPTURES.rglob("*.cap.txt")), 4), by_rows, 2):
        kept += _is_the_same(read(path), tmp_path / "kept.mcap", by_rows, path.name)
    assert kept > 20


@pytest.mark.skipif(not OTHERS.is_dir(), reason="shared captures are not here")
def test_in_captures_of_others(tmp_path: Path) -> None:
    kept = 0
    for path in sorted(OTHERS.rglob("*")):
        if path.suffix in (".cap", ".pcap", ".pcapng") and path.stat().st_size < LONG:
            try:
                buses = buses_in(read(path))
            except CaptureError:
                continue
            for capture in buses:
                kept += _is_the_same(capture, tmp_path / "kept.mcap", False, path.name)
    assert kept > 3


def _is_the_same(capture: Capture, path: Path, by_rows: bool, name: str) -> bool:
    fits = keep(capture, path, by_rows=by_rows)
    written = opened(path)
    found = held(written)
    assert (found is not None) == fits, name
    if found is None:
        return False
    assert found == list(flat(tables(written.blocks(), written.session))), name
    assert written._completeness is not None
    assert written._completeness.whole
    return True


class Items:
    """A capture of these items."""

    def __init__(self, session: Session, items: Sequence[Item]) -> None:
        self.session = session
        self._items = items

    def items(self) -> Iterator[Item]:
        return iter(self._items)

    def blocks(self) -> Iterator[Block | LineEvent]:
        return blocks_of(self._items)

    def completeness(self) -> Completeness:
        return Completeness(True, "complete")


def test_line_events_stand_where_they_stood(tmp_path: Path) -> None:
    capture = read(FAULTS)
    items = list(capture.items())
    for place in (len(items) * 2 // 3, len(items) // 3):
        time = items[place].time
        items[place:place] = [LineEvent(time, LineEventKind.DROPPED, "3 reads", 3), LineEvent(time, LineEventKind.MARK)]
    assert _is_the_same(Items(capture.session, items), tmp_path / "kept.mcap", False, "events")
    found = held(opened(tmp_path / "kept.mcap"))
    assert found is not None
    assert sum(isinstance(item, LineEvent) for item in found[1:-1]) == 4


def test_where_settings_are_searched_for_or_change_nothing_is_kept(tmp_path: Path) -> None:
    capture = read(FAULTS)
    assert not keep(capture, tmp_path / "a.mcap", replace(capture.session, unknown=("line",)))
    changed = [LineEvent(0, LineEventKind.SETTINGS, "9600,8N1"), *capture.items()]
    assert not keep(Items(capture.session, changed), tmp_path / "b.mcap")
    assert held(opened(tmp_path / "b.mcap")) is None


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """A capture of some faults with what is found in it."""
    path = tmp_path / "kept.mcap"
    assert keep(read(FAULTS), path)
    assert held(opened(path)) is not None
    return path


def test_another_program_finds_it_anew(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored_tables, "program", lambda: "0.1.0 another")
    assert held(opened(kept)) is None


@pytest.mark.parametrize("change", ["protocol", "line", "latency"])
def test_other_settings_find_it_anew(kept: Path, change: str) -> None:
    capture = opened(kept)
    session = capture.session
    other = {
        "protocol": replace(session, protocol="n2"),
        "line": replace(session, line=LineSettings(session.line.baud * 2)),
        "latency": replace(session, adapter=replace(session.adapter, latency=session.adapter.latency + 1_000_000)),
    }[change]
    assert capture.stored_tables(session) is not None
    assert capture.stored_tables(other) is None
    assert list(flat(tables_of(capture, other))) == list(flat(tables(capture.blocks(), other)))


def test_a_changed_octet_anywhere_finds_it_anew(kept: Path) -> None:
    whole = kept.read_bytes()
    for at in range(8, len(whole), max(1, len(whole) // 60)):
        changed = bytearray(whole)
        changed[at] ^= 0x20
        kept.write_bytes(changed)
        try:
            capture = opened(kept)
        except CaptureError:
            continue
        found = held(capture)
        assert found is None or at >= len(whole) - 1000, at  # what lies behind the data may only be the index
        assert found is None or found == list(flat(tables(capture.blocks(), capture.session)))


def test_a_file_cut_short_finds_it_anew(kept: Path) -> None:
    whole = kept.read_bytes()
    for left in (len(whole) - 1, len(whole) - 8, len(whole) - 40, len(whole) * 2 // 3):
        kept.write_bytes(whole[:left])
        capture = opened(kept)
        assert held(capture) is None
        assert list(flat(tables_of(capture, capture.session))) == list(flat(tables(capture.blocks(), capture.session)))


def forged(path: Path, change: Callable[[Table], Table | None], events: int = 0) -> McapCapture:
    """A file, whole and with its checks, that says something else than what is found in it."""
    capture = read(FAULTS)
    session = capture.session
    log = FrameLog(session)
    whole = BulkEngine(session)
    with create(path, session) as writer:
        made: list[Table] = []
        for part in capture.blocks():
            (writer.write if isinstance(part, LineEvent) else writer.write_block)(part)  # type: ignore[arg-type]
            made.append(whole.take(part))
        for table in [*made, whole.close()]:
            log.add_table(table)
        log.close()
        table = bulk.joined(session.protocol, 1, [*filter(None, made)])
        told = change(table)
        if told is not None:
            writer.add_frames([(1, 1, encode(told, events))], SCHEMA)
        record = log.record()
        assert record is not None
        writer.note(FRAMES_RECORD, record)
    return opened(path)


FORGERIES: dict[str, Callable[[Table], Table | None]] = {
    "other octets": lambda table: replace(table, octets=np.where(table.octets == 3, 4, table.octets).astype(np.uint8)),
    "rows left out": lambda table: table.part(0, len(table) - 1),
    "rows numbered from elsewhere": lambda table: replace(table, first=2),
    "nothing": lambda table: None,
    "codes of nothing": lambda table: replace(
        table, frames=replace(table.frames, damage=np.full(len(table), 99, np.uint8))
    ),
    "exchanges without end": lambda table: replace(
        table, placed=replace(table.placed, tx=np.full(len(table), 1 << 60, np.int64))
    ),
    "texts that are not there": lambda table: replace(
        table, frames=replace(table.frames, kind=np.full(len(table), 999, np.uint16))
    ),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_what_was_made_to_deceive_is_said(name: str, tmp_path: Path) -> None:
    capture = forged(tmp_path / "forged.mcap", FORGERIES[name])
    given_tables = capture.stored_tables(capture.session)
    assert given_tables is not None
    with pytest.raises(CaptureError, match="--reference reads the octets alone"):
        list(given_tables)


def test_events_that_never_were_are_said(tmp_path: Path) -> None:
    capture = forged(tmp_path / "forged.mcap", lambda table: table, events=1)
    with pytest.raises(CaptureError, match="--reference"):
        held(capture)


def test_marks_beside_the_file_stand_where_they_stand_without(kept: Path) -> None:
    from sniff.formats.mark_file import add_mark

    chunks = [item for item in opened(kept).items() if isinstance(item, Chunk)]
    add_mark(kept, chunks[len(chunks) // 2].time, "here")
    capture = read(kept)
    marked = list(flat(tables_of(capture, capture.session)))
    assert sum(isinstance(item, LineEvent) for item in marked) == 1
    rows = [item for item in marked if not isinstance(item, LineEvent)]
    assert rows == list(flat(tables(opened(kept).blocks(), capture.session)))


def with_index(path: Path, change: Callable[[int, bytearray], None]) -> McapCapture:
    """The file with each record of its index changed, and its checks made anew."""
    octets = bytearray(path.read_bytes())
    footer = len(octets) - 8 - 29
    begin = int.from_bytes(octets[footer + 9 : footer + 17], "little")
    at = begin
    while at < footer:
        end = at + 9 + int.from_bytes(octets[at + 1 : at + 9], "little")
        body = octets[at + 9 : end]
        change(octets[at], body)
        octets[at + 9 : end] = body
        at = end
    octets[footer + 25 : footer + 29] = zlib.crc32(octets[begin : footer + 25]).to_bytes(4, "little")
    path.write_bytes(octets)
    return opened(path)


@pytest.mark.parametrize("begin", [0, 9, 1 << 40, 1 << 62, (1 << 64) - 1, None])
def test_an_index_that_points_elsewhere_ends_the_reading(kept: Path, begin: int | None) -> None:
    def elsewhere(opcode: int, body: bytearray) -> None:
        if opcode == CHUNK_INDEX:
            was = int.from_bytes(body[16:24], "little")
            body[16:24] = (was + 1 if begin is None else begin).to_bytes(8, "little")

    with pytest.raises(CaptureError, match="--reference"):
        held(with_index(kept, elsewhere))


@pytest.mark.parametrize("begin", [0, 1 << 40, (1 << 64) - 1])
def test_a_record_that_is_elsewhere_is_none(kept: Path, begin: int) -> None:
    def elsewhere(opcode: int, body: bytearray) -> None:
        if opcode == METADATA_INDEX:
            body[:8] = begin.to_bytes(8, "little")

    assert held(with_index(kept, elsewhere)) is None


POLL = bytes.fromhex("010300000002c40b")
STEP = 100_000_000


@pytest.mark.parametrize("times", [(0, 2 * STEP, STEP, 3 * STEP), (1 << 61, (1 << 61) + STEP), (0, -(1 << 61) - 1)])
def test_where_it_depends_on_how_reads_are_cut_nothing_is_kept(times: tuple[int, ...], tmp_path: Path) -> None:
    """A clock that runs backwards, and times far away."""
    session = read(FAULTS).session
    for by_rows in (False, True):
        items = [Chunk(time, POLL) for time in times]
        assert not keep(Items(session, items), tmp_path / "kept.mcap", by_rows=by_rows)
        (tmp_path / "kept.mcap").unlink()
    assert keep(
        Items(session, [Chunk(time, POLL) for time in sorted(times) if abs(time) < 1 << 61]), tmp_path / "x.mcap"
    )


def test_what_the_reader_would_not_take_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sniff.recording import frames

    monkeypatch.setattr(frames, "MOST_OPEN", 0)
    assert not keep(read(FAULTS), tmp_path / "kept.mcap")
    assert held(opened(tmp_path / "kept.mcap")) is None


def test_the_program_is_its_version_and_what_decides() -> None:
    from sniff.recording.program import program
    from sniff.version import __version__

    version, digest = program().split()
    assert version == __version__
    assert len(digest) == 24
