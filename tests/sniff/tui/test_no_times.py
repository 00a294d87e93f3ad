"""Of a log that does not say when anything came no screen tells a time."""

from __future__ import annotations

import re
from typing import Any

import pytest

from dissectors.findings import Finding, Severity
from sniff.engine.session import NO_TIMES

SCREENS = ("frames", "transactions", "nodes", "points", "findings", "timeline", "polls", "line")
TIME = re.compile(r"\d\d:\d\d:\d\d|1970|\bload\b|\d ms|\d s\b|±|every \d")


@pytest.mark.parametrize("size", [(80, 24), (200, 60)])
@pytest.mark.parametrize("screen", SCREENS)
def test_no_screen_tells_a_time(screen: str, size: tuple[int, int], look: Any, make_bus: Any) -> None:
    bus = make_bus(said=NO_TIMES)
    for _ in range(4):
        bus.ask(1, latency=None)
        bus.ask(2, latency=None)
    bus.noise()
    found = Finding("LN203", Severity.WARNING, "bus", 5, 9, 2, (1, 3), "stray octets", "noise", "bias")
    bus.store.model.findings = lambda: (found,)  # type: ignore[method-assign]

    async def script(see: Any) -> None:
        await see.poll()
        await see.poll()
        head, *shown = see.lines()
        assert "load" not in head
        told = [line for line in shown if TIME.search(_without_titles(line))]
        assert not told, told

    look(bus.store, script, start=screen, size=size)


def _without_titles(line: str) -> str:
    """Titles of columns stay, with "–" below them; so does what a character takes at this rate."""
    titles = r"every ms +±|ms ±\d+|one character .*|or a time|p\d+ ms"
    return re.sub(titles, "", line)
