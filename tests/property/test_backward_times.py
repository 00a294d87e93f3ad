"""Reads whose clock runs backwards, or far away, give the same rows as tables and one by one."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import pairwise

import pytest

from dissectors.frame import Chunk
from sniff.bus.offline import outputs
from sniff.engine import late_columns, late_reads
from sniff.engine.blocks import Block, reads_of
from sniff.engine.bulk import BulkEngine
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import SessionEngine
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.engine.table import Table
from tests.property.test_judging_tables import _mstp
from tests.property.test_tables import Bus, _hidden, _n2
from tests.seeds import seeds

AT_ONCE = 150
"""Reads of a block: as many as a kernel is worth its while for."""

STEPS = (-1_000, -40_000_000, -3_000_000_000, 5_000_000_000)


@pytest.mark.parametrize("seed", seeds(20))
@pytest.mark.parametrize("bus", [_mstp, _hidden, _n2])
def test_the_same_rows(bus: Bus, seed: int) -> None:
    dice = random.Random(seed)
    session, reads = bus(0.01)
    count = min(len(reads), 600)
    reads = Block(reads).cut(0, count).reads
    times = reads.times.copy()
    for _ in range(4):
        times[dice.randrange(count) :] += dice.choice(STEPS)
    for at in dice.sample(range(count), 3):
        times[at] -= dice.choice((1, 100_000, 1 << 62))
    whole = Block(replace(reads, times=times))
    hole = LineEvent(int(times[count // 2]), LineEventKind.DROPPED, count=3)
    items: list[Item] = [*whole.chunks(0, count // 2), hole, *whole.chunks(count // 2)]
    places = [*range(0, count // 2, AT_ONCE), count // 2, *range(count // 2 + AT_ONCE, count, AT_ONCE), count]
    engine, made = BulkEngine(session), []
    for begin, end in pairwise(places):
        if begin == count // 2:
            made.append(engine.take(hole))
        made.append(engine.take(whole.cut(begin, end)))
    made.append(engine.close())
    expected = [one for one in outputs(items, session) if isinstance(one, Output)]
    assert _rows(made) == [row for one in expected for row in one.rows]
    closed = [table.transaction(place) for table in made for place in range(len(table.transactions))]
    assert closed == [one for output in expected for one in output.transactions]


def test_reads_that_hold_more_than_can_have_come_give_the_same_rows() -> None:
    """A chain that ends within such a read: what stands behind it came since the read before, as all of it did."""
    session, reads = _mstp(0.0, many=300)
    octets = reads.octets[: len(reads.octets) // 668 * 668].reshape(-1, 668).tobytes()
    chunks = [Chunk(10**9, octets[at : at + 668]) for at in range(0, len(octets), 668)]
    engine, made = BulkEngine(session), []
    for begin in range(0, len(chunks), 3):
        made.append(engine.take(Block(reads_of(chunks[begin : begin + 3]))))
    made.append(engine.close())
    assert _rows(made) == [row for one in outputs(chunks, session) if isinstance(one, Output) for row in one.rows]


def test_columns_go_on_when_the_clock_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """One step back costs the block with it and the reads that a frame may still begin in, not the whole capture."""
    for module in (late_reads, late_columns):
        monkeypatch.setattr(module, "KEPT", 200)
    session, reads = _mstp(0.0, many=900)
    times = reads.times.copy()
    times[100] -= 1_000_000
    block, engine = Block(replace(reads, times=times)), BulkEngine(session)
    made = [engine.take(block.cut(begin, begin + AT_ONCE)) for begin in range(0, 450, AT_ONCE)]
    monkeypatch.setattr(SessionEngine, "take", None)
    made += [engine.take(block.cut(begin, begin + AT_ONCE)) for begin in range(450, 900, AT_ONCE)]
    assert sum(map(len, made)) > 890


def _rows(made: list[Table]) -> list[Row]:
    return [row for table in made for row in table.rows()]
