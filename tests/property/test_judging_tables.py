"""A bus is judged from tables as it is row by row, wherever the tables are cut."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from dissectors.bacnet import bulk_ring_observer
from dissectors.bacnet.envelope import npdu_frame
from dissectors.columns import Reads
from dissectors.findings import Severity
from dissectors.frame import Chunk
from dissectors.line import Timing
from dissectors.profiles import Devices
from dissectors.token_ring import WatchesColumns
from sniff.analysis.judging import Judging
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Adapter, LineEvent, LineEventKind, Session
from sniff.engine.table import Table
from tests.bench import bulk_mstp, bulk_rtu
from tests.dissectors.bacnet.ring_script import Step, data, rounds, token
from tests.property import mstp_buses
from tests.property.kernel_equality import reads_of
from tests.seeds import IS_SEARCH, seeds

Bus = Callable[[float], tuple[Session, Reads]]

MIXED = 0
"""Parts of some rows and parts of many, in turn."""


def cut(table: Table, dice: random.Random, most: int) -> Iterator[Table]:
    """A table in parts, of any size up to `most` rows."""
    begin = 0
    while begin < len(table):
        if most == MIXED:
            end = min(len(table), begin + dice.choice((1, 2, 3, dice.randint(1, 30), 30 + len(table) // 4)))
        else:
            end = min(len(table), begin + dice.choice((1, 2, 3, dice.randint(1, most), most)))
        yield table.part(begin, end)
        begin = end
    if not len(table):
        yield table


def judged(session: Session, devices: Devices | None = None) -> Judging:
    return Judging(session, dissector_for(session), devices)


def by_rows(items: list[Table | LineEvent], judging: Judging) -> Judging:
    for item in items:
        if isinstance(item, LineEvent):
            judging.add_line_event(item)
            continue
        for output in item.outputs():
            judging.add(output)
    return judging


def by_tables(items: list[Table | LineEvent], judging: Judging, dice: random.Random, most: int) -> Judging:
    for item in items:
        if isinstance(item, LineEvent):
            judging.add_line_event(item)
            continue
        for part in cut(item, dice, most):
            judging.add_table(part)
    return judging


def same(one: Judging, other: Judging) -> None:
    for found, expected in zip(one.findings(), other.findings(), strict=True):
        assert found == expected
    assert one.ring() == other.ring()


@pytest.fixture(autouse=True)
def short_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even the shortest stretch is taken by columns: else only long captures would try them."""
    monkeypatch.setattr(bulk_ring_observer, "RUN_LEAST", 1)


def _mstp(damaged: float, answered: float = 1.0, many: int = 2000) -> tuple[Session, Reads]:
    return Session("x", bulk_mstp.LINE, "mstp"), bulk_mstp.reads(many, damaged=damaged, answered=answered)


def _held_back(damaged: float) -> tuple[Session, Reads]:
    """An adapter that holds octets back for up to 16 ms: times say little."""
    session, reads = _mstp(damaged)
    times = -(-reads.times // 16_000_000) * 16_000_000
    return replace(session, adapter=Adapter(latency=16_000_000)), replace(reads, times=times)


def _unheard(damaged: float) -> tuple[Session, Reads]:
    """One frame in 60 is not in the capture, nor any of station 5."""
    session, reads = _mstp(damaged)
    heard = np.random.default_rng(5).random(len(reads)) >= 1 / 60
    sources = reads.octets[np.concatenate(([0], np.cumsum(reads.lengths)[:-1])) + 4]
    heard &= sources != 5
    octets = reads.octets[np.repeat(heard, reads.lengths)]
    kept = {"times": reads.times[heard], "lengths": reads.lengths[heard], "marked": reads.marked[heard]}
    return session, replace(reads, octets=octets, **kept)


def _unanswered(damaged: float) -> tuple[Session, Reads]:
    return _mstp(damaged, answered=0.9)


def _rtu(damaged: float, timing: Timing = bulk_rtu.TIMING) -> tuple[Session, Reads]:
    table, length = bulk_rtu.frames(2000)
    spoilt = bulk_rtu.damaged(table, length, damaged) if damaged else table
    session = Session("x", timing.line, "modbus-rtu", adapter=Adapter(latency=timing.latency))
    return session, bulk_rtu.bus(spoilt, length, timing)


@pytest.mark.parametrize("damaged", (0.0, 0.002, 0.03) if IS_SEARCH else (0.002, 0.03))
@pytest.mark.parametrize("bus", [_mstp, _held_back, _unanswered, _unheard, _rtu])
def test_a_long_bus_is_judged_from_tables_as_row_by_row(bus: Bus, damaged: float) -> None:
    session, reads = bus(damaged)
    items = list(tables([Block(reads)], session))
    expected = by_rows(items, judged(session))
    dice = random.Random(7)
    for most in (1 << 30, 40) if IS_SEARCH else (MIXED,):
        same(by_tables(items, judged(session), dice, most), expected)


@pytest.mark.parametrize("seed", seeds(12, 5))
def test_stations_that_do_anything_are_judged_from_tables_as_row_by_row(seed: int) -> None:
    session = Session("x", mstp_buses.LINE, "mstp")
    items = list(tables(blocks_of(iter(mstp_buses.conversation(random.Random(seed), 300))), session))
    expected = by_rows(items, judged(session))
    dice = random.Random(seed)
    for most in (1 << 30, 100, 10):
        same(by_tables(items, judged(session), dice, most), expected)


def chunks_of(steps: list[Step]) -> list[Chunk]:
    now, chunks = mstp_buses.START, []
    for silence, octets in steps:
        now += int(silence * 1_000_000) + len(octets) * bulk_mstp.TIMING.char
        chunks.append(Chunk(now, octets))
    return chunks


@pytest.mark.parametrize("names", [1, 8])
def test_what_was_asked_for_is_known_in_tables_as_row_by_row(names: int) -> None:
    """The request may be the last row of the table before its answer's."""
    steps = rounds(9, 2, 5, 9)
    for no in range(8):
        asked = bytes.fromhex(f"010402750{no % 2}0c0c000000041 9{0x1C + no % names:02x}".replace(" ", ""))
        refused = bytes.fromhex(f"0100500{no % 2}0c91029120")
        steps += [(2, npdu_frame(9, 2, asked, True)), (9, npdu_frame(2, 9, refused, False)), *rounds(4, 2, 5, 9)]
    session = Session("x", bulk_mstp.LINE, "mstp")
    items = list(tables([Block(reads_of(chunks_of(steps)))], session))
    expected = by_rows(items, judged(session))
    (found,) = (one for one in expected.findings() if one.code == "MS305")
    assert (found.severity is Severity.NOTE) == (names == 8)
    dice = random.Random(2)
    for most in (1 << 30, 1, 3, 20):
        same(by_tables(items, judged(session), dice, most), expected)


def test_a_token_that_was_not_heard_is_over_when_the_next_one_is() -> None:
    """5 passed one on unheard, and much later sends without any: that is its second token, and not what was before."""
    steps = [*rounds(20, 2, 5, 9), (2, token(2, 5)), (6, token(9, 2)), *rounds(20, 2, 5, 9)]
    for _ in range(2):
        steps += [(1.2, data(5, 255)), *rounds(20, 2, 5, 9)]
    session = Session("x", bulk_mstp.LINE, "mstp")
    items = list(tables([Block(reads_of(chunks_of(steps)))], session))
    expected = by_rows(items, judged(session))
    assert "MAC 5 sent twice" in str([one.seen for one in expected.findings()])
    same(by_tables(items, judged(session), random.Random(1), 1 << 30), expected)


def test_answers_that_nobody_can_take_are_found_in_tables_as_row_by_row() -> None:
    """The request may be the last row of the table before its answer's."""
    steps = rounds(9, 2, 5, 9)
    for no in range(8):
        asked, acked = (
            bytes.fromhex(f"010402750{no}0c0c000000041955"),
            bytes.fromhex(f"010020{no % 2 * no:02x}0c"),
        )
        steps += [(2, npdu_frame(9, 2, asked, True)), (9, npdu_frame(255 if no % 2 else 2, 9, acked, False))]
        steps += rounds(4, 2, 5, 9)
    session = Session("x", bulk_mstp.LINE, "mstp")
    items = list(tables([Block(reads_of(chunks_of(steps)))], session))
    expected = by_rows(items, judged(session))
    assert {"MS312", "MS313"} <= {one.code for one in expected.findings()}
    dice = random.Random(2)
    for most in (1 << 30, 1, 3, 20):
        same(by_tables(items, judged(session), dice, most), expected)


def test_routers_are_known_in_tables_as_row_by_row() -> None:
    """Who passes on what comes from a network, message by message, through one router or two."""
    dice, steps = random.Random(4), rounds(3, 2, 5, 9)
    for no in range(60):
        router, network, routed = dice.choice((2, 5)), dice.choice((7, 8, 9)), dice.random() < 0.5
        told = f"0128ffff0000{network:02x}01{no:02x}fe1008" if routed else f"010800{network:02x}01{no:02x}1008"
        router = 9 if network == 7 else router
        steps += [(2, data(router, 255, told if no % 20 else f"01801300{router:02x}01")), *rounds(1, 2, 5, 9)]
    session = Session("x", bulk_mstp.LINE, "mstp")
    items = list(tables([Block(reads_of(chunks_of(steps)))], session))
    expected = by_rows(items, judged(session))
    assert sorted(one.code for one in expected.findings() if one.code in ("MS310", "MS314")) == 2 * ["MS310"] + [
        "MS314"
    ]
    for most in (1 << 30, 1, 3, 20):
        same(by_tables(items, judged(session), dice, most), expected)


def test_who_answered_in_a_run_is_known_to_answer() -> None:
    """Who asked it goes on 200 ms later, sooner than it may give up: it had the answer, which was not heard."""
    asked, acked = bytes.fromhex("01040275000c0c000000041955"), bytes.fromhex("010020000c")
    asks, answers = (2, npdu_frame(9, 2, asked, True)), (9, npdu_frame(2, 9, acked, False))
    steps = rounds(12, 2, 5, 9)
    for _ in range(8):
        steps += [asks, answers, *rounds(4, 2, 5, 9)]
    steps += [asks, (200, token(2, 5)), *rounds(12, 2, 5, 9)[1:]]
    session = Session("x", bulk_mstp.LINE, "mstp")
    items = list(tables([Block(reads_of(chunks_of(steps)))], session))
    expected = by_rows(items, judged(session))
    assert "MS406" in {one.code for one in expected.findings()}
    same(by_tables(items, judged(session), random.Random(1), 1 << 30), expected)


def test_octets_lost_on_the_way_tear_the_same_transactions() -> None:
    """The same hole between the same rows, wherever tables are cut: it is pending over several of them."""
    session, reads = _mstp(0.01)
    (table, *_) = (one for one in tables([Block(reads)], session) if isinstance(one, Table) and len(one))
    head, tail = table.part(0, 1000), table.part(1000, len(table))
    late = int(tail.frames.end[700])  # octets that were on their way are lost too
    items = [head, LineEvent(late, LineEventKind.DROPPED, count=40), tail]
    expected = by_rows(items, judged(session))
    assert any(finding.code == "LN005" for finding in expected.findings())
    dice = random.Random(3)
    for most in (1 << 30, 300, 9):
        same(by_tables(items, judged(session), dice, most), expected)


@pytest.mark.parametrize("damaged", [0.0, 0.02])
def test_a_ring_is_the_same_from_tables_and_row_by_row(damaged: float) -> None:
    session, reads = _mstp(damaged)
    one, other = (dissector_for(session).ring.observer(session.timing) for _ in range(2))  # type: ignore[union-attr]
    assert isinstance(one, WatchesColumns)
    for table in tables([Block(reads)], session):
        assert isinstance(table, Table)
        one.take(table)
        for row in table.rows():
            other.see(row.no, row.event, row.header)
    assert one.ring() == other.ring()


def test_most_rows_of_a_clean_ring_never_become_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    made = 0
    row_of = Table.row

    def counted(table: Table, place: int) -> Row:
        nonlocal made
        made += 1
        return row_of(table, place)

    session, reads = _mstp(0.0, many=4000)
    parts = [one for one in tables([Block(reads)], session) if isinstance(one, Table)]
    monkeypatch.setattr(Table, "row", counted)
    by_tables(parts, judged(session), random.Random(1), 1 << 30)
    assert made < 0.1 * len(reads)
