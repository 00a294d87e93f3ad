"""Which of a million numbered things are shown: a list of numbers that is found bit by bit. Pure.

The things are numbered first … last without holes; both bounds only move up. Without a test every number is shown and
nothing is stored. With a test the numbers that pass are found in small steps, outwards from an anchor (where the user
looks), so that the neighbourhood is there at once and nothing ever waits for a million tests.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Callable


class Index:
    """The numbers shown, ascending; `index[i]` is the number on line i."""

    def __init__(self, test: Callable[[int], bool] | None = None, anchor: int = 1) -> None:
        self.test = test
        self.first = 1
        self.last = 0
        self._before = array("q")  # found before the anchor, descending: grows at its end
        self._after = array("q")  # found from the anchor on, ascending
        self._low = anchor  # tested: _low ≤ number < _high
        self._high = anchor

    def bound(self, first: int, last: int) -> None:
        """Take new bounds; what lies before `first` is gone."""
        self.first, self.last = first, last
        if self.test is None:
            return
        self._low = max(self._low, first)
        self._high = max(self._high, self._low)
        while self._before and self._before[-1] < first:
            self._before.pop()
        if not self._before and self._after and self._after[0] < first:
            del self._after[: bisect_left(self._after, first)]

    @property
    def pending(self) -> int:
        """How many numbers are still to be tested."""
        if self.test is None:
            return 0
        return max(0, self.last + 1 - self._high) + max(0, min(self._low, self.last + 1) - self.first)

    def step(self, count: int = 256) -> None:
        """Test up to `count` numbers on each side."""
        if self.test is None:
            return
        test = self.test
        stop = min(self.last + 1, self._high + count)
        while self._high < stop:
            if test(self._high):
                self._after.append(self._high)
            self._high += 1
        stop = max(self.first, self._low - count)
        while self._low > stop:
            self._low -= 1
            if test(self._low):
                self._before.append(self._low)

    def retest(self, number: int) -> None:
        """Test one number again, because something about it changed."""
        if self.test is None or not self._low <= number < self._high:
            return
        position = self.position(number)
        shown = position < len(self) and self[position] == number
        if self.test(number) == shown:
            return
        split = len(self._before)
        if shown:
            if position < split:
                del self._before[split - 1 - position]
            else:
                del self._after[position - split]
        elif position < split:
            self._before.insert(split - position, number)
        else:
            self._after.insert(position - split, number)

    def __len__(self) -> int:
        if self.test is None:
            return max(0, self.last - self.first + 1)
        return len(self._before) + len(self._after)

    def __getitem__(self, position: int) -> int:
        if not 0 <= position < len(self):
            raise IndexError(position)
        if self.test is None:
            return self.first + position
        split = len(self._before)
        return self._before[split - 1 - position] if position < split else self._after[position - split]

    def __contains__(self, number: object) -> bool:
        if not isinstance(number, int):
            return False
        position = self.position(number)
        return position < len(self) and self[position] == number

    def position(self, number: int) -> int:
        """Line of the first number shown that is not smaller; the length when there is none."""
        if self.test is None:
            return min(max(0, number - self.first), len(self))
        if self._after and number >= self._after[0]:
            return len(self._before) + bisect_left(self._after, number)
        return len(self._before) - bisect_left(self._before, -number + 1, key=lambda found: -found)

    def nearest(self, number: int) -> int | None:
        """The number shown that is nearest, the later one of two; None when nothing is shown."""
        position = self.position(number)
        around = [self[place] for place in (position, position - 1) if 0 <= place < len(self)]
        return min(around, key=lambda found: abs(found - number), default=None)
