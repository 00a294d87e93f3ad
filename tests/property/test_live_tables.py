"""A live bus gives what its recording gives, in whatever batches it comes and whenever time passes."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.tracker import Transaction
from sniff.bus.offline import outputs
from sniff.engine.blocks import Block, Gathering
from sniff.engine.bulk import BulkEngine
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output, Row
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.engine.table import Table
from sniff.formats import read
from tests.bench import bulk_rtu
from tests.property.test_tables import NAMES, Bus, _hidden, _mstp, _n2, _rtu
from tests.seeds import IS_SEARCH, MOST_READS, in_turn, some

HUGE = 1 << 20
"""Octets of a file that takes too long in small batches."""

MIXED = 0
"""Batches of one read, of some and of many, in turn."""

LATE = 50_000_000
"""ns; what is vouched for may be older than what has come."""

Said = tuple[list[Row], list[Transaction]]


def by_reference(items: Iterator[Item], session: Session) -> Said:
    made = [output for output in outputs(items, session) if isinstance(output, Output)]
    return [row for one in made for row in one.rows], [one for output in made for one in output.transactions]


def live(items: list[Item], session: Session, dice: random.Random, most: int) -> Said:
    """The same in batches of up to so many reads; in between time passes, as much as can be vouched for."""
    engine, gathering = BulkEngine(session), Gathering()
    rows: list[Row] = []
    closed: list[Transaction] = []

    def keep(made: list[Output | Table]) -> None:
        for one in made:
            for output in one.outputs() if isinstance(one, Table) else (one,):
                rows.extend(output.rows)
                closed.extend(output.transactions)

    batch = _batch(dice, most)
    for at, item in enumerate(items):
        if isinstance(item, LineEvent):
            keep(engine.take_some(gathering.take()) if gathering.count else [])
            keep([engine.take(item)])
            continue
        gathering.add(item)
        if gathering.count < batch:
            continue
        keep(engine.take_some(gathering.take()))
        batch = _batch(dice, most)
        after = items[at + 1] if at + 1 < len(items) else None
        if not isinstance(after, Chunk):  # a silence that no octet ends is in no file
            continue
        until = after.time - len(after.octets) * session.line.char + session.adapter.latency
        if until > item.time:
            for now in sorted(dice.randint(item.time - LATE, until - 1) for _ in range(dice.randint(0, 2))):
                keep(engine.advance(now))
    keep(engine.take_some(gathering.take()) if gathering.count else [])
    keep([engine.close()])
    return rows, closed


def _batch(dice: random.Random, most: int) -> int:
    return dice.choice((1, 1, dice.randint(1, 40), dice.randint(1, 3000))) if most == MIXED else dice.randint(1, most)


@pytest.mark.parametrize(
    "path",
    in_turn(some(NAMES, 3), 1, 2),  # `test_tables.py` reads the others
    ids=lambda path: path.name,
)
def test_a_capture_gives_the_same_live(path: Path) -> None:
    if path.stat().st_size > HUGE:
        pytest.skip("too long in small batches")
    try:
        capture = read(path)
        items = [item for item in islice(capture.items(), MOST_READS) if isinstance(item, LineEvent) or item.octets]
    except CaptureError as error:
        pytest.skip(str(error))
    expected = by_reference(iter(items), capture.session)
    dice = random.Random(1)
    for most in (1, 40, 3000) if IS_SEARCH else (MIXED,):
        _assert_same(live(items, capture.session, dice, most), expected)


def _assert_same(said: Said, expected: Said) -> None:
    for row, other in zip(said[0], expected[0], strict=True):
        assert row == other
    assert said[1] == expected[1]


@pytest.mark.parametrize("damaged", [0.0, 0.02])
@pytest.mark.parametrize("bus", [_mstp, _rtu, partial(_rtu, timing=bulk_rtu.HELD_BACK), _hidden])
def test_long_buses_give_the_same_live(bus: Bus, damaged: float) -> None:
    """Columns in most batches, seams and times anywhere."""
    session, reads = bus(damaged)
    items: list[Item] = list(Block(reads).chunks())
    expected = by_reference(iter(items), session)
    for seed, most in ((1, 150), (2, 500)) if IS_SEARCH else ((1, 250),):
        _assert_same(live(items, session, random.Random(seed), most), expected)


@pytest.mark.parametrize("bus", [_mstp, _rtu, _hidden, _n2])
def test_what_a_search_still_held_is_in_the_rows_after_it(bus: Bus) -> None:
    """Settings are found in the middle of a frame: what goes on by columns has octets that came before."""
    session, reads = bus(0.0)
    given = [Chunk(chunk.time, chunk.octets) for chunk in islice(Block(reads).chunks(), 600)]
    begin = LineEvent(given[0].time, LineEventKind.SETTINGS, str(SettingsChange(line=session.line, searching=True)))
    found = str(SettingsChange(line=session.line, protocol=session.protocol, found=True))
    for at in (3, 10, 40):
        whole = given[at]
        torn = Chunk(whole.time, whole.octets[:3]), Chunk(whole.time, whole.octets[3:])
        over = LineEvent(whole.time, LineEventKind.SETTINGS, found)
        items: list[Item] = [begin, *given[:at], torn[0], over, *filter(_holds, torn[1:]), *given[at + 1 :]]
        expected = by_reference(iter(items), session)
        _assert_same(live(items, session, random.Random(at), 300), expected)


def _holds(chunk: Chunk) -> bool:
    return bool(chunk.octets)
