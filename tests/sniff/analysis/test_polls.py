"""The master's programme: what it says of a bus, and that tables, rows and parts of a capture say the same."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from functools import cache, lru_cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from dissectors.profiles import Devices
from dissectors.profiles.packaged import parse_text
from dissectors.questions import Question, Span
from sniff.analysis.poll import MOST_SLICES, Poll, Slices
from sniff.analysis.poll_words import ChangeKind, asked, changes, told
from sniff.analysis.polls import Polls
from sniff.bus.offline import outputs
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent, LineEventKind, Session
from sniff.engine.table import Table
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"
NAMES = sorted(path.name for path in CAPTURES.glob("*.cap.txt"))
WITHOUT_POLLS = {"profibus-looks-for-its-slave.cap.txt", "rtu-frames-of-a-network.cap.txt"}
"""No station of these is asked again and again."""
LINE = LineSettings.parse("19200,8E1")
BEGIN, MS, SECOND = 1_772_359_200_000_000_000, 1_000_000, 1_000_000_000


def read_pdu(station: int, first: int, count: int) -> bytes:
    return struct.pack(">BBHH", station, 3, first, count)


def bus(
    questions: list[tuple[int, bytes, bytes | None]], session: Session | None = None
) -> tuple[Session, list[Chunk]]:
    """Reads of a bus: time in ms, request and answer without check."""
    chunks = []
    for when, request, answer in sorted(questions, key=lambda one: one[0]):
        time = BEGIN + when * MS
        for pdu in (request, answer):
            if pdu is not None:
                octets = seal_rtu(pdu)
                time += len(octets) * LINE.char + 5 * MS
                chunks.append(Chunk(time, octets))
    return session or Session("bus", LINE, "modbus-rtu", BEGIN), chunks


def answer(pdu: bytes, value: int = 0) -> bytes:
    count = pdu[5]
    return struct.pack(f">BBB{count}H", pdu[0], 3, 2 * count, *[value] * count)


def programme(session: Session, chunks: list[Chunk]) -> Polls:
    polls = Polls(dissector_for(session))
    for item in tables(blocks_of(iter(chunks)), session):
        assert isinstance(item, Table)
        polls.add_table(item)
    return polls


def every(period: int, begin: int, end: int, pdu: bytes, phase: int = 0) -> Iterator[tuple[int, bytes, bytes]]:
    return ((when + phase, pdu, answer(pdu, when & 0xFFFF)) for when in range(begin, end, period))


def test_each_request_with_interval_and_answers() -> None:
    fast, slow = read_pdu(1, 0, 2), read_pdu(2, 100, 1)
    polls = programme(*bus([*every(1000, 0, 60_000, fast), *every(5000, 0, 60_000, slow, 300)]))
    one, other = polls
    assert one.key.question == Question((Span("holding", 0, 2),))
    assert (one.key.station, one.asked, one.answered, one.repeats) == (1, 60, 60, 0)
    assert one.interval is not None
    assert abs(one.interval - SECOND) < 3 * MS
    assert one.jitter is not None
    assert one.jitter < 3 * MS
    assert (other.key.station, other.asked) == (2, 12)
    assert asked(other, Devices()) == "holding/40101"


def test_what_is_written_does_not_make_another_request() -> None:
    writes = [(when, struct.pack(">BBHH", 1, 6, 7, when % 97), None) for when in range(0, 30_000, 1000)]
    many = [
        (when + 500, struct.pack(">BBHHBHH", 1, 16, 9, 2, 4, when % 89, when % 83), None)
        for when in range(0, 30_000, 1000)
    ]
    polls = list(programme(*bus([*writes, *many])))
    assert [poll.key.question.spans for poll in polls] == [
        (Span("holding", 7, 1, writes=True),),
        (Span("holding", 9, 2, writes=True),),
    ]
    assert [poll.asked + poll.repeats for poll in polls] == [30, 30]


def test_names_of_a_profile() -> None:
    pump = parse_text(
        'name = "pump"\ntitle = "A pump"\nprotocols = ["modbus-rtu"]\n'
        + "".join(f'[[modbus.register]]\naddress = {at}\nname = "value-{at}"\n' for at in range(5)),
        "pump",
    )
    (poll,) = programme(*bus(list(every(1000, 0, 9000, read_pdu(1, 0, 5)))))
    assert asked(poll, Devices({1: pump})) == "value-0, value-1, value-2… (holding/40001 ×5)"
    assert asked(poll, Devices({2: pump})) == "holding/40001 ×5"


def test_when_it_began_ended_and_changed() -> None:
    always, pdu, late = read_pdu(1, 0, 1), read_pdu(2, 0, 1), read_pdu(3, 0, 1)
    questions = [
        *every(2000, 0, 1_200_000, always),
        *every(1000, 0, 400_000, pdu, 300),
        *every(5000, 400_000, 1_200_000, pdu, 300),
        *every(1000, 300_000, 600_000, late, 600),
    ]
    polls = {poll.key.station: poll for poll in programme(*bus(questions))}
    end = BEGIN + 1_200 * SECOND
    assert changes(polls[1], BEGIN, end) == []
    (change,) = changes(polls[2], BEGIN, end)
    assert (change.what, change.interval is not None) == (ChangeKind.CHANGED, True)
    assert abs(change.time - BEGIN - 400 * SECOND) <= 2 * change.within
    assert change.interval is not None
    assert abs(change.interval - 5 * SECOND) < SECOND // 2
    began, ended = changes(polls[3], BEGIN, end)
    assert (began.what, ended.what) == (ChangeKind.BEGAN, ChangeKind.ENDED)
    assert told([began], lambda time: f"{(time - BEGIN) // SECOND} s") == "began 300 s"


def test_a_pause_is_one_and_no_slower_rate() -> None:
    pdu = read_pdu(1, 0, 1)
    (poll,) = programme(*bus([*every(100, 0, 300_000, pdu), *every(100, 900_050, 1_200_000, pdu)]))
    paused, again = changes(poll, BEGIN, BEGIN + 1_200 * SECOND)
    assert (paused.what, again.what) == (ChangeKind.PAUSED, ChangeKind.CHANGED)
    assert again.interval is not None
    assert abs(again.interval - SECOND // 10) < SECOND // 500


@pytest.mark.parametrize("columns", [False, True])
def test_what_nobody_heard_is_no_pause_and_no_interval(columns: bool) -> None:
    pdu, seldom = read_pdu(1, 0, 1), read_pdu(2, 0, 1)
    session, chunks = bus(
        [
            *every(100, 0, 300_000, pdu),
            *every(100, 900_050, 1_200_000, pdu),
            *every(20_000, 940_020, 1_200_000, seldom),
        ]
    )
    at = next(place for place, chunk in enumerate(chunks) if chunk.time > BEGIN + 900 * SECOND)
    items = [*chunks[:at], LineEvent(chunks[at].time, LineEventKind.OMITTED, "no trigger fired", 9), *chunks[at:]]
    polls = Polls(dissector_for(session))
    for item in tables(blocks_of(items), session) if columns else ():
        polls.add_line_event(item) if isinstance(item, LineEvent) else polls.add_table(item)
    observe(() if columns else outputs(items, session), polls)
    one, other = sorted(polls, key=lambda poll: poll.key.station or 0)
    assert one.every.most is not None
    assert one.every.most < SECOND
    end = BEGIN + 1_200 * SECOND
    assert changes(one, BEGIN, end, polls.holes) == []
    (began,) = changes(other, BEGIN, end, polls.holes)  # or in the hole, but seldom
    assert (began.what, began.time - began.within) == (ChangeKind.BEGAN, polls.holes.begins[0])


def test_what_comes_in_bursts_is_no_change() -> None:
    pdu = read_pdu(1, 0, 1)
    bursts = [one for begin in range(0, 600_000, 30_000) for one in every(500, begin, begin + 5000, pdu)]
    (poll,) = programme(*bus(bursts))
    assert changes(poll, BEGIN, BEGIN + 600 * SECOND) == []


def test_a_silent_station_has_its_requests_all_the_same() -> None:
    (poll,) = programme(*bus([(when, read_pdu(4, 0, 1), None) for when in range(0, 20_000, 1000)]))
    assert (poll.asked + poll.repeats, poll.answered) == (20, 0)
    assert poll.unanswered >= 19  # after the last one the capture ends
    assert poll.interval is not None
    assert abs(poll.interval - SECOND) < 3 * MS


# --- rows, tables and parts ---


@cache
def _capture(name: str) -> tuple[Session, tuple[Output | LineEvent, ...], tuple[Table | LineEvent, ...]]:
    capture = read(CAPTURES / name)
    rows: list[Output | LineEvent] = []
    for item in outputs(capture.items(), capture.session):
        if isinstance(item, LineEvent):
            rows.append(item)
            continue
        rows += [Output((row,)) for row in item.rows]
        rows += [Output((), (transaction,)) for transaction in item.transactions]
    return capture.session, tuple(rows), tuple(tables(read(CAPTURES / name).blocks(), capture.session))


def _by_rows(session: Session, rows: tuple[Output | LineEvent, ...]) -> Polls:
    polls = Polls(dissector_for(session))
    observe(rows, polls)
    return polls


@lru_cache(1)  # of a name, all examples are of the same
def _of_whole(name: str) -> Polls:
    session, rows, _ = _capture(name)
    return _by_rows(session, rows)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=5, deadline=None)
@given(st.data())
def test_tables_say_the_same_wherever_they_are_cut(name: str, data: st.DataObject) -> None:
    session, _, whole = _capture(name)
    polls = Polls(dissector_for(session))
    for table in whole:
        if isinstance(table, LineEvent):
            polls.add_line_event(table)
            continue
        cuts = sorted(data.draw(st.lists(st.integers(0, len(table)), max_size=4)))
        for begin, end in zip([0, *cuts], [*cuts, len(table)], strict=True):
            polls.add_table(table.part(begin, end))
    expected = _of_whole(name)
    assert polls.polls == expected.polls
    assert [poll.key for poll in polls] == [poll.key for poll in expected]
    assert (len(expected) > 0) is (name not in WITHOUT_POLLS)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=5, deadline=None)
@given(st.data())
def test_parts_merge_wherever_a_capture_is_cut(name: str, data: st.DataObject) -> None:
    session, rows, _ = _capture(name)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(rows)), max_size=3)))
    merged = Polls(dissector_for(session))
    for begin, end in zip([0, *cuts], [*cuts, len(rows)], strict=True):
        merged = merged.merge(_by_rows(session, rows[begin:end]))
    assert merged.polls == _of_whole(name).polls


@given(st.lists(st.integers(-(1 << 40), 1 << 62), max_size=40), st.integers(0, 40))
def test_slices_are_the_same_however_they_are_put_together(times: list[int], cut: int) -> None:
    whole, one, other = Slices(), Slices(), Slices()
    for time in times:
        whole.add(time)
    for part, held in ((one, times[:cut]), (other, times[cut:])):
        for time in held:
            part.add(time)
    merged = one.merge(other)
    assert (merged.width, merged.counts) == (whole.width, whole.counts)
    assert sum(whole.counts.values()) == len(times)
    assert len(whole.counts) <= MOST_SLICES


def test_a_poll_of_nothing_says_nothing() -> None:
    (poll,) = programme(*bus(list(every(1000, 0, 1000, read_pdu(1, 0, 1)))))
    assert (poll.interval, poll.jitter) == (None, None)
    assert changes(Poll(poll.key), 0, 1) == []
