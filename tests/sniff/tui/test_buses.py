"""The bar of buses: all of them followed, one shown; what fails is marked and the others go on."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

import pytest
from rich.cells import cell_len

from sniff.analysis.site_ear import SiteEar
from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.engine.event_texts import gone
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent, LineEventKind
from sniff.tui.app import SnifferApp
from sniff.tui.busbar import labels
from sniff.tui.seats import BusLine, BusState, Seat
from tests.sniff.analysis.sites_made import Exchange, asked, heard, power_lost, sessions
from tests.sniff.tui.conftest import Looking

HOSTILE = "[b]\x1b[2J"
S = 1_000_000_000


def store(name: str, exchanges: int) -> Store:
    """A bus with so many exchanges."""
    (session,) = sessions({name: []})
    made = [Exchange(session.started + number * S // 10, *asked(1, 0, number), S // 100) for number in range(exchanges)]
    kept = Store(session, dissector_for(session))
    observe(outputs(heard(made, random.Random(name)), session), kept)
    return kept


@pytest.fixture
def feeds() -> list[StoreFeed]:
    made = []
    for number, name in enumerate(("boiler", "roof", "cellar")):
        kept = store(name, 40 + number)
        made.append(StoreFeed(kept, FeedStatus(f"/dev/{name}", "19200,8E1", "modbus-rtu", "site.mcap", live=True)))
    return made


def look(
    feeds: list[StoreFeed], script: Callable[[Looking], Awaitable[None]], size: tuple[int, int] = (80, 24)
) -> None:
    async def main() -> None:
        app = SnifferApp(feeds)
        async with app.run_test(size=size) as pilot:
            looking = Looking(app, pilot, feeds[0])
            await looking.settle()
            await script(looking)

    asyncio.run(main())


def bar(see: Looking) -> str:
    return see.lines()[2]


def test_one_key_shows_the_next_bus(feeds: list[StoreFeed]) -> None:
    async def script(see: Looking) -> None:
        assert bar(see).startswith("[boiler")
        assert "/dev/boiler" in see.text()
        await see.press("b")
        assert "[roof" in bar(see)
        assert "/dev/roof" in see.text()
        await see.press("B", "B")
        assert "[cellar" in bar(see)
        await see.press("b")
        assert bar(see).startswith("[boiler")

    look(feeds, script)


def test_each_bus_has_its_own_screen_filter_and_way_back(feeds: list[StoreFeed]) -> None:
    async def script(see: Looking) -> None:
        see.app.filter("dst == 1")
        await see.press("5", "b")
        assert see.app.current_mode.startswith("frames")
        assert see.app.viewing.filter == ""
        await see.press("3", "B")
        assert see.app.current_mode == "findings"
        assert see.app.viewing.filter == "dst == 1"
        await see.press("q")
        assert see.app.current_mode == "frames"
        await see.press("b")
        assert see.app.current_mode.startswith("nodes")

    look(feeds, script)


def test_a_bus_that_fails_is_marked_and_the_others_go_on(feeds: list[StoreFeed]) -> None:
    async def script(see: Looking) -> None:
        _, roof, cellar = feeds
        at = roof.store.session.started + 10 * S
        roof.store.add_line_event(LineEvent(at, LineEventKind.UNPLUGGED, gone("/dev/roof", "No such device")))
        cellar.current = replace(cellar.current, ended="its process was ended")
        await see.poll()
        assert "roof DOWN" in bar(see)
        assert "cellar ENDED" in bar(see)
        assert any("cellar: its process was ended" in notice for notice in see.notices())
        assert any("roof: /dev/roof is gone (No such device)" in notice for notice in see.notices())
        before = cellar.store.last_no
        more = heard([Exchange(at, *asked(1, 0, 5), S // 100)], random.Random(1))
        observe(outputs(more, cellar.store.session), cellar.store)
        roof.store.add_line_event(LineEvent(at + S, LineEventKind.REPLUGGED, "/dev/roof is back"))
        await see.poll()
        assert "DOWN" not in bar(see)
        assert any("roof: /dev/roof is back" in notice for notice in see.notices())
        assert cellar.store.last_no > before

    look(feeds, script)


def test_what_the_buses_say_together_stands_with_the_findings_of_each() -> None:
    site = power_lost(random.Random(3))
    made = []
    for session in sessions(site):
        kept = Store(session, dissector_for(session), ear=SiteEar())
        observe(outputs(site[session.bus], session), kept)
        made.append(StoreFeed(kept, FeedStatus("site.mcap", "19200,8E1", "modbus-rtu")))

    async def script(see: Looking) -> None:
        await see.press("5")
        for name in site:
            assert bar(see).find(f"[{name}") >= 0
            lines = see.lines()
            site_line = next(number for number, line in enumerate(lines) if "SB001" in line)
            assert "site" in lines[site_line]
            assert "3 buses stopped at one moment" in see.text()
            assert "└" in lines[site_line + 1]  # the bus's own silence comes from it
            await see.press("b", "5")

    look(made, script, (120, 40))


def test_a_click_shows_a_bus(feeds: list[StoreFeed]) -> None:
    async def script(see: Looking) -> None:
        await see.pilot.click("BusBar", offset=(bar(see).index("cellar") + 2, 0))
        await see.settle()
        assert "[cellar" in bar(see)

    look(feeds, script)


def test_of_one_bus_there_is_no_bar(feeds: list[StoreFeed]) -> None:
    async def script(see: Looking) -> None:
        assert "boiler" not in see.lines()[2]
        assert "b bus" not in see.text()
        await see.press("b")
        assert see.app.seat.name == "boiler"

    look(feeds[:1], script)


def test_the_key_is_in_the_footer_and_its_help_says_what_it_does(feeds: list[StoreFeed]) -> None:
    async def script(see: Looking) -> None:
        assert "b bus" in see.lines()[-1]
        await see.press("question_mark")
        assert "the next bus" in see.text()

    look(feeds, script, (100, 60))


def buses(count: int, here: int = 0, name: str = "bus", **told: Any) -> list[BusLine]:
    known: dict[str, Any] = {"state": BusState.WELL, "health": 98.6, "load": 0.07, "errors": 3, "lost": 0, **told}
    return [BusLine(f"{name}-{number}", is_here=number == here, **known) for number in range(count)]


def said(lines: list[BusLine], width: int) -> str:
    return "".join(text for text, _ in labels(lines, width))


def test_as_much_as_fits() -> None:
    assert said(buses(2), 120) == "[bus-0 health 99 load 7% err 3] bus-1 health 99 load 7% err 3 "
    assert said(buses(3), 80) == "[bus-0 99 7% err 3] bus-1 99 7% err 3  bus-2 99 7% err 3 "
    assert said(buses(6), 80) == "[bus-0 99] bus-1 99  bus-2 99  bus-3 99  bus-4 99  bus-5 99 "
    assert said(buses(20, here=10), 40) == "…[bus-10 99] bus-11 99  bus-12 99 …"
    assert said(buses(20, here=19), 40) == "… bus-17 99  bus-18 99 [bus-19 99]"


@pytest.mark.parametrize("width", [20, 40, 80, 120])
@pytest.mark.parametrize("count", [2, 5, 10, 40])
def test_it_never_takes_more_than_there_is(count: int, width: int) -> None:
    for here in (0, count // 2, count - 1):
        made = labels(buses(count, here, "a-long-name-of-a-bus"), width)
        assert sum(cell_len(text) for text, _ in made) <= width
        assert sum(text.startswith("[") for text, _ in made) == 1


def test_trouble_is_said_in_words_and_nothing_hostile_is_drawn() -> None:
    lines = buses(2, name=HOSTILE, state=BusState.DOWN, lost=7)
    assert "DOWN LOST 7" in said(lines, 120)
    assert "\x1b" not in said(lines, 120)
    assert said(buses(30, state=BusState.DOWN), 80).endswith("…!")
    assert said(buses(2, health=None), 80).count("–") == 2


def test_each_event_of_a_line_is_looked_at_once() -> None:
    """A bus with errors has one a second; the bar is drawn ten times a second."""

    class Watched(list[LineEvent]):
        looked = 0

        def __getitem__(self, which: Any) -> Any:
            found = super().__getitem__(which)
            Watched.looked += len(found)
            return found

        __reversed__ = None

    kept = store("boiler", 4)
    kept.line_events = Watched(LineEvent(number, LineEventKind.ERRORS, "parity", 1) for number in range(1000))
    seat = Seat.of(StoreFeed(kept, FeedStatus("/dev/x", "19200,8E1", "modbus-rtu", "site.mcap", live=True)), "frames")
    assert [seat.state for _ in range(100)] == [BusState.WELL] * 100
    kept.add_line_event(LineEvent(2000, LineEventKind.UNPLUGGED, gone("/dev/x", "hung up")))
    assert seat.state is BusState.DOWN
    kept.add_line_event(LineEvent(2001, LineEventKind.REPLUGGED, "/dev/x is back"))
    assert seat.state is BusState.WELL
    assert Watched.looked == 1002
