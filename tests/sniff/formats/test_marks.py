"""Marks: beside a capture, in a recording, in the comments of pcapng, and back."""

from __future__ import annotations

import random
import shutil
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dissectors.frame import Chunk
from sniff.bus.file_source import FileFeed
from sniff.bus.marked_rows import MarkedRows
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.bus.row_source import LiveFeed
from sniff.cli import arguments, main
from sniff.engine.blocks import blocks_of
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import create_of_items, read
from sniff.formats.mark_file import add_mark, mark_file, marks_beside
from sniff.formats.pcapng import ENHANCED, OPT_COMMENT, OPT_END, SECTION, _option
from sniff.formats.several_buses import chosen
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder
from tests.sniff.analysis.sites_made import power_lost, sessions, write

CLEAN = Path("captures/rtu-clean.cap.txt")


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    return Path(shutil.copy(CLEAN, tmp_path / "night.cap.txt"))


def rows_of(path: Path, reference: bool = False) -> dict[int, str]:
    capture, marked = read(path), MarkedRows()
    survey(capture, capture.session, marked, reference=reference)
    return marked.by_row()


def starts(path: Path) -> list[int]:
    capture, marked = read(path), MarkedRows()
    survey(capture, capture.session, marked)
    return [int(start) for part in marked._starts for start in part]


def test_marks_beside_a_file_are_read_with_it(capture: Path) -> None:
    begins = starts(capture)
    before = capture.read_bytes()
    add_mark(capture, begins[4], "gate opens; ü")
    add_mark(capture, begins[2], "gone again")
    add_mark(capture, begins[2], None)
    assert capture.read_bytes() == before
    assert rows_of(capture) == rows_of(capture, reference=True) == {5: "gate opens; ü"}


@pytest.mark.parametrize("text", ["", "no json\n", '{"time": "x"}\n', "[1]\n", '{"time": 1}\n', "[" * 5000, "\x00\xff"])
def test_what_is_no_mark_is_passed_over(capture: Path, text: str) -> None:
    mark_file(capture).write_text(text)
    assert marks_beside(capture) == []
    assert rows_of(capture) == {}


def test_marks_of_one_bus_of_several_are_that_bus_s(tmp_path: Path) -> None:
    path = tmp_path / "site.mcap"
    write(path, power_lost(random.Random(1)))
    for name, capture in arguments.open_buses(str(path)):
        feed = FileFeed(name, capture, capture.session, buses=3)
        assert feed.mark(next(iter(capture.items())).time, f"seen on {capture.session.bus}") == f"in {path}.marks.jsonl"
    for _, capture in arguments.open_buses(str(path)):
        marked = MarkedRows()
        survey(capture, capture.session, marked)
        assert marked.by_row() == {1: f"seen on {capture.session.bus}"}
    with chosen("roof"):
        assert [one.text for one in read(path).items() if isinstance(one, LineEvent)] == ["seen on roof"]


def test_parts_of_a_recording_with_marks_beside_them_are_one_still(tmp_path: Path) -> None:
    site = power_lost(random.Random(2))
    session, items = sessions(site)[0], site["boiler"]
    recorder = Recorder(tmp_path / "night.mcap", session, Rotation(count=100))
    for item in items:
        recorder.tick(item.time)
        if isinstance(item, Chunk):
            recorder.chunk(item)
    recorder.close()
    parts = [str(path) for path in recorder.paths]
    add_mark(parts[1], items[150].time, "in the second part")
    ((name, whole),) = arguments.open_captures(parts)
    assert name.endswith(f"{len(parts) - 1} more parts")
    FileFeed(name, whole, whole.session).mark(items[0].time, "in the first")
    ((_, again),) = arguments.open_captures(parts)
    assert [one.text for one in again.items() if isinstance(one, LineEvent)] == ["in the first", "in the second part"]


def test_a_recording_holds_marks_that_came_later(capture: Path, tmp_path: Path) -> None:
    held = read(capture)
    begins = starts(capture)
    target = tmp_path / "night.mcap"
    with create_of_items(target, held.session) as writer:
        last = 0
        for item in held.items():
            writer.write(item)
            last = item.time
        writer.write(LineEvent(last, LineEventKind.MARK, "what was that?", last - begins[3]))
    assert rows_of(target) == {4: "what was that?"}


def test_a_mark_that_a_recording_holds_is_taken_away_beside_it(capture: Path, tmp_path: Path) -> None:
    held, begins, target = read(capture), starts(capture), tmp_path / "night.mcap"
    with create_of_items(target, held.session) as writer:
        last = 0
        for item in held.items():
            writer.write(item)
            last = item.time
        for place in (3, 5):
            writer.write(LineEvent(last, LineEventKind.MARK, f"row {place + 1}", last - begins[place]))
    feed = FileFeed(str(target), opened := read(target), opened.session)
    feed.mark(begins[3], None)
    assert rows_of(target) == rows_of(target, reference=True) == {6: "row 6"}
    feed.mark(begins[3], "after all")
    assert rows_of(target) == {4: "after all", 6: "row 6"}


@pytest.mark.parametrize("follows", [False, True])
def test_marks_that_others_write_meanwhile_are_seen(capture: Path, follows: bool) -> None:
    add_mark(capture, 5, "there already")
    opened = read(capture)
    feed: FileFeed | LiveFeed = FileFeed(str(capture), opened, opened.session)
    if follows:
        model = BusModel(opened.session, dissector_for(opened.session))
        live: Any = SimpleNamespace(session=opened.session, dissector=model.dissector, model=model, ear=None)
        live.poll_tables = list
        feed = LiveFeed(live, follows=str(capture))
    while feed.poll() or feed.work():
        pass

    def said() -> list[tuple[int, str]]:
        return [(one.time, one.text) for one in feed.store.line_events if one.is_mark]

    assert said() == [(5, "there already")]
    feed.mark(9, "mine")
    add_mark(capture, 7, "theirs")
    assert feed.poll()
    assert not feed.poll()
    assert said() == [(5, "there already"), (9, "mine"), (7, "theirs")]
    mark_file(capture).unlink()
    assert feed.poll()
    assert said()[3:] == [(5, ""), (7, ""), (9, "")]


def test_marks_travel_through_pcapng(capture: Path, tmp_path: Path) -> None:
    begins = starts(capture)
    add_mark(capture, begins[6], "look at this")
    target = tmp_path / "night.pcapng"
    assert main(["convert", str(capture), str(target)]) == 0
    assert b"mark: look at this" in target.read_bytes()
    assert rows_of(target) == rows_of(target, reference=True) == {7: "look at this"}


def test_comments_of_another_program_are_marks(capture: Path, tmp_path: Path) -> None:
    """As Wireshark saves them: a file without our section comment, a comment at one packet of many."""
    target = tmp_path / "other.pcapng"
    assert main(["convert", str(capture), str(target)]) == 0
    data = target.read_bytes()
    foreign, at, seen = b"", 0, 0
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        body = data[at + 8 : at + length - 4]
        if kind == SECTION:
            body = body[:16]
        elif kind == ENHANCED:
            seen += 1
            kept = struct.unpack_from("<I", body, 12)[0]
            said = _option(OPT_COMMENT, b"seen on site") + _option(OPT_END) if seen == 40 else b""
            body = body[: 20 + kept + -kept % 4] + said
        size = struct.pack("<I", len(body) + 12)
        foreign += struct.pack("<I", kind) + size + body + size
        at += length
    target.write_bytes(foreign)
    marked = rows_of(target)
    assert list(marked.values()) == ["seen on site"]
    assert marked == rows_of(target, reference=True)
    events = [one for one in read(target).items() if isinstance(one, LineEvent)]
    assert [one for one in read(target).blocks() if isinstance(one, LineEvent)] == events
    assert list(blocks_of(read(target).items()))


def test_a_report_tells_marks(capture: Path, tmp_path: Path) -> None:
    add_mark(capture, starts(capture)[4], "gate opens")
    target = tmp_path / "report.html"
    assert main(["report", str(capture), "-o", str(target)]) == 0
    assert "gate opens" in target.read_text("utf-8")


def test_marks_on_what_another_process_records_stand_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "night.mcap"
    path.write_bytes(b"12345")
    (session,) = sessions({"boiler": []})
    model = BusModel(session, dissector_for(session))
    live: Any = SimpleNamespace(session=session, dissector=model.dissector, model=model, ear=None)
    feed = LiveFeed(live, follows=str(path))
    assert feed.mark(17, "the gate") == f"in {path}.marks.jsonl"
    assert [(one.time, one.text) for one in (*marks_beside(path), *feed.store.line_events)] == 2 * [(17, "the gate")]
    assert path.read_bytes() == b"12345"
