"""A whole capture through an engine: what it gives of each item, and what happened to the line at its place between."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar

from sniff.engine.capture_error import CaptureError
from sniff.engine.session import LineEvent

Fed = TypeVar("Fed")
Taken = TypeVar("Taken", contravariant=True)
Made = TypeVar("Made", covariant=True)


class Taker(Protocol[Taken, Made]):
    """An engine, whether it gives rows one by one or as tables."""

    def take(self, item: Taken) -> Made:
        """Take what was read or what happened to the line; what it gives by then."""
        ...

    def close(self) -> Made:
        """End of capture; what is left."""
        ...


def whole(engine: Taker[Fed, Made], items: Iterable[Fed]) -> Iterator[Made | LineEvent]:
    """What the engine gives, where that is anything, with the line events: a hole before the rows that it ends, any
    other behind those before it. Raises what `items` raises, CaptureError when all before the damage was given."""
    try:
        for item in items:
            event = item if isinstance(item, LineEvent) else None
            if event is not None and event.kind.is_hole:
                yield event
            made = engine.take(item)
            if made:
                yield made
            if event is not None and not event.kind.is_hole:
                yield event
    except CaptureError:
        yield engine.close()
        raise
    yield engine.close()
