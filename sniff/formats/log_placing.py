"""Where reads lie in time of which the clock of their log says nothing of its own: those of one tick, those of a line
without a time, those ahead of the first time. Pure.

They keep their order and lie between the times that are told: what stands behind a time lies behind it, and before the
next one; what stands ahead of the first lies right before that.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from dissectors.frame import Chunk
from sniff.formats.timeless import LINE_END

MOST = 1024
"""Reads that wait for the next time; more are given where they were laid."""


class Placing:
    """Reads in, in the order of the log; out in order of time, where its clock goes on. `has_time`: whether the one
    given last had a time."""

    def __init__(self) -> None:
        self.has_time = False
        self._waiting: list[tuple[Chunk, bool]] = []
        self._told: int | None = None

    def told(self, chunk: Chunk, has_time: bool, char: int) -> Iterator[Chunk]:
        """A read at its time, of octets that take `char` each."""
        if self._told is None:
            yield from self._ahead(chunk.time - len(chunk.octets) * char)
        else:
            yield from self._between(self._told, chunk.time)
        self._told = chunk.time
        self.has_time = has_time
        yield chunk

    def untold(self, chunk: Chunk, has_time: bool) -> Iterator[Chunk]:
        """One that is laid behind the last."""
        self._waiting.append((chunk, has_time))
        if len(self._waiting) > MOST:
            yield from self.close()

    def close(self) -> Iterator[Chunk]:
        """Those of which no time comes any more, where they were laid."""
        waiting, self._waiting = self._waiting, []
        if waiting:
            self._told = waiting[-1][0].time
        for one, self.has_time in waiting:
            yield one

    def _ahead(self, begin: int) -> Iterator[Chunk]:
        """Those that wait, before what begins then."""
        waiting, self._waiting = self._waiting, []
        shift = begin - LINE_END - waiting[-1][0].time if waiting else 0
        for one, self.has_time in waiting:
            yield replace(one, time=one.time + shift)

    def _between(self, before: int, after: int) -> Iterator[Chunk]:
        """Those that wait, at most in equal steps from one time to the next."""
        waiting, self._waiting = self._waiting, []
        step = max(0, after - before) / (len(waiting) + 1)
        for number, (one, self.has_time) in enumerate(waiting, 1):
            yield replace(one, time=min(one.time, before + int(number * step)))
