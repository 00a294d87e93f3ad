"""The tables of a capture, of which somebody may look at the first before they are taken: none is made twice."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from sniff.engine.capture_error import CaptureError
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    from sniff.engine.table import Table


class TablesAhead:
    """An iterable, once, of what it is given; raises what that raises, at its place."""

    def __init__(self, items: Iterator[Table | LineEvent]) -> None:
        self._items = items
        self._seen: deque[Table | LineEvent] = deque()
        self._error: CaptureError | None = None

    def look(self) -> Iterator[Table | LineEvent]:
        """The first, as far as who looks goes on; they are kept for who takes them."""
        try:
            for item in self._items:
                self._seen.append(item)
                yield item
        except CaptureError as error:
            self._error = error
            raise

    def __iter__(self) -> Iterator[Table | LineEvent]:
        while self._seen:
            yield self._seen.popleft()
        if self._error is not None:
            raise self._error
        yield from self._items
