"""The rhythm of a master: whether it sends by the clock, so that its next request says nothing of an answer.

    request ── answer ── pause ── request        the pause is steady: it goes on when it has the answer
    request ─────── cycle ─────── request        the cycle is steady, however long the answer took: it has a clock

It is told of the newest turns, by how far eight in ten of their times lie apart: a few of another kind change nothing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from dissectors.histogram import width
from dissectors.line import MS

TURNS_KEPT: Final = 64
"""Turns of a master, of which the newest are compared."""

_LEAST: Final = 16
_DIFFER: Final = 2 * MS  # nothing is told of answers that take all the same time
_STEADIER: Final = 4  # so many times less than the answers the cycles of a clock differ


@dataclass(slots=True)
class Rhythm:
    """`turns`: of answered requests, from their begin to that of the next request, and to the answer's end; ns."""

    turns: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=TURNS_KEPT))

    @property
    def is_by_the_clock(self) -> bool:
        """Whether from one request to the next takes as long however long the answer takes."""
        if len(self.turns) < _LEAST:
            return False
        answers = width(sorted(answer for _, answer in self.turns))
        return answers >= _DIFFER and _STEADIER * width(sorted(cycle for cycle, _ in self.turns)) <= answers
