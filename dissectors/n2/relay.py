"""A relay, or a slow echo, that gives each command again: the same distance always, sooner than any master repeats."""

from __future__ import annotations

from typing import Final

from dissectors.n2.masters import HASTE

_ENOUGH: Final = 2
"""Commands in a row that came twice, as far apart, and were answered then."""


class Relay:
    """Fed the answered commands; total. `tolerance`: ns by which two distances may differ."""

    __slots__ = ("_count", "_gap", "_tolerance")

    def __init__(self, tolerance: int) -> None:
        self._tolerance = tolerance
        self._gap, self._count = 0, 0

    def see_answered(self, attempt: int, gap: int | None) -> None:
        """A command was answered: which attempt, and how long after the one before it came."""
        if attempt != 2 or gap is None or gap >= HASTE:
            self.forget()
        elif self._count and self._is_same(gap):
            self._count += 1
        else:
            self._gap, self._count = gap, 1

    def forget(self) -> None:
        """A command was answered that came once."""
        self._count = 0

    def repeats_after(self, gap: int) -> bool:
        """Whether a command that comes again `gap` ns behind itself is given again, not repeated."""
        return self._count >= _ENOUGH and self._is_same(gap)

    def _is_same(self, gap: int) -> bool:
        return abs(gap - self._gap) <= self._tolerance
