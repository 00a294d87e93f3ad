"""A key has drawn what it changes, and that once: each layout and each line drawn again is time before the answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from textual._compositor import Compositor

from sniff.tui.field_tree import FieldTree
from sniff.tui.hex_pane import HexPane

ROOMY = 80, 50
"""All fields of a row have room: no scroll bar comes or goes."""


@pytest.fixture
def layouts(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Grows by one with every layout of a screen."""
    found: list[object] = []
    reflow = Compositor.reflow

    def counted(compositor: Compositor, *given: Any) -> Any:
        found.append(given)
        return reflow(compositor, *given)

    monkeypatch.setattr(Compositor, "reflow", counted)
    return found


@pytest.fixture
def long_bus(make_bus: Callable[..., Any]) -> Any:
    """150 rows, more than any screen has lines; each is as long as the others."""
    made = make_bus()
    for number in range(75):
        made.ask(1 + number % 3)
    return made


def test_a_jump_lays_the_screen_out_once(look: Any, long_bus: Any, layouts: list[object]) -> None:
    async def script(see: Any) -> None:
        await see.press("colon")
        await see.type("100")
        layouts.clear()
        drawn = see.drawn_lines
        await see.press("enter")
        assert see.app.viewing.row == 100
        assert len(layouts) == 1
        assert see.drawn_lines - drawn <= 2 * see.main.visible_lines  # a busy machine may paint in between

    look(long_bus.store, script, ROOMY)


def test_another_row_needs_no_layout(look: Any, long_bus: Any, layouts: list[object]) -> None:
    async def script(see: Any) -> None:
        await see.press("down")
        layouts.clear()
        drawn = see.drawn_lines
        await see.press("down", "down")
        assert see.app.screen.query_one(HexPane).row == 4
        assert not layouts
        assert see.drawn_lines - drawn <= 8  # the cursor and its partner, before and after

    look(long_bus.store, script, ROOMY)


def test_a_scroll_bar_comes_and_goes_with_the_lines(look: Any, make_bus: Callable[..., Any]) -> None:
    made = make_bus()
    made.ask(1)
    made.noise(bytes(100))

    async def script(see: Any) -> None:
        tree, octets = see.app.screen.query_one(FieldTree), see.app.screen.query_one(HexPane)
        assert not octets.show_vertical_scrollbar
        await see.press("down", "down")
        assert octets.row == 3
        assert octets.show_vertical_scrollbar
        octets.scroll_to(y=5, animate=False)
        await see.press("up")
        assert not octets.show_vertical_scrollbar
        assert octets.scroll_offset.y == tree.scroll_offset.y == 0

    look(made.store, script)


def test_who_gets_and_who_loses_the_keys_is_drawn_and_nothing_else(
    look: Any, long_bus: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole: list[object] = []
    full_update = Compositor.render_full_update

    def counted(compositor: Compositor, **given: Any) -> Any:
        whole.append(given)
        return full_update(compositor, **given)

    monkeypatch.setattr(Compositor, "render_full_update", counted)

    async def script(see: Any) -> None:
        with_keys = see.main.render_line(1)
        whole.clear()
        await see.press("tab")
        assert see.app.focused is see.app.screen.query_one(FieldTree)
        assert see.main.render_line(1) != with_keys
        await see.press("shift+tab")
        assert see.main.render_line(1) == with_keys
        assert not whole

    look(long_bus.store, script)
