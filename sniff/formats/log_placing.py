"""Where reads lie in time of which the clock of their log says nothing of its own: those of one tick, those of a line
without a time, those ahead of the first time. Pure.

They keep their order and lie between the times that are told: what stands behind a time lies behind it, and before the
next one; what has that time, too, lies before the clock counted on; what stands ahead of the first lies right before
that. Where more lie there than a slow line has time for, they lie in equal steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import accumulate

from dissectors.frame import Chunk
from sniff.formats.timeless import LINE_END

MOST = 1024
"""Reads that wait for the next time; of more, those come in the first half of what is left of theirs."""

_NEVER = 1 << 63


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A read where a slow line would have it. `by`: ns, when the clock counted on; None where it told nothing of it."""

    chunk: Chunk
    by: int | None
    has_time: bool


class Placing:
    """Reads in, in the order of the log; out in order of time, where its clock goes on. `has_time`: whether the one
    given last had a time."""

    def __init__(self) -> None:
        self.has_time = False
        self._waiting: list[_Waiting] = []
        self._told: int | None = None

    @property
    def last(self) -> int:
        """When the read given last came, ns; 0 before the first."""
        return self._told or 0

    def told(self, chunk: Chunk, char: int, has_time: bool) -> Iterator[Chunk]:
        """A read at its time, of octets that take `char` each."""
        if self._told is None:
            yield from self._ahead(chunk.time - len(chunk.octets) * char)
        else:
            yield from self._between(chunk.time)
        self._told, self.has_time = chunk.time, has_time
        yield chunk

    def untold(self, chunk: Chunk, by: int | None, has_time: bool) -> Iterator[Chunk]:
        """One that is laid behind the last."""
        self._waiting.append(_Waiting(chunk, by, has_time))
        if len(self._waiting) > MOST:
            open_until = None if by is None or self._told is None else (self._told + by) // 2
            yield from self._between(open_until)

    def close(self) -> Iterator[Chunk]:
        """Those of which no time comes any more, where they were laid."""
        yield from self._between(None)

    def _ahead(self, begin: int) -> Iterator[Chunk]:
        """Those that wait, before what begins then."""
        waiting, self._waiting = self._waiting, []
        shift = begin - LINE_END - waiting[-1].chunk.time if waiting else 0
        for one in waiting:
            self.has_time = one.has_time
            yield replace(one.chunk, time=one.chunk.time + shift)

    def _between(self, after: int | None) -> Iterator[Chunk]:
        """Those that wait, at most in equal steps from one time to the next, where that is known."""
        waiting, self._waiting = self._waiting, []
        before = self._told or 0
        known = _NEVER if after is None else after
        limits = accumulate((min(known, _NEVER if one.by is None else one.by) for one in reversed(waiting)), min)
        for number, (one, limit) in enumerate(zip(waiting, reversed(list(limits)), strict=True), 1):
            most = before + max(0, limit - before) * number // (len(waiting) + 1)
            self._told = min(one.chunk.time, most)
            self.has_time = one.has_time
            yield one.chunk if one.chunk.time == self._told else replace(one.chunk, time=self._told)
