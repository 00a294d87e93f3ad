"""A view costs the same at a million rows as at a thousand: counted in rows looked at, not in time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dissectors.columns import CHECKS, FOUNDS, NONE, ROLES, FrameColumns, PlacementColumns
from dissectors.frame import Check, FoundBy, Role
from sniff.bus.rows import Store
from sniff.engine.engine import Row
from sniff.engine.row_packing import transaction_columns
from sniff.engine.table import Table
from tests.sniff.tui.conftest import TOY

MS = 1_000_000


def made_table(first: int, count: int) -> Table:
    """Rows `first` … of stations 0 to 199 in turn, one every 10 ms."""
    numbers = np.arange(first - 1, first - 1 + count)
    octets = np.tile(np.array([0, 3, 0, 7, 99], np.uint8), (count, 1))
    octets[:, 0] = numbers % 200
    nothing, none = np.zeros(count, np.uint8), np.full(count, NONE, np.int32)
    frames = FrameColumns(
        offset=np.arange(count) * 5,
        length=np.full(count, 5, np.int32),
        start=numbers * 10 * MS,
        end=numbers * 10 * MS + MS,
        check=np.full(count, CHECKS.index(Check.GOOD), np.uint8),
        found=np.full(count, FOUNDS.index(FoundBy.GAP), np.uint8),
        damage=nothing,
        expected=none,
        source=none.astype(np.int16),
        destination=octets[:, 0].astype(np.int16),
        role=np.full(count, ROLES.index(Role.REQUEST), np.uint8),
        kind=np.ones(count, np.uint16),
        function=none.astype(np.int16),
        address=none,
        count=none,
        ok=np.ones(count, bool),
        error=nothing.astype(np.uint16),
        names=("", "read"),
    )
    ends = none.astype(np.int16)
    placed = PlacementColumns(np.zeros(count, np.int64), nothing, ends, ends)
    closed = transaction_columns([])
    is_frame, slack = np.ones(count, bool), np.zeros(count, np.int64)
    return Table("toy", first, octets.ravel(), frames, slack, is_frame, placed, closed, slack[:0], {})


class Asked:
    """How many rows were made to be looked at."""

    def __init__(self) -> None:
        self.rows = 0


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    counted, real = Asked(), Table.row

    def row(table: Table, place: int) -> Row:
        counted.rows += 1
        return real(table, place)

    monkeypatch.setattr(Table, "row", row)
    return counted


@pytest.fixture
def store_of(make_bus: Any) -> Any:
    def make(count: int) -> Store:
        session = replace(make_bus().store.session, started=0)
        store = Store(session, TOY, 10**7, judge_later=True)
        for first in range(1, count + 1, 50_000):
            store.add_table(made_table(first, min(50_000, count + 1 - first)))
        return store

    return make


def cost(look: Any, store: Store, asked: Asked, size: tuple[int, int]) -> dict[str, tuple[int, int]]:
    """For each key: lines drawn, rows asked for."""
    costs = {}

    async def script(see: Any) -> None:
        for key in ("end", "up", "pageup", "home", "pagedown", "t"):
            before = see.drawn_lines, asked.rows
            await see.press(key)
            costs[key] = (see.drawn_lines - before[0], asked.rows - before[1])

    look(store, script, size)
    return costs


def test_a_million_rows_cost_what_a_thousand_cost(look: Any, store_of: Any, asked: Asked) -> None:
    size = (80, 24)
    for count in (1000, 1_000_000):
        for key, (lines, rows) in cost(look, store_of(count), asked, size).items():
            assert 1 <= lines <= 8 * 24, (count, key)
            assert rows <= 1500, (count, key)


def test_the_last_of_a_million_is_really_shown(look: Any, store_of: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("end")
        assert "1000000" in see.text()
        assert see.main.cursor == 1_000_000
        assert see.lines()[-11].split()[:2] == [">", "1000000"]
        await see.press("colon")
        await see.type("654321")
        await see.press("enter")
        assert see.main.cursor == 654_321
        await see.press("colon")
        await see.type("+5000")
        await see.press("enter")
        assert see.main.cursor == 500_001

    look(store_of(1_000_000), script)


def test_following_a_long_capture_costs_a_screen(look: Any, store_of: Any, asked: Asked) -> None:
    store = store_of(1_000_000)

    async def script(see: Any) -> None:
        before = asked.rows
        for _ in range(3):
            store.add_table(made_table(store.last_no + 1, 50))
            await see.poll()
        assert see.main.cursor == 1_000_150
        assert asked.rows - before <= 3 * 1500

    look(store, script, live=True)


def test_a_filter_shows_its_neighbourhood_before_it_has_seen_everything(look: Any, store_of: Any, asked: Asked) -> None:
    store = store_of(1_000_000)

    async def script(see: Any) -> None:
        await see.press("colon")
        await see.type("500000")
        await see.press("enter")
        before = asked.rows
        see.app.filter('string(hex) contains "07030007"')  # no column holds it
        assert asked.rows - before < 1500
        index = see.main.index
        assert index.pending > 900_000
        assert len(index) >= 1
        assert abs(index.nearest(500_000) - 500_000) <= 128
        assert "to be searched" in str(see.app.screen.query_one("FilterLine").content)
        see.app.filter("")
        await see.settle()
        assert see.main.cursor == index.nearest(500_000)

    look(store, script)


def test_a_filter_on_columns_makes_only_the_rows_that_are_shown(look: Any, store_of: Any, asked: Asked) -> None:
    store = store_of(1_000_000)

    async def script(see: Any) -> None:
        before = asked.rows
        see.app.filter("dst == 7 && no > 1000")
        await see.settle()
        assert see.main.index.pending == 0
        assert len(see.main.index) == 4995
        assert see.main.index[0] == 1008
        assert asked.rows - before < 300

    look(store, script)


def test_only_lines_that_changed_are_drawn(look: Any, store_of: Any) -> None:
    """A terminal over ssh pays for every line."""
    store = store_of(1000)

    async def script(see: Any) -> None:
        await see.press("down")
        before = see.drawn_lines
        await see.press("down")
        assert see.drawn_lines - before == 2  # where the cursor was and where it is
        before = see.drawn_lines
        for _ in range(5):
            store.add_table(made_table(store.last_no + 1, 10))
            await see.poll()
        assert see.main.index.last == 1050
        assert see.drawn_lines == before  # nothing of it is in sight

    look(store, script)
