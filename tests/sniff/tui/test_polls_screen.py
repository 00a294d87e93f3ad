"""Screen 8: the programme of a simulated bus."""

from __future__ import annotations

from typing import Any

import pytest

from tests.sniff.tui.test_points_screen import SIZES, cells, keys, store_of


@pytest.mark.parametrize("name", ["modbus-rtu", "modbus-ascii", "n2", "mstp"])
def test_each_request_with_its_interval(look: Any, name: str) -> None:
    async def script(see: Any) -> None:
        for width, height in SIZES.values():
            await see.pilot.resize_terminal(width, height)
            await see.settle()
            text = see.text()
            assert "None" not in text
            assert all(len(line) <= width for line in see.lines())
            assert keys(see)
            assert "requests, sorted by when first asked" in " ".join(text.split())

    look(store_of(name, 10), script, start="polls")


def test_names_order_words_and_the_frame(look: Any) -> None:
    store = store_of("modbus-rtu", 20)

    async def script(see: Any) -> None:
        assert any("output-frequency" in cells(see, key)[1] for key in keys(see))
        first = keys(see)[0]
        assert cells(see, first)[2] == "1000"
        await see.press("s")
        assert [cells(see, key)[0] for key in keys(see)] == sorted(
            (cells(see, key)[0] for key in keys(see)), key=lambda stn: -1 if stn == "all" else int(stn)
        )
        await see.press("slash", *"output-f", "enter")
        assert keys(see)
        assert all("output-frequency" in cells(see, key)[1] for key in keys(see))
        assert "only with output-f" in see.text()
        await see.press("escape")
        assert first in keys(see)
        await see.press("enter")
        assert see.app.current_mode == "frames"

    look(store, script, start="polls")


def test_wide_screens_have_more_columns(look: Any) -> None:
    async def script(see: Any) -> None:
        assert len(cells(see, keys(see)[0])) == 11
        assert "p95 ms" in see.text()

    look(store_of("modbus-rtu", 10), script, (120, 40), "polls")


def test_the_chart_of_years_has_a_cell_for_each_column(look: Any, make_bus: Any) -> None:
    """The clock of the recorder was set meanwhile. Nor does a screen without room for it end the program."""
    bus = make_bus()
    bus.ask()
    bus.ask()
    bus.now += 56 * 365 * 86_400 * 10**9
    bus.ask(2)

    async def script(see: Any) -> None:
        chart = see.app.screen._chart(next(iter(see.app.screen._shown.values()))).plain.splitlines()
        assert max(map(len, chart)) <= 120
        assert "█" in "".join(chart)
        await see.pilot.resize_terminal(1, 1)
        await see.settle()
        await see.pilot.resize_terminal(80, 24)
        await see.settle()
        assert "read to" in see.text()

    look(bus.store, script, (120, 50), "polls")


def test_an_empty_bus_says_so(look: Any, make_bus: Any) -> None:
    async def script(see: Any) -> None:
        assert "nobody asked anything" in see.text()

    look(make_bus().store, script, start="polls")
