"""A view costs the same at a million rows as at a thousand: counted in rows looked at, not in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from dissectors.frame import Check, Found, Frame, Header, Role
from sniff.bus.rows import Store
from sniff.engine.engine import Row

MS = 1_000_000


class MadeRows(Sequence[Row]):
    """Rows made when asked for, and counted."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.asked = 0

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: Any) -> Row:
        self.asked += 1
        number = index if index >= 0 else self.count + index
        octets = bytes([number % 200, 3, 0, 7, 99])
        start = number * 10 * MS
        frame = Frame("toy", octets, start, start + MS, Check.GOOD, Found.GAP)
        return Row(number + 1, frame, Header("toy", None, octets[0], Role.REQUEST, "read"))


@pytest.fixture
def store_of(make_bus: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    def make(count: int) -> Store:
        store = make_bus().store
        store.rows = MadeRows(count)
        store.version += 1
        return store

    return make


def cost(look: Any, store: Store, size: tuple[int, int]) -> dict[str, tuple[int, int]]:
    """For each key: lines drawn, rows asked for."""
    costs = {}

    async def script(see: Any) -> None:
        for key in ("end", "up", "pageup", "home", "pagedown", "t"):
            before = see.main.drawn_lines, store.rows.asked
            await see.press(key)
            costs[key] = (see.main.drawn_lines - before[0], store.rows.asked - before[1])

    look(store, script, size)
    return costs


def test_a_million_rows_cost_what_a_thousand_cost(look: Any, store_of: Any) -> None:
    size = (80, 24)
    for count in (1000, 1_000_000):
        for key, (lines, rows) in cost(look, store_of(count), size).items():
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


def test_following_a_long_capture_costs_a_screen(look: Any, store_of: Any) -> None:
    store = store_of(1_000_000)

    async def script(see: Any) -> None:
        before = store.rows.asked
        for _ in range(3):
            store.rows.count += 50
            store.version += 1
            await see.poll()
        assert see.main.cursor == 1_000_150
        assert store.rows.asked - before <= 3 * 1500

    look(store, script, live=True)


def test_a_filter_shows_its_neighbourhood_before_it_has_seen_everything(look: Any, store_of: Any) -> None:
    store = store_of(1_000_000)

    async def script(see: Any) -> None:
        await see.press("colon")
        await see.type("500000")
        await see.press("enter")
        before = store.rows.asked
        see.app.filter("dst == 7")
        assert store.rows.asked - before < 1500
        index = see.main.index
        assert index.pending > 900_000
        assert len(index) >= 1
        assert abs(index.nearest(500_000) - 500_000) <= 128
        assert "to be searched" in str(see.app.screen.query_one("FilterLine").content)
        see.app.filter("")
        await see.settle()
        assert see.main.cursor == index.nearest(500_000)

    look(store, script)


def test_only_lines_that_changed_are_drawn(look: Any, store_of: Any) -> None:
    """A terminal over ssh pays for every line."""
    store = store_of(1000)

    async def script(see: Any) -> None:
        await see.press("down")
        before = see.main.drawn_lines
        await see.press("down")
        assert see.main.drawn_lines - before == 2  # where the cursor was and where it is
        before = see.main.drawn_lines
        for _ in range(5):
            store.rows.count += 10
            store.version += 1
            await see.poll()
        assert see.main.index.last == 1050
        assert see.main.drawn_lines == before  # nothing of it is in sight

    look(store, script)
