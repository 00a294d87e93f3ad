"""The order in which requests follow one another, which is a master's own: of two masters, each breaks the other's."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

_KEPT = 2048  # different neighbours
_LEAST = 3

Asked = tuple[int, tuple[str, int | None]]
"""A unit, and what it is asked for, as a poll list has it."""

Neighbours = tuple[Asked, Asked]
"""Two requests, the earlier one first."""


@dataclass(slots=True)
class PollOrder:
    """How often one request came next after another, repeats aside."""

    newest: Asked | None = None
    _often: Counter[Neighbours] = field(default_factory=Counter)

    def add(self, asked: Asked) -> None:
        """Take the next request."""
        if self.newest is not None:
            self.add_often((self.newest, asked), 1)
        self.newest = asked

    def add_often(self, neighbours: Neighbours, count: int) -> None:
        """Take so many of the same two in a row; the newest request of all is for the caller to set."""
        if neighbours in self._often or len(self._often) < _KEPT:
            self._often[neighbours] += count

    def is_usual(self, before: Asked, after: Asked) -> bool:
        """Whether one master asks so: every second time at least that one of them comes, the other one is beside it."""
        count = self._often.get((before, after), 0)
        behind = sum(often for (one, _), often in self._often.items() if one == before)
        ahead = sum(often for (_, one), often in self._often.items() if one == after)
        return count >= _LEAST and 2 * count >= behind and 2 * count >= ahead
