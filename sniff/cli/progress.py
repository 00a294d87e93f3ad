"""Progress on standard error, on a terminal only, of what takes longer than half a second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TextIO, TypeVar

from sniff.engine.read_source import ReadSource, stored_tables
from sniff.engine.session import Item, LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block
    from sniff.engine.table import Table

AFTER, EVERY = 0.5, 0.2
"""Seconds until it is first said, and again."""

Read = TypeVar("Read")


class Watched:
    """A capture whose reading is told. `clock`: seconds. `prints`: whether who reads it prints rows meanwhile: what was
    said is then wiped away before each part is handed on, so that no row lands behind it."""

    def __init__(
        self,
        capture: ReadSource,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
        prints: bool = False,
    ) -> None:
        self._capture = capture
        self._prints = prints
        self._stream = sys.stderr if stream is None else stream
        self._clock = clock

    @property
    def wrapped(self) -> ReadSource:
        """The capture."""
        return self._capture

    def items(self) -> Iterator[Item]:
        """What the capture gives."""
        return self._told(self._capture.items(), lambda item: len(getattr(item, "octets", b"")))

    def blocks(self) -> Iterator[Block | LineEvent]:
        """What the capture gives."""
        return self._told(
            self._capture.blocks(), lambda block: 0 if isinstance(block, LineEvent) else len(block.reads.octets)
        )

    def stored_tables(self, session: Session) -> Iterator[Table | LineEvent] | None:
        """What the capture holds."""
        held = stored_tables(self._capture, session)
        if held is None:
            return None
        return self._told(held, lambda table: 0 if isinstance(table, LineEvent) else len(table.octets))

    def _told(self, parts: Iterator[Read], octets_of: Callable[[Read], int]) -> Iterator[Read]:
        if not self._stream.isatty():
            yield from parts
            return
        began = self._clock()
        due, octets, said = began + AFTER, 0, False
        try:
            for part in parts:
                if said and self._prints:
                    self._say("")
                    said = False
                yield part
                octets += octets_of(part)
                now = self._clock()
                if now >= due:
                    due, said = now + EVERY, True
                    self._say(f"reading: {octets:,} octets, {now - began:.0f} s")
        finally:
            if said:
                self._say("")

    def _say(self, words: str) -> None:
        print(f"\r{words}\x1b[K", end="", file=self._stream, flush=True)
