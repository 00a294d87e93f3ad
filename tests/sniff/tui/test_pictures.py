"""What the screens look like, as text beside this file, and what must never be in them."""

from __future__ import annotations

from typing import Any

import pytest

from sniff.engine.session import LineEvent, LineEventKind

SIZES = {"80x24": (80, 24), "160x50": (160, 50)}


@pytest.mark.parametrize("size", SIZES)
def test_pictures(look: Any, golden: Any, busy_bus: Any, size: str) -> None:
    """`UPDATE_GOLDEN=1 pytest …` writes them anew; read the difference before you commit it."""
    busy_bus.store.add_line_event(LineEvent(busy_bus.now, LineEventKind.UNPLUGGED, "gone"))

    async def script(see: Any) -> None:
        async def compare(name: str) -> None:
            await see.poll()  # the header follows ten times a second
            golden(f"{name}-{size}", see.text())
            assert "None" not in see.text()
            assert "{" not in see.text()
            assert all(len(line) <= SIZES[size][0] for line in see.lines())

        see.app.tabs = (("1", "Frames"), ("2", "Transactions"), ("3", "Nodes"), ("8", "Line"))  # however many there are
        await see.press("colon", "8", "enter")  # damaged, with a line error
        await compare("frames")
        await see.press("enter", "down", "down")
        await compare("fields")
        await see.press("2")
        await compare("transactions")
        await see.press("3")
        await compare("nodes")
        await see.press("9")
        await compare("line")

    look(busy_bus.store, script, SIZES[size], live=True, recording="/tmp/x.mcap")
