"""What a screen and a key cost with many rows: `python -m tests.bench.screen_speed [ROWS]` (1000000). CPU time of this
process, ms.

A switch should paint within 100 ms, a key be answered within 50 ms, a jump within 16 ms; each is done some times, the
median is told.
"""

from __future__ import annotations

import asyncio
import statistics
import sys
import time
from collections.abc import Awaitable, Callable

from dissectors.line import LineSettings
from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.bus.rows import Store
from sniff.engine.session import Session
from sniff.tui.app import SnifferApp
from sniff.tui.screens import SCREENS
from tests.sniff.tui.conftest import TOY
from tests.sniff.tui.test_million_rows import made_table

ROWS, TABLE, TIMES = 1_000_000, 50_000, 5


def filled(rows: int) -> Store:
    """A store of that many rows."""
    session = Session("/dev/ttyUSB0", LineSettings.parse("19200,8E1"), "toy", 0)
    store = Store(session, TOY, rows, judge_later=True)  # the rules are not measured here
    for first in range(1, rows + 1, TABLE):
        store.add_table(made_table(first, TABLE))
    return store


async def measured(rows: int, size: tuple[int, int] = (200, 60)) -> list[tuple[str, float, float]]:
    """What was done, its median and its most, ms."""
    store = filled(rows)
    app = SnifferApp(StoreFeed(store, FeedStatus("f.mcap", "19200,8E1", "toy")))
    found: list[tuple[str, float, float]] = []

    async def timed(name: str, do: Callable[[], Awaitable[object]], times: int = TIMES) -> None:
        spent = []
        for _ in range(times):
            begun = time.process_time()
            await do()
            spent.append((time.process_time() - begun) * 1e3)
        found.append((name, statistics.median(spent), max(spent)))

    async with app.run_test(size=size) as pilot:
        await pilot.pause()
        for entry in SCREENS:

            async def there(key: str = entry.key) -> None:
                await pilot.press(key)
                app.screen._compositor.render_strips()

            async def back() -> None:
                await pilot.press("1" if app.current_mode != "frames" else "2")

            await timed(f"{entry.title}, first time", there, 1)
            spent = []
            for _ in range(TIMES):
                await back()
                begun = time.process_time()
                await there()
                spent.append((time.process_time() - begun) * 1e3)
            found.append((f"{entry.title}, again", statistics.median(spent), max(spent)))
        await pilot.press("1", "home")
        for key in ("down", "pagedown", "end", "home", "t"):
            await timed(f"key {key} on Frames", lambda key=key: pilot.press(key))
        spent = []
        for at in range(1, TIMES + 1):
            await pilot.press(":", *str(rows * at // (TIMES + 1)))
            begun = time.process_time()
            await pilot.press("enter")
            spent.append((time.process_time() - begun) * 1e3)
        found.append(("jump to a number on Frames", statistics.median(spent), max(spent)))
    return found


if __name__ == "__main__":
    for name, median, most in asyncio.run(measured(int(sys.argv[1]) if len(sys.argv) > 1 else ROWS)):
        sys.stdout.write(f"{name:<30} {median:8.1f} {most:8.1f}\n")
