"""Messages of /frames: what was encoded comes back, and damage gives nothing, or a table that can be read."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.frame import (
    Assembly,
    Check,
    Damage,
    Flaw,
    FoundBy,
    Frame,
    Header,
    LineError,
    Mark,
    Noise,
    Place,
    Reason,
    Repair,
    Role,
)
from dissectors.line import LineSettings
from dissectors.tracker import Interval, Placement, Transaction, Verdict
from sniff.engine.bulk import tables
from sniff.engine.engine import Row
from sniff.engine.table import Table
from sniff.formats import read
from sniff.recording.frames import StoredTable, encode
from tests.seeds import examples

CAPTURES = Path(__file__).parents[3] / "captures"

TIME = st.integers(-(1 << 62) + 1, (1 << 62) - 1)
OCTETS = st.binary(max_size=20)
MARKS = st.lists(st.builds(Mark, st.integers(0, 2**32 - 1), st.integers(1, 15).map(LineError)), max_size=2).map(tuple)
WORD = st.text("abc-Ä\0 ", min_size=1, max_size=5)
ADDRESS = st.none() | st.integers(0, 255)
MAYBE = st.none() | st.integers(0, 2**31 - 1)
SMALL = st.integers(0, 2**31 - 1)
NUMBERS = st.lists(SMALL, max_size=3).map(tuple)

FRAME = st.builds(
    Frame,
    st.just("n2"),
    st.binary(min_size=1, max_size=20),
    TIME,
    TIME,
    st.sampled_from(Check),
    st.sampled_from(FoundBy),
    st.none() | st.sampled_from(Damage),
    MAYBE,
    st.just(0) | SMALL,
    TIME,
    st.just(()) | MARKS,
    st.just(()) | st.lists(WORD, max_size=2).map(tuple),
    st.none() | st.builds(Repair, st.sampled_from(Flaw), OCTETS),
    st.none() | st.builds(Assembly, OCTETS, NUMBERS, NUMBERS),
)
NOISE = st.builds(Noise, OCTETS, TIME, TIME, st.sampled_from(Place), st.sampled_from(Reason), MARKS)
HEADER = st.builds(
    Header,
    st.just("n2"),
    ADDRESS,
    ADDRESS,
    st.sampled_from(Role),
    WORD,
    ADDRESS,
    st.none() | st.integers(0, 2**40),  # a plug-in may give anything
    MAYBE,
    st.booleans(),
    st.none() | WORD,
)


@st.composite
def whole_tables(draw: st.DrawFn) -> Table:
    first = draw(st.integers(1, 2**40))
    rows: list[Row] = []
    for number, event in enumerate(draw(st.lists(FRAME | NOISE, max_size=8)), first):
        if isinstance(event, Noise):
            rows.append(Row(number, event))
            continue
        placed = None
        if draw(st.booleans()):
            roles = st.sampled_from(Role)
            placed = Placement(number, draw(st.integers(1, first)), draw(roles), draw(ADDRESS), draw(ADDRESS))
        rows.append(Row(number, event, draw(HEADER), placed))
    last = first + len(rows) - 1
    of_row = st.none() | st.integers(0, last)
    latency = st.none() | st.builds(Interval, st.integers(0, 2**61), st.integers(0, 2**61), st.integers(0, 2**61))
    closed = st.builds(
        Transaction,
        st.integers(1, first),
        ADDRESS,
        WORD,
        of_row,
        of_row,
        st.sampled_from(Verdict),
        TIME,
        TIME,
        latency,
        st.integers(1, 2**31 - 1),
        st.none() | st.integers(1, first),
        st.none() | WORD,
    )
    closing = draw(st.lists(closed, max_size=4))
    by = sorted(draw(st.integers(0 if rows else -1, len(rows) - 1)) for _ in closing)
    return Table.of("n2", first, rows, closing, by)


def same(one: Table, other: Table) -> bool:
    return list(one.outputs()) == list(other.outputs())


@given(whole_tables(), st.integers(0, 2**40))
@settings(deadline=None, max_examples=examples(100))
def test_what_was_encoded_comes_back(table: Table, events: int) -> None:
    stored = StoredTable.decode(encode(table, events))
    assert stored is not None
    assert (stored.first, stored.rows, stored.closed) == (table.first, len(table), len(table.transactions))
    assert (stored.octets, stored.events) == (len(table.octets), events)
    found = stored.table("n2", table.octets)
    assert found is not None
    assert same(found, table)


@given(whole_tables().filter(lambda table: len(table.octets) > 0), st.data())
@settings(deadline=None, max_examples=examples(50))
def test_other_octets_are_not_taken(table: Table, data: st.DataObject) -> None:
    stored = StoredTable.decode(encode(table, 0))
    assert stored is not None
    octets = table.octets.copy()
    octets[data.draw(st.integers(0, len(octets) - 1))] ^= data.draw(st.integers(1, 255))
    assert stored.table("n2", octets) is None
    assert stored.table("n2", table.octets[1:]) is None


@cache
def encoded() -> tuple[tuple[bytes, Table], ...]:
    """Tables of a noisy capture of each protocol, one a message."""
    made: list[tuple[bytes, Table]] = []
    for path in CAPTURES.glob("*-usual-faults.cap.txt"):
        capture = read(path)
        for table in tables(capture.blocks(), capture.session):
            if isinstance(table, Table) and len(table):
                made.append((encode(table, 0), table))
    return tuple(made)


def test_there_is_something_to_damage() -> None:
    assert len({table.protocol for _, table in encoded()}) == 5
    assert sum(len(table.odd) for _, table in encoded()) > 20


def damaged(data: st.DataObject) -> tuple[bytes, Table]:
    octets, table = data.draw(st.sampled_from(encoded()))
    changed = bytearray(octets)
    size = int.from_bytes(octets[:4], "little")
    for _ in range(data.draw(st.integers(1, 4))):
        where = st.integers(0, 3 + size) | st.integers(0, len(octets) - 1)  # the description, or anywhere
        changed[data.draw(where)] = data.draw(st.integers(0, 255) | st.sampled_from(b'0159-"[],'))
    cut = data.draw(st.just(len(octets)) | st.integers(0, len(octets)))
    return bytes(changed[:cut]), table


@given(st.data())
@settings(deadline=None, max_examples=examples(300))
def test_damage_never_crashes(data: st.DataObject) -> None:
    octets, table = damaged(data)
    stored = StoredTable.decode(octets)
    found = None if stored is None else stored.table(table.protocol, table.octets)
    if found is not None:
        for output in found.outputs():
            assert all(isinstance(row.no, int) for row in output.rows)
        assert b"".join(row.event.octets for row in found.rows()) == table.octets.tobytes()


@pytest.mark.parametrize("row", [Row(1, Noise(b"ab", 1, 2, Place.AFTER, Reason.PAD), searched=LineSettings())])
def test_what_a_search_heard_is_not_kept(row: Row) -> None:
    with pytest.raises(ValueError, match="searched"):
        encode(Table.of("n2", 1, [row], []), 0)


def test_times_of_a_damaged_file_are_not_kept() -> None:
    row = Row(1, Noise(b"ab", -(1 << 63), 1 << 62, Place.AFTER, Reason.PAD))
    with pytest.raises(ValueError, match="not kept"):
        encode(Table.of("n2", 1, [row], []), 0)


def described(table: Table) -> dict[str, Any]:
    octets = encode(table, 0)
    told: dict[str, Any] = json.loads(octets[4 : 4 + int.from_bytes(octets[:4], "little")])
    return told


def message(told: object, columns: bytes = b"") -> bytes:
    head = json.dumps(told).encode()
    return len(head).to_bytes(4, "little") + head + columns


@pytest.mark.parametrize("columns", [None, [], "frames.end", {"frames.end": []}, {"frames.end": None}])
def test_columns_that_are_none(columns: object) -> None:
    told = described(Table.of("n2", 1, [], []))
    assert StoredTable.decode(message(told)) is not None
    assert StoredTable.decode(message({**told, "columns": columns})) is None


@pytest.mark.parametrize("width", [0, 1, 8, 3])
def test_steps_of_nothing(width: int) -> None:
    told = described(Table.of("n2", 1, [], []))
    told["columns"]["frames.end"] = [0, width, 5, -1, None]
    stored = StoredTable.decode(message(told, bytes(8)))
    assert stored is None or stored.table("n2", np.zeros(0, np.uint8)) is None


@pytest.mark.parametrize("is_frame", [0, 1])
def test_few_octets_make_no_million_rows(is_frame: int) -> None:
    told = described(Table.of("n2", 1, [], []))
    told["columns"]["is_frame"][0] = is_frame
    stored = StoredTable.decode(message({**told, "rows": 100_000}))
    assert stored is None or stored.table("n2", np.zeros(0, np.uint8)) is None
    assert StoredTable.decode(message({**told, "closed": 100_000})) is None


def test_a_row_told_by_itself_is_that_of_its_columns() -> None:
    row = Row(1, Noise(b"ab", 5, 9, Place.AFTER, Reason.PAD))
    octets = np.frombuffer(b"ab", np.uint8)
    told, columns = described(Table.of("n2", 1, [row], [])), encode(Table.of("n2", 1, [row], []), 0)
    rest = columns[4 + int.from_bytes(columns[:4], "little") :]
    for place, value in ((1, 6), (2, 10)):
        odd = [[0, list(told["odd"][0][1])]]
        odd[0][1][place] = value
        stored = StoredTable.decode(message({**told, "odd": odd}, rest))
        assert stored is not None
        assert stored.table("n2", octets) is None
