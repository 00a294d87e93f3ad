"""A framer driven over a whole capture."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.frame import Chunk, Event
from dissectors.framer import Framer


def drive(framer: Framer, chunks: Iterable[Chunk]) -> list[Event]:
    """All events of a whole capture."""
    events: list[Event] = []
    for chunk in chunks:
        events += framer.feed(chunk)
    return events + framer.close()
