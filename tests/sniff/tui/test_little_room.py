"""Small windows: what is typed, what is said about it and the keys stay in sight, and so does who has the keys."""

from __future__ import annotations

import asyncio
from typing import Any

from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.tui.app import SnifferApp
from sniff.tui.field_tree import FieldTree
from sniff.tui.hex_pane import HexPane
from sniff.tui.prompt import Prompt
from tests.sniff.tui.conftest import Looking


def test_few_lines_and_columns_are_shared_by_what_matters(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        see.app.filter("dst == 1 || dst == 2 || dst == 3")
        await see.press("ctrl+f")
        await see.type("read")
        lines = see.lines()
        assert lines[2].startswith("filter: dst == 1")
        assert lines[2].endswith("· esc")
        assert lines[-3].startswith("read")
        assert lines[-1].startswith("enter accept")
        assert not see.app.screen.show_vertical_scrollbar
        await see.press("escape")
        assert "q back" in see.lines()[-1]
        for keys in (("enter",), ("z", "z")):
            await see.press(*keys)
            assert see.app.screen.query_one(FieldTree).size.width > 30
            assert not see.app.screen.query_one(HexPane).display

    look(busy_bus.store, script, size=(40, 12))


def test_a_notice_covers_nothing_that_is_typed(busy_bus: Any) -> None:
    store = busy_bus.store
    app = SnifferApp(StoreFeed(store, FeedStatus("f", "19200,8E1", "toy")))

    async def script() -> None:
        async with app.run_test(size=(80, 24), notifications=True) as pilot:
            app.notify("to be read", timeout=30)
            see = Looking(app, pilot, app.feed)
            await see.press("colon")
            notice = app.screen.query_one("Toast")
            assert 0 < notice.region.bottom <= app.screen.query_one(Prompt).region.y
            await see.press("escape")
            assert notice.region.bottom == 23

    asyncio.run(script())
