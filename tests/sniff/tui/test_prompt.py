"""The prompt gives the keys back: whatever is pressed behind an answer is the screen's, however soon it comes."""

from __future__ import annotations

from typing import Any

from textual.events import Key

from sniff.tui.prompt import Prompt


async def at_once(see: Any, *keys: tuple[str, str | None]) -> None:
    """Press keys that all lie in the queue before the first is seen to."""
    for key, character in keys:
        see.app.post_message(Key(key, character))
    for _ in range(3):  # each handed on is one more way through the queues
        await see.pilot.pause(0)
        await see.settle()


def test_keys_behind_an_answer_are_the_lists(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("colon")
        await see.type("5")
        await at_once(see, ("enter", "\r"), ("down", None), ("down", None))
        assert not see.app.screen.query_one(Prompt).is_open
        assert see.app.focused is see.main
        assert see.app.viewing.row == 7

    look(busy_bus.store, script)


def test_a_prompt_asked_for_behind_an_answer_stays_open(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("colon")
        await see.type("5")
        await at_once(see, ("enter", "\r"), ("slash", "/"))
        prompt = see.app.screen.query_one(Prompt)
        assert prompt.is_open
        assert prompt.purpose == "filter"
        await see.type("dst == 1")
        await see.press("enter")
        assert see.app.viewing.filter == "dst == 1"
        assert see.app.focused is see.main

    look(busy_bus.store, script)


def test_the_keys_go_back_to_the_one_pane_that_is_shown(look: Any, busy_bus: Any) -> None:
    async def script(see: Any) -> None:
        await see.press("tab", "z")
        alone = see.app.screen.zoomed
        assert alone is not None
        assert alone is not see.main
        await see.press("colon")
        await see.type("5")
        await see.press("enter")
        assert see.app.focused is alone

    look(busy_bus.store, script)
