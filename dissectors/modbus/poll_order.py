"""The order in which requests follow one another, which is a master's own: of two masters, each breaks the other's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

_KEPT = 2048  # different neighbours
_LEAST = 3
_ALL = 8192  # requests from the beginning on that are looked at; of all later ones the first _SOME of each _EVERY,
_SOME = 512  # which a master that is given another poll list changes soon enough
_EVERY = 4096

Asked = tuple[int, tuple[str, int | None]]
"""A unit, and what it is asked for, as a poll list has it."""

Neighbours = tuple[Asked, Asked]
"""Two requests, the earlier one first."""


@dataclass(slots=True)
class PollOrder:
    """How often one request came next after another, repeats aside."""

    _count: int = 0
    _newest: Asked | None = None  # None where it was not looked at
    _often: Counter[Neighbours] = field(default_factory=Counter)

    def add(self, asked: Asked) -> None:
        """Take the next request."""
        is_seen = _is_looked_at(self._count)
        self._count += 1
        if is_seen and self._newest is not None:
            self._add_often((self._newest, asked), 1)
        self._newest = asked if is_seen else None

    def looks_at(self, count: int) -> bool:
        """Whether any of the next so many requests is looked at."""
        return _is_looked_at(self._count) or self._count + count > _next_looked_at(self._count)

    def skip(self, count: int) -> None:
        """Take so many requests of which none is looked at."""
        self._count += count
        self._newest = None

    def add_all(self, same: np.ndarray, asked: Sequence[Asked]) -> None:
        """Take requests in a row. `same`: (requests,) int64, the place of each in `asked`, 0 for the first."""
        behind = self._count + len(same) - 1
        if not (_is_looked_at(self._count) and _is_looked_at(behind) and _is_one_look(self._count, behind)):
            for which in same.tolist():
                self.add(asked[which])
            return
        self.add(asked[same[0]])
        two, first, often = np.unique(same[:-1] * len(asked) + same[1:], return_index=True, return_counts=True)
        for at in np.argsort(first).tolist():
            before, after = divmod(int(two[at]), len(asked))
            self._add_often((asked[before], asked[after]), int(often[at]))
        self._count = behind + 1
        self._newest = asked[same[-1]]

    def is_usual(self, before: Asked, after: Asked) -> bool:
        """Whether one master asks so: every second time at least that one of them comes, the other one is beside it."""
        count = self._often.get((before, after), 0)
        behind = sum(often for (one, _), often in self._often.items() if one == before)
        ahead = sum(often for (_, one), often in self._often.items() if one == after)
        return count >= _LEAST and 2 * count >= behind and 2 * count >= ahead

    def _add_often(self, neighbours: Neighbours, count: int) -> None:
        if neighbours in self._often or len(self._often) < _KEPT:
            self._often[neighbours] += count


def _is_looked_at(number: int) -> bool:
    return number < _ALL or number % _EVERY < _SOME


def _next_looked_at(number: int) -> int:
    """The first request from the next multiple on."""
    return (number // _EVERY + 1) * _EVERY


def _is_one_look(first: int, last: int) -> bool:
    """Whether all between two requests that are looked at are so, too."""
    return last < _ALL or first // _EVERY == last // _EVERY
