"""The store holds what a list of the reference's rows holds, however the tables are cut that it takes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.histogram import Histogram
from dissectors.line import LineSettings
from dissectors.tracker import Transaction
from sniff.analysis.wording import is_error
from sniff.bus import kept_tables
from sniff.bus.ascending import Ascending
from sniff.bus.model import BusModel
from sniff.bus.offline import outputs
from sniff.bus.prepared import prepare
from sniff.bus.row_masks import ACCEPTED, DOUBTFUL, RowMasks
from sniff.bus.rows import Store
from sniff.bus.trouble import BAD_VERDICTS, closings_in_trouble, is_trouble
from sniff.engine.blocks import Block, in_pieces
from sniff.engine.bulk import tables
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.packed_table import PackedTable, packed
from sniff.engine.session import LineEvent, LineEventKind, Session
from sniff.engine.table import Table, joined
from sniff.filter import compile_filter
from tests.bench import bulk_mstp, bulk_rtu
from tests.seeds import IS_SEARCH

NAMES = ("mstp", "modbus-rtu")
FILTERS = (
    "dst == 3",
    "addr in {1, 7} && role != token",
    'kind contains "read"',
    'verdict == "no answer" || latency_ms > 20',
    "!ok && attempt >= 1 || noise",
    'text contains "present" && src < 9',
    "tx > 50 && tx <= 90",
    "error",
    "!(verdict == answered)",
    "func in {3, 16, 5}",
    "no >= 17 && no < 40.5",
    'hex contains "55ff05"',
    "damage == check or marks",
    "dst != 1 && latency_ms",
    "frame.octets[2] != 05 && count(addr) == 2",
    "frame.time_delta > 5ms && latency_ms * 2 < 0.03s",
)
PARTLY = {FILTERS[5], FILTERS[14]}
"""Those of which columns do not say all."""
CUTS = st.lists(st.integers(0, 10_000), max_size=40)
BUSES = settings(deadline=None, max_examples=12 if IS_SEARCH else 6)
JUDGED = settings(deadline=None, max_examples=6 if IS_SEARCH else 3)


@cache
def bus_of(name: str) -> tuple[Session, Block]:
    """A short damaged bus."""
    if name == "mstp":
        reads = bulk_mstp.reads(400, 3, damaged=0.04, answered=0.8)
        return Session("bus", bulk_mstp.LINE, "mstp"), Block(reads)
    table, length = bulk_rtu.frames(300)
    reads = bulk_rtu.bus(bulk_rtu.damaged(table, length, 0.04), length, bulk_rtu.TIMING)
    return Session("bus", LineSettings.parse("19200,8E1"), "modbus-rtu"), Block(reads)


@cache
def reference_of(name: str) -> tuple[list[Row], list[Transaction], list[Output]]:
    """All rows, and all transactions in the order of closing."""
    session, block = bus_of(name)
    made = [one for one in outputs(block.chunks(), session) if isinstance(one, Output)]
    return [row for one in made for row in one.rows], [tx for one in made for tx in one.transactions], made


@cache
def table_of(name: str) -> Table:
    """The whole bus."""
    session, block = bus_of(name)
    return joined(session.protocol, 1, [one for one in tables([block], session) if isinstance(one, Table)])


def pieces(table: Table, cuts: Sequence[int]) -> list[Table]:
    """The table, cut before these rows."""
    edges = sorted({0, len(table), *(at % (len(table) + 1) for at in cuts)})
    return [table.part(begin, end) for begin, end in pairwise(edges)]


def filled(name: str, cuts: Sequence[int], pack: int, keep: int = 10**6) -> Store:
    """A store that took the bus in pieces and judged none of it; those of `pack` rows and more packed."""
    session = bus_of(name)[0]
    store = Store(session, dissector_for(session), keep, judge_later=True)
    for piece in pieces(table_of(name), cuts):
        store.add_prepared(prepare(piece, pack=len(piece) >= pack))
    return store


@pytest.fixture(autouse=True)
def _small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables are joined and packed at sizes that short buses reach."""
    monkeypatch.setattr(kept_tables, "PACKED", 100)
    monkeypatch.setattr(kept_tables, "LOOSE", 4)


@pytest.mark.parametrize("name", NAMES)
@BUSES
@given(CUTS, st.integers(1, 200))
def test_rows_and_transactions_are_those_of_the_reference(name: str, cuts: list[int], pack: int) -> None:
    rows, closed, _ = reference_of(name)
    store = filled(name, cuts, pack)
    assert list(store.rows) == rows
    assert [store.closed_by_no(no + 1) for no in range(len(closed))] == closed
    assert store.closed_by_no(0) is store.closed_by_no(len(closed) + 1) is None
    by_id = {one.id: one for one in closed}
    for row in rows:
        assert store.transaction(row) == (by_id.get(row.placement.tx) if row.placement is not None else None)
    for number, one in enumerate(closed, 1):
        assert store.closed_number(one.id) == number


@pytest.mark.parametrize("name", NAMES)
@BUSES
@given(CUTS, st.integers(1, 200))
def test_errors_gaps_and_times_are_those_of_the_reference(name: str, cuts: list[int], pack: int) -> None:
    rows, closed, _ = reference_of(name)
    store = filled(name, cuts, pack)
    bad = {row.no for row in rows if is_error(row)}
    bad |= {one.request or one.response or 0 for one in closed if one.verdict in BAD_VERDICTS} - {0}
    assert list(store.errors) == sorted(bad)
    assert store.error_total == len(bad) == sum(store.failed.values())
    gaps = Histogram()
    for before, row in pairwise(rows):
        gaps.add(row.event.start - before.event.end)
    assert store.gaps == gaps
    for row in rows[::7]:
        first = next(one.no for one in rows if one.event.start >= row.event.start)
        assert store.row_at(row.event.start) == first
    assert store.row_at(rows[-1].event.start + 1) == len(rows) + 1


@pytest.mark.parametrize("name", NAMES)
@BUSES
@given(CUTS, st.integers(1, 200), st.integers(50, 1000), st.integers(0, 400))
def test_closings_in_trouble_are_found_both_ways(name: str, cuts: list[int], pack: int, keep: int, no: int) -> None:
    store = filled(name, cuts, pack, keep)
    kept = range(store.dropped_transactions + 1, store.last_closed + 1)
    bad = [one for one in kept if (held := store.closed_by_no(one)) is not None and is_trouble(held)]
    assert list(closings_in_trouble(store.kept, no, 1)) == [one for one in bad if one > no]
    assert list(closings_in_trouble(store.kept, no, -1)) == [one for one in reversed(bad) if one < no]


@pytest.mark.parametrize("name", NAMES)
@BUSES
@given(CUTS, st.integers(1, 200), st.sampled_from(FILTERS), st.integers(50, 1000))
def test_masks_accept_what_the_filter_accepts(name: str, cuts: list[int], pack: int, text: str, keep: int) -> None:
    rows, closed, _ = reference_of(name)
    store = filled(name, cuts, pack, keep)
    accepts = compile_filter(text, store.dissector)
    by_id = {one.id: one for one in closed}
    wanted = {row.no for row in rows if accepts(row, by_id.get(row.placement.tx) if row.placement else None)}
    wanted -= set(range(1, store.first_no))
    if not accepts.in_columns:
        return
    masks = RowMasks(store.kept, accepts)
    for no in range(store.first_no, store.last_no + 1):
        first, states = masks.rows(no)
        assert states[no - first] == DOUBTFUL or (states[no - first] == ACCEPTED) == (no in wanted)
        if text not in PARTLY and no - 1 not in table_of(name).odd:
            assert states[no - first] != DOUBTFUL
    for no in range(store.dropped_transactions + 1, store.last_closed + 1):
        first, states = masks.closings(no)
        one = closed[no - 1]
        assert states[no - first] == DOUBTFUL or (states[no - first] == ACCEPTED) == bool(
            wanted & {one.request, one.response}
        )


@pytest.mark.parametrize("name", NAMES)
@BUSES
@given(CUTS, st.integers(1, 200), st.integers(20, 300))
def test_what_is_dropped_is_the_oldest(name: str, cuts: list[int], pack: int, keep: int) -> None:
    rows, closed, _ = reference_of(name)
    store = filled(name, cuts, pack, keep)
    assert list(store.rows) == rows[store.first_no - 1 :]
    assert min(keep, len(rows)) <= len(store) <= keep * 1.1 + 1
    assert store.dropped_rows == store.first_no - 1
    kept = [no for no, one in enumerate(closed, 1) if max(one.request or 0, one.response or 0) >= store.first_no]
    assert store.dropped_transactions == min(kept) - 1
    for no, one in enumerate(closed, 1):
        assert store.closed_by_no(no) == (one if no > store.dropped_transactions else None)
    assert all(no >= store.first_no for no in store.errors)


@pytest.mark.parametrize("name", NAMES)
@JUDGED
@given(CUTS, st.lists(st.integers(1, 400), min_size=1, max_size=20), st.integers(0, 20))
def test_judged_later_is_judged_the_same(name: str, cuts: list[int], slices: list[int], event_after: int) -> None:
    session = bus_of(name)[0]
    store = Store(session, dissector_for(session), judge_later=True)
    model = BusModel(session, dissector_for(session))
    event = LineEvent(reference_of(name)[0][0].event.start, LineEventKind.ERRORS, "3 framing")
    for number, piece in enumerate(pieces(table_of(name), cuts)):
        store.add_table(piece)
        model.add_table(piece)
        if number == event_after:
            store.add_line_event(event)
            model.add_line_event(event)
    assert store.judged == 0
    assert store.findings() == ()  # not that nothing was heard
    assert store.load == model.summary.load
    turn = 0
    while store.judge(slices[turn % len(slices)]):
        turn += 1
        assert turn < 10_000
    assert store.all_judged
    assert store.judged == store.last_no
    assert store.findings() == model.findings()
    assert store.summary == store.model.summary == model.summary


@pytest.mark.parametrize("name", NAMES)
@JUDGED
@given(CUTS, st.integers(20, 300))
def test_what_is_dropped_was_judged_before(name: str, cuts: list[int], keep: int) -> None:
    session = bus_of(name)[0]
    model = BusModel(session, dissector_for(session))
    model.add_table(table_of(name))
    store = filled(name, cuts, 100, keep)
    while store.judge(50):
        pass
    assert store.findings() == model.findings()


@pytest.mark.parametrize("name", NAMES)
def test_a_table_of_outputs_says_which_row_closed_what(name: str) -> None:
    made = reference_of(name)[2]
    last, expected = 0, []
    for output in made:
        numbers = [row.no for row in output.rows]
        after = numbers[-1] if numbers else last
        by_rows = [numbers[place] for place in output.closed_by]
        by = by_rows + [after] * (len(output.transactions) - len(by_rows))
        expected += zip(by, output.transactions, strict=True)
        last = after
    said = [(one.rows[0].no, tx) for one in Table.of_outputs(name, 1, made).outputs() for tx in one.transactions]
    assert said == expected


@pytest.mark.parametrize("name", NAMES)
@BUSES
@given(st.integers(1, 50), st.integers(1, 300))
def test_blocks_in_pieces_give_the_same_rows(name: str, least: int, most: int) -> None:
    session, block = bus_of(name)
    rows = [
        row for one in tables(in_pieces([block], least, most), session) if isinstance(one, Table) for row in one.rows()
    ]
    assert rows == reference_of(name)[0]


@pytest.mark.parametrize("name", NAMES)
def test_a_packed_table_loses_nothing_and_is_small(name: str) -> None:
    table = table_of(name)
    small = PackedTable(table)
    again = small.table()
    assert list(again.outputs()) == list(table.outputs())
    assert small.memory < 64 * len(table)


VALUES = st.one_of(
    st.lists(st.integers(-(1 << 62), 1 << 62), max_size=30),
    st.lists(st.integers(-1, 300), max_size=30),
    st.lists(st.integers(10**18, 10**18 + 10**6), max_size=30).map(sorted),
)


@given(VALUES, st.sampled_from([None, -1, 0]))
def test_a_packed_column_is_the_column(values: list[int], none: int | None) -> None:
    column = np.array(values, np.int64)
    assert packed(column, none).values().tolist() == values
    assert packed(column, none).values().dtype == np.int64
    small = (column & 0x7F).astype(np.int16)
    assert packed(small).values().tolist() == small.tolist()


@given(st.lists(st.lists(st.integers(0, 60), max_size=8), max_size=12), st.integers(0, 60))
def test_ascending_is_a_sorted_set(added: list[list[int]], least: int) -> None:
    numbers = Ascending()
    known: set[int] = set()
    for some in added:
        new = numbers.add(np.array(some, np.int64))
        assert sorted(some[at] for at in new.tolist()) == sorted(set(some) - known)
        known |= set(some)
    numbers.drop_below(least)
    kept = sorted(number for number in known if number >= least)
    assert list(numbers) == kept
    assert len(numbers) == len(kept)
    for number in range(-1, 62):
        assert numbers.after(number) == next((one for one in kept if one > number), None)
        assert numbers.before(number) == next((one for one in reversed(kept) if one < number), None)
