"""Tables hold what the reference engine gives: every row, every transaction, of every capture, however it is cut."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from types import ModuleType

import pytest

from dissectors.bacnet import bulk_ring_observer
from dissectors.columns import Reads
from dissectors.line import Timing
from dissectors.tracker import Transaction
from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs, settled, settled_in_bulk
from sniff.devices import noted_devices
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.bulk import tables
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.engine.session import Adapter, Item, LineEvent, Session
from sniff.engine.table import Table
from sniff.engine.table_join import TableJoin
from sniff.filter import compile_filter
from sniff.filter.errors import FilterError
from sniff.formats import read
from tests.bench import bulk_ascii, bulk_mstp, bulk_n2, bulk_profibus, bulk_rtu
from tests.property.test_judging_tables import MIXED, by_tables, judged, same
from tests.seeds import IS_SEARCH, MOST_READS, in_turn, some

Bus = Callable[[float], tuple[Session, Reads]]

CAPTURES = Path(__file__).parents[2] / "captures"
SHARED = Path(__file__).parents[3] / "shared"
FOLDERS = (CAPTURES, SHARED / "captures", SHARED / "cases")
NAMES = sorted(
    path
    for path in chain.from_iterable(folder.rglob("*") for folder in FOLDERS if folder.exists())
    if path.suffix in {".txt", ".pcap", ".pcapng", ".mcap"} and not path.name.endswith(".expect.txt")
)


@dataclass(frozen=True)
class Given:
    """What both ways give of one capture, in order."""

    session: Session
    by_reference: list[Output | LineEvent]
    by_tables: list[Table | LineEvent]


@pytest.fixture(scope="module", params=in_turn(some(NAMES, 3), 0, 2), ids=lambda path: path.name)
def given(request: pytest.FixtureRequest) -> Given:
    """A capture, read once for all that is asked of it. As many others are read live (`test_live_tables.py`)."""
    try:
        capture = read(request.param)
        items = list(islice(capture.items(), MOST_READS))
    except CaptureError as error:
        pytest.skip(str(error))
    by_tables = list(tables(blocks_of(items), capture.session))
    return Given(capture.session, list(outputs(items, capture.session)), by_tables)


def test_what_is_counted_over_tables_is_what_is_counted_over_rows(given: Given) -> None:
    by_rows, by_tables = Summary(given.session.line), Summary(given.session.line)
    observe(given.by_reference, by_rows)
    for item in given.by_tables:
        if isinstance(item, Table):
            by_tables.add_table(item)
        else:
            by_tables.add_line_event(item)
    assert by_tables == by_rows


def test_a_capture_gives_the_same_rows_as_tables(given: Given) -> None:
    expected = [one for one in given.by_reference if isinstance(one, Output)]
    made = [one for one in given.by_tables if isinstance(one, Table)]
    rows: list[Row] = []
    for table in made:
        assert not len(table) or table.first == len(rows) + 1
        rows += table.rows()
    for row, other in zip(rows, (row for one in expected for row in one.rows), strict=True):
        assert row == other
    closed = [table.transaction(place) for table in made for place in range(len(table.transactions))]
    assert closed == [one for output in expected for one in output.transactions]
    by_outputs = Table.of_outputs(given.session.protocol, 1, expected)
    assert [by for table in made for by in _closers(table)] == list(_closers(by_outputs))
    events = [one for one in given.by_tables if isinstance(one, LineEvent)]
    assert events == [one for one in given.by_reference if isinstance(one, LineEvent)]


def test_a_capture_is_judged_from_tables_as_row_by_row(given: Given, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bulk_ring_observer, "RUN_LEAST", 1)  # else only long captures would try its columns
    reference = judged(given.session, noted_devices(given.session))
    observe(given.by_reference, reference)
    dice = random.Random(len(given.by_tables) + len(given.by_reference))
    for most in (1 << 30, 30) if IS_SEARCH else (MIXED,):
        same(by_tables(given.by_tables, judged(given.session, noted_devices(given.session)), dice, most), reference)


def _closers(table: Table) -> Iterator[int]:
    """The numbers of the rows that closed transactions, or after which they closed."""
    last = len(table) - 1
    yield from (table.first + (last if by < 0 else by) for by in table.closed_by.tolist())


def _mstp(damaged: float) -> tuple[Session, Reads]:
    return Session("x", bulk_mstp.LINE, "mstp"), bulk_mstp.reads(2000, damaged=damaged)


def _polled(
    damaged: float, protocol: str, made: ModuleType, timing: Timing, count: int = 2000
) -> tuple[Session, Reads]:
    """A bus on which stations are asked in turn."""
    table, length = made.frames(count)
    spoilt = bulk_rtu.damaged(table, length, damaged) if damaged else table
    session = Session("x", timing.line, protocol, adapter=Adapter(latency=timing.latency))
    return session, bulk_rtu.bus(spoilt, length, timing)


def _rtu(damaged: float, timing: Timing = bulk_rtu.TIMING) -> tuple[Session, Reads]:
    return _polled(damaged, "modbus-rtu", bulk_rtu, timing)


def _ascii(damaged: float, timing: Timing = bulk_ascii.TIMING) -> tuple[Session, Reads]:
    return _polled(damaged, "modbus-ascii", bulk_ascii, timing, 1500)


def _n2(damaged: float, timing: Timing = bulk_n2.TIMING) -> tuple[Session, Reads]:
    return _polled(damaged, "n2", bulk_n2, timing, 1500)


def _profibus(damaged: float, latency: int = 0) -> tuple[Session, Reads]:
    reads = bulk_profibus.reads(2000, damaged=damaged, answered=0.99)
    if latency:
        reads = replace(reads, times=-(-reads.times // latency) * latency)
    return Session("x", bulk_profibus.LINE, "profibus", adapter=Adapter(latency=latency)), reads


def _hidden(damaged: float) -> tuple[Session, Reads]:
    """An adapter that holds octets back and does not say so."""
    session, reads = _rtu(damaged, bulk_rtu.HELD_BACK)
    return replace(session, adapter=Adapter()), reads


@pytest.mark.parametrize("damaged", [0.0, 0.01])
@pytest.mark.parametrize(
    "bus",
    [
        _mstp,
        _rtu,
        partial(_rtu, timing=bulk_rtu.HELD_BACK),
        _hidden,
        _ascii,
        partial(_ascii, timing=bulk_ascii.HELD_BACK),
        _n2,
        partial(_n2, timing=bulk_n2.HELD_BACK),
        _profibus,
        partial(_profibus, latency=16_000_000),
    ],
)
def test_long_buses_give_the_same_rows_as_tables(bus: Bus, damaged: float) -> None:
    """With seams between blocks, and between columns and the reference."""
    session, reads = bus(damaged)
    begins, blocks = reads.begins, []
    for begin in range(0, len(reads), 700):
        end = min(begin + 700, len(reads))
        octets = reads.octets[begins[begin] : begins[end]]
        blocks.append(Block(Reads(octets, reads.times[begin:end], reads.lengths[begin:end], reads.marked[begin:end])))
    rows: list[Row] = []
    closed: list[Transaction] = []
    for table in tables(blocks, session):
        assert isinstance(table, Table)
        rows += table.rows()
        closed += [table.transaction(place) for place in range(len(table.transactions))]
    by_reference = list(outputs(chain.from_iterable(block.chunks() for block in blocks), session))
    expected = [row for output in by_reference if isinstance(output, Output) for row in output.rows]
    for row, other in zip(rows, expected, strict=True):
        assert row == other
    assert closed == [one for output in by_reference if isinstance(output, Output) for one in output.transactions]


FILTERS = (
    "",
    "dst == 3",
    "src in {1, 2, 5} || !ok",
    'kind contains "write" && func != 16',
    'addr >= 2 && !(role == "response")',
    'error matches "CRC|check" || noise',
    'verdict == "no answer" && dst > 0',
    "latency_ms > 5 || len < 9",
    "register == 1 && count",
    'found != "gap" and not damage',
    'proto == "mstp" || marks || "token"',
    "no in {1, 3, 5} || tx == 2",
    "dst in {1..2, 5} && frame.octets[1] == 03",
    "hex contains 00:00 || frame.time_delta > 2ms",
    "no % 3 == 1 && len + 1 > 8",
    "frame.time_relative > 10ms && addr != 2",
    "mstp.frame_type == Token || modbus.func_code == 3",
    "mstp.src == 1 && frame.len == 8",
)


OF_SOME = {text for text in FILTERS if any(part in text for part in ("mstp.", "func != 16", "&& count"))}
"""Filters that frames of other protocols refuse."""


def _filtered(session: Session, items: list[Item], parts: Iterable[Block | LineEvent]) -> None:
    """Every filter, over rows that the reference gave and over tables of the same."""
    everything = list(settled(items, session))
    made = [one for one in tables(parts, session) if isinstance(one, Table)]
    for text in FILTERS:
        try:
            wanted = compile_filter(text, dissector_for(session))
        except FilterError:  # a field, or a value of one, that these frames cannot have
            assert text in OF_SOME
            continue
        join = TableJoin(wanted)
        found = [one for table in made for one in join.add(table)] + list(join.flush())
        assert found == [one for one in everything if wanted(one.row, one.transaction)], text


@pytest.mark.parametrize(
    "path", sorted(CAPTURES.rglob("*.cap.txt"))[:: 6 if IS_SEARCH else 9], ids=lambda path: path.name
)
def test_a_filter_over_tables_accepts_what_it_accepts_row_by_row(path: Path) -> None:
    items = list(islice(read(path).items(), MOST_READS))
    _filtered(read(path).session, items, blocks_of(items))


@pytest.mark.parametrize("bus", [_mstp, _rtu])
def test_a_filter_over_long_buses_accepts_the_same(bus: Bus) -> None:
    session, whole = bus(0.01)
    part, octets = slice(0, 1000), whole.octets[: whole.begins[1000]]
    block = Block(Reads(octets, whole.times[part], whole.lengths[part], whole.marked[part]))
    _filtered(session, list(block.chunks()), [block])


def test_who_asks_for_a_filter_gets_its_rows() -> None:
    capture = read(CAPTURES / "rtu-usual-faults.cap.txt")
    wanted = compile_filter("!ok", dissector_for(capture.session))
    by_rows = list(settled(capture.items(), capture.session, None, wanted))
    assert by_rows
    assert list(settled_in_bulk(capture, capture.session, None, wanted)) == by_rows
