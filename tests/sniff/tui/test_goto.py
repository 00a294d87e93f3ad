"""Where `:` goes."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.line import NS_PER_S
from sniff.tui.goto import find


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("5", 5),
        ("0", 1),
        ("999999999999999999999", 13),
        ("10:00", 1),
        ("10:00:00.098", 5),
        ("10:00:00.1", 6),
        ("09:59:59", 13),  # tomorrow
        ("+0", 1),
        ("+0.104", 6),
        ("+99", 13),
    ],
)
def test_places(busy_bus: Any, text: str, row: int) -> None:
    assert find(busy_bus.store, text, busy_bus.store.last_no) == row


def test_seconds_count_from_where_every_command_counts(make_bus: Any, look: Any) -> None:
    """From the start of the capture, not from its first row: what `check` says at 4.1 s is found by +4.1."""
    bus = make_bus()
    bus.now += 4 * NS_PER_S
    bus.ask(1)
    bus.now += 2 * NS_PER_S
    bus.ask(2)
    assert find(bus.store, "+4.1", bus.store.last_no) == 3
    assert find(bus.store, "+2.1", bus.store.last_no) == 1

    async def script(see: Any) -> None:
        await see.press("t")
        assert "+4.000000" in see.lines()[3]

    look(bus.store, script)


def test_not_beyond_the_freeze(busy_bus: Any) -> None:
    assert find(busy_bus.store, "12", 7) == 7
    assert find(busy_bus.store, "+99", 7) == 7


@pytest.mark.parametrize("text", ["", "x", "24:00", "10:60", "10:00:61", "1.5", "+", "١٢", "-3"])
def test_what_is_no_place(busy_bus: Any, text: str) -> None:
    with pytest.raises(ValueError, match="expected a row number"):
        find(busy_bus.store, text, 13)


def test_nowhere_to_go(make_bus: Any) -> None:
    store = make_bus().store
    assert [find(store, text, store.last_no) for text in ("3", "10:00", "+5")] == [None, None, None]
