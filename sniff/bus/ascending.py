"""Many numbers in ascending order, which mostly come in that order: those of rows that are trouble. Pure."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[Any]

_JOINED = 1024
"""Numbers that are held together at least, but for the last ones."""


class Ascending:
    """A set of numbers; 8 octets each."""

    def __init__(self) -> None:
        self._parts: list[Numbers] = []  # none empty, each before the next

    def add(self, numbers: Numbers) -> Numbers:
        """Take some; the places of those that are new."""
        numbers, places = np.unique(numbers, return_index=True)
        if not len(numbers):
            return places
        at = bisect_left(self._parts, int(numbers[0]), key=lambda part: int(part[-1]))
        touched = self._parts[at:]
        if not touched and self._parts and len(self._parts[-1]) < _JOINED:
            at, touched = at - 1, self._parts[-1:]
        first, last = touched[:1], []
        if len(touched) > 1:  # what it reaches into is put together, what lies behind stays
            behind = bisect_right(touched, int(numbers[-1]), key=lambda part: int(part[0]))
            first, last = touched[: max(1, behind)], touched[max(1, behind) :]
        if not first:
            self._parts[at:] = [numbers.astype(np.int64)]
            return places
        known = np.concatenate(first)
        self._parts[at:] = [np.union1d(known, numbers), *last]
        new: Numbers = places[~np.isin(numbers, known, assume_unique=True)]
        return new

    def drop_below(self, least: int) -> None:
        """Let go of all smaller ones."""
        gone = bisect_left(self._parts, least, key=lambda part: int(part[-1]))
        del self._parts[:gone]
        if self._parts and int(self._parts[0][0]) < least:
            self._parts[0] = self._parts[0][np.searchsorted(self._parts[0], least) :].copy()

    def __len__(self) -> int:
        return sum(map(len, self._parts))

    def __iter__(self) -> Iterator[int]:
        for part in self._parts:
            yield from part.tolist()

    def after(self, number: int) -> int | None:
        """The next greater one; None where there is none."""
        at = bisect_right(self._parts, number, key=lambda part: int(part[-1]))
        if at == len(self._parts):
            return None
        part = self._parts[at]
        return int(part[np.searchsorted(part, number, "right")])

    def before(self, number: int) -> int | None:
        """The next smaller one; None where there is none."""
        at = bisect_left(self._parts, number, key=lambda part: int(part[0])) - 1
        if at < 0:
            return None
        part = self._parts[at]
        return int(part[np.searchsorted(part, number) - 1])
