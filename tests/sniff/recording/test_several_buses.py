"""Several buses in one file: each reads as if it had been alone, whatever happens to the file and the disk."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.engine.blocks import Block
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.recording import scan
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.reader import McapCapture
from sniff.recording.rotation import Rotation
from sniff.recording.topics import RAW, VALUE_SCHEMA, topics_of
from sniff.recording.writer import Recorder, SharedFile
from tests.sniff.recording.test_recorder import eventually

S, MS = 1_000_000_000, 1_000_000
BASE = 1_772_359_200 * S
SESSIONS = [
    Session("/dev/ttyUSB0", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE, "boiler"),
    Session("/dev/ttyUSB1", LineSettings(38400, 8, "N", 1), "mstp", BASE, "roof"),
    Session("socket://10.0.0.5:4001", LineSettings(9600, 8, "N", 1), "n2", BASE, "cellar/2", profiles={"x": "a = 1"}),
]


def given(seed: int, count: int, buses: int = 3) -> list[tuple[int, Item]]:
    """What several buses give, in order of time; reads, marks and events."""
    dice, now = random.Random(seed), BASE
    items: list[tuple[int, Item]] = []
    for number in range(count):
        now += dice.randint(1, 30) * MS
        bus = dice.choice((0, 0, 0, 1, 2)) % buses
        octets = dice.randbytes(dice.randint(1, 40))
        marks = (Mark(0, LineError.PARITY),) if dice.random() < 0.05 else ()
        items.append((bus, Chunk(now, octets, marks)))
        if dice.random() < 0.03:
            items.append((bus, LineEvent(now, LineEventKind.NOTE, f"note {number}")))
    return items


def record(recorders: list[Recorder], items: list[tuple[int, Item]]) -> None:
    for bus, item in items:
        if isinstance(item, Chunk):
            recorders[bus].chunk(item)
        else:
            recorders[bus].line(item)
        for recorder in recorders:
            recorder.tick(item.time)


def close(recorders: list[Recorder]) -> None:
    for recorder in recorders:
        recorder.finish()
    for recorder in recorders:
        recorder.close()


def of(bus: int, items: list[tuple[int, Item]]) -> list[Item]:
    return [item for number, item in items if number == bus]


def by_blocks(capture: McapCapture) -> list[Item]:
    return [one for piece in capture.blocks() for one in (piece.chunks() if isinstance(piece, Block) else (piece,))]


def test_each_bus_reads_as_it_was_heard(tmp_path: Path) -> None:
    items = given(1, 2000)
    recorders = SharedFile(tmp_path / "site.mcap", SESSIONS).recorders()
    record(recorders, items)
    close(recorders)
    assert {recorder.path for recorder in recorders} == {tmp_path / "site.mcap"}
    for bus, session in enumerate(SESSIONS):
        capture = McapCapture(tmp_path / "site.mcap", bus)
        assert replace(capture.session, profiles={}) == replace(session, profiles={})
        assert capture.session.profiles == {"x": "a = 1"}
        assert list(capture.items()) == of(bus, items)
        assert by_blocks(capture) == of(bus, items)
        assert capture.completeness().whole
        assert [one.bus for one in capture.sessions] == ["boiler", "roof", "cellar/2"]
    assert all(recorder.lost_octets == recorder.unwritten == 0 for recorder in recorders)


def test_parts_of_a_rotation_hold_every_bus(tmp_path: Path) -> None:
    items = given(2, 3000)
    recorders = SharedFile(tmp_path / "site.mcap", SESSIONS, Rotation(count=700)).recorders()
    record(recorders, items)
    close(recorders)
    paths = recorders[0].paths
    assert len(paths) > 2
    for bus in range(len(SESSIONS)):
        first, *more = (McapCapture(path, bus) for path in paths)
        assert list(first.items(followed_by=more)) == of(bus, items)
        assert sum(len(item.octets) for item in of(bus, items[:0])) == first.octets_before == 0
        heard = 0
        for part in (first, *more):
            assert part.octets_before == heard
            heard += sum(len(item.octets) for item in part.items() if isinstance(item, Chunk))


def test_settings_that_were_found_are_those_of_their_bus(tmp_path: Path) -> None:
    sessions = [SESSIONS[0], replace(SESSIONS[1], unknown=("line",))]
    recorders = SharedFile(tmp_path / "site.mcap", sessions).recorders()
    found = LineSettings(76800, 8, "N", 1)
    change = SettingsChange(found, "mstp", found=True)
    record(recorders, [(1, LineEvent(BASE, LineEventKind.SETTINGS, str(change))), *given(3, 50, 2)])
    close(recorders)
    assert McapCapture(tmp_path / "site.mcap", 0).session.line == sessions[0].line
    assert McapCapture(tmp_path / "site.mcap", 1).session.line == found


def test_a_damaged_first_chunk_costs_its_reads_and_no_bus_takes_anothers(tmp_path: Path) -> None:
    items = given(4, 3000)
    recorders = SharedFile(tmp_path / "site.mcap", SESSIONS).recorders()
    record(recorders, items)
    close(recorders)
    octets = bytearray((tmp_path / "site.mcap").read_bytes())
    with (tmp_path / "site.mcap").open("rb") as stream:
        stream.seek(len(scan.MAGIC))
        first = next(one for one in scan.records(stream, scan.Report(len(octets))) if one.opcode == scan.CHUNK)
    octets[first.offset + 60] ^= 0xFF
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(octets)
    missing = 0
    for bus in range(len(SESSIONS)):
        capture = McapCapture(damaged, bus)
        whole = [item for item in of(bus, items) if isinstance(item, Chunk)]
        read = [item for item in capture.items() if isinstance(item, Chunk)]
        assert {(chunk.time, chunk.octets) for chunk in read} <= {(chunk.time, chunk.octets) for chunk in whole}
        assert read
        missing += len(whole) - len(read)
        assert not capture.completeness().whole
    assert missing


def test_a_file_that_was_removed_is_counted_for_each_bus(tmp_path: Path) -> None:
    items = given(5, 400)
    recorders = SharedFile(tmp_path / "site.mcap", SESSIONS).recorders()
    record(recorders, items)
    for recorder in recorders:
        recorder.tick(BASE + 100 * S)
    eventually(lambda: recorders[0]._keeper.orders.qsize() == 0, "the keeper does not come round")
    (tmp_path / "site.mcap").unlink()
    after = [(bus, replace(item, time=item.time + 200 * S)) for bus, item in given(6, 200)]
    record(recorders, after)
    for recorder in recorders:
        recorder.tick(BASE + 300 * S)
    close(recorders)
    assert recorders[0].path != tmp_path / "site.mcap"
    for bus, recorder in enumerate(recorders):
        (note,) = recorder.notices
        assert "was removed while it was recorded" in note
        sent = sum(len(item.octets) for _, item in (*items, *after) if _ == bus and isinstance(item, Chunk))
        held = [item for item in McapCapture(recorder.path, bus).items() if isinstance(item, Chunk)]
        assert sent == sum(len(chunk.octets) for chunk in held) + recorder.lost_octets


def test_values_of_a_bus_stand_beside_its_reads(tmp_path: Path) -> None:
    recorders = SharedFile(tmp_path / "site.mcap", SESSIONS[:2]).recorders()
    record(recorders, given(7, 20, 2))
    for bus, recorder in enumerate(recorders):
        recorder.derived(DerivedMessage(f"/values/{bus}/3/speed", VALUE_SCHEMA.name, BASE, BASE, b'{"value": 1}'))
    close(recorders)
    topics = {topic for topic, _, _ in McapCapture(tmp_path / "site.mcap").messages("/values")}
    assert topics == {"/values/0/3/speed", "/values/1/3/speed"}


@pytest.mark.parametrize(
    ("buses", "raw"),
    [
        (["bus"], ["/raw"]),
        (["a", "b"], ["/raw/a", "/raw/b"]),
        (["a", "a"], ["/raw/a", "/raw/a-2"]),
        (["boiler room", "boiler/room", ""], ["/raw/boiler-room", "/raw/boiler-room-2", "/raw/bus"]),
    ],
)
def test_topics_say_which_bus(buses: list[str], raw: list[str]) -> None:
    assert [own["/raw"] for own in topics_of(buses)] == raw


def test_buses_never_share_a_topic() -> None:
    """A number that tells a name from its like may be another's name."""
    names = [topics[RAW] for topics in topics_of(["a", "a-3", "a!", "a-3", "a"])]
    assert len(set(names)) == len(names)
    assert topics_of(["a", "b", "a"])[2][RAW] == "/raw/a-3"
