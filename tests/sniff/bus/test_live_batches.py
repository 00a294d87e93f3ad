"""A live bus takes reads together, and nobody sees it: what is known is there at once, and counted where it belongs."""

from __future__ import annotations

import json

from dissectors import registry
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from sniff.bus.live import LiveBus
from sniff.bus.recorded_values import RecordedValues
from sniff.capture.ipc import Ended, HeardOctets, ReceivedMessage, Tick
from sniff.engine.blocks import Block, reads_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, LineEventKind, Session
from sniff.engine.table import Table
from tests.property.modbus_adus import rtu
from tests.sniff.bus.given_link import GivenLink

MS = 1_000_000
LINE = "115200,8N1"
SESSION = Session("port0", LineSettings.parse(LINE), "modbus-rtu", bus="bus0")


def polls(begin: int, count: int) -> list[Chunk]:
    """Requests and answers, 2 ms apart, from `begin` (ms) on; each of 16 places is another one."""
    chunks = []
    for turn in range(count):
        asked = bytes((1 + turn % 4, 3, 0, turn // 4 % 4, 0, 1))
        told = bytes((1 + turn % 4, 3, 2, 1, turn % 250))
        now = (begin + 4 * turn) * MS
        chunks += [Chunk(now, rtu(asked)), Chunk(now + 2 * MS, rtu(told))]
    return chunks


def heard(chunks: list[Chunk]) -> HeardOctets:
    return HeardOctets(0, Block(reads_of(chunks)))


def live(paths: tuple[str, ...] = (), watched: bool = True) -> tuple[LiveBus, GivenLink]:
    link = GivenLink(paths=paths, line=LINE)
    return LiveBus(link, watched=watched), link  # type: ignore[arg-type]


def test_a_lone_frame_is_shown_by_silence_alone() -> None:
    bus, link = live()
    link.messages = [heard(polls(1000, 1)[:1]), Tick(0, 1050 * MS)]
    (output,) = [item for item in bus.poll() if isinstance(item, Output)]
    assert output.rows[0].event.octets == rtu(bytes((1, 3, 0, 0, 0, 1)))


def test_many_reads_come_as_a_table_and_row_by_row_for_whoever_wants_them_so() -> None:
    for poll in ("poll_tables", "poll"):
        bus, link = live()
        link.messages = [heard(polls(1000, 400)), Tick(0, 9000 * MS), Ended("over")]
        items = getattr(bus, poll)()
        assert any(isinstance(item, Table) for item in items) == (poll == "poll_tables")
        rows = [row for item in items if isinstance(item, Table) for row in item.rows()]
        rows += [row for item in items if isinstance(item, Output) for row in item.rows]
        assert sorted(row.no for row in rows) == list(range(1, 801))
        assert bus.model.summary.frames == 800


def test_without_a_face_reads_are_gathered_but_never_over_half_a_second() -> None:
    bus, link = live(watched=False)
    link.messages = [heard(polls(1000, 25)), Tick(0, 1100 * MS)]
    assert bus.poll_tables() == []
    link.messages = [heard(polls(1100, 5)), Tick(0, 1400 * MS)]
    assert bus.poll_tables() == []
    link.messages = [Tick(0, 1500 * MS)]
    assert bus.poll_tables()
    assert bus.model.summary.frames == 60


def test_a_line_event_stands_where_it_happened() -> None:
    bus, link = live(watched=False)
    event = LineEvent(1100 * MS, LineEventKind.NOTE, "here")
    link.messages = [heard(polls(1000, 25)), ReceivedMessage(0, event), heard(polls(1200, 25)), Ended("over")]
    items = bus.poll_tables()
    assert items.index(event) not in (0, len(items) - 1)
    assert bus.model.summary.frames == 100


def test_what_was_heard_in_a_second_is_counted_in_it() -> None:
    bus, link = live(paths=("x.mcap",), watched=False)
    link.messages = [Tick(0, 1000 * MS), heard(polls(1010, 200)), Tick(0, 1900 * MS), Tick(0, 2000 * MS)]
    bus.poll_tables()
    (told,) = [told for told in link.told if told.topic == "/bus/bus0"]
    assert json.loads(told.data)["frames"] == 400


def test_a_read_with_line_errors_keeps_its_place() -> None:
    bus, link = live()
    before, *after = polls(1000, 20)
    marked = Chunk(after[0].time, after[0].octets, (Mark(1, LineError.PARITY),))
    link.messages = [heard([before]), ReceivedMessage(0, marked), heard(after[1:]), Tick(0, 1200 * MS)]
    rows = [row for item in bus.poll() if isinstance(item, Output) for row in item.rows]
    assert [bool(row.event.marks) for row in rows[:3]] == [False, True, False]


def test_values_that_have_no_turn_are_not_worked_out_and_the_others_are_the_same() -> None:
    table = next(one for one in tables([Block(reads_of(polls(1000, 800)))], SESSION) if isinstance(one, Table))
    by_rows, by_table = (RecordedValues("bus0", registry.get("modbus-rtu"), Devices()) for _ in range(2))
    for values in (by_rows, by_table):
        values._budget._left = values._budget._burst / 2 + 20  # soon each point gets its turn only
    expected = [one for output in table.outputs() for one in by_rows.of_rows(output)]
    assert list(by_table.of_rows(table)) == expected
    assert 16 <= len(expected) < 100
