"""Index of the numbered things that are shown, out of ten million, found bit by bit. Pure.

The things are numbered first … last without holes; both bounds only move up. Without a test every number is shown and
nothing is stored. With a test the numbers that pass are found in small steps, outwards from an anchor (where the user
looks), so that the neighbourhood is there at once and nothing ever waits for a million tests. Where something is known
of many numbers at once (`known`), only those that are doubtful are tested. A number costs an octet.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import accumulate

import numpy as np
import numpy.typing as npt

ACCEPTED, DOUBTFUL = 1, 2
SPAN = 32
"""A look at what is known of a stretch counts as so many tests."""
BLOCK = 1 << 15
"""Numbers that are counted together."""

Known = Callable[[int], tuple[int, npt.NDArray[np.uint8]]]
"""Of a number: what is known of all that are known together with it, and the first of them."""


class Index:
    """The numbers shown, ascending; `index[i]` is the number on line i."""

    def __init__(self, test: Callable[[int], bool] | None = None, anchor: int = 1, known: Known | None = None) -> None:
        self.test = test
        self.first = 1
        self.last = 0
        self._known = known
        self._low = anchor  # tested: _low ≤ number < _high
        self._high = anchor
        self._base = anchor // BLOCK  # of the first block
        self._blocks: list[npt.NDArray[np.bool_]] = []
        self._counts: list[int] = []
        self._sums: list[int] | None = None  # shown before each block, and all
        self._lines: tuple[int, npt.NDArray[np.int64]] | None = None  # places shown in a block that was asked for

    def bound(self, first: int, last: int) -> None:
        """Take new bounds; what lies before `first` is gone."""
        before, (self.first, self.last) = self.first, (first, last)
        if self.test is None:
            return
        self._low = max(self._low, first)
        self._high = max(self._high, self._low)
        if first <= before or not self._blocks:
            return
        gone = min(max(0, first // BLOCK - self._base), len(self._blocks))
        if gone:
            del self._blocks[:gone], self._counts[:gone]
            self._base += gone
        if self._blocks and first // BLOCK == self._base:
            self._blocks[0][: first % BLOCK] = False
            self._counts[0] = int(np.count_nonzero(self._blocks[0]))
        self._sums = self._lines = None

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
        left = count
        while left > 0 and self._high <= self.last:
            left -= self._step_up(self.test, left)
        left = count
        while left > 0 and self._low > self.first:
            left -= self._step_down(self.test, left)

    def _step_up(self, test: Callable[[int], bool], count: int) -> int:
        """Test at most so many; how many that was worth."""
        begin, end, tested = self._high, self.last + 1, count
        if self._known is None:
            end = min(end, begin + count)
            self._put(begin, np.fromiter(map(test, range(begin, end)), bool, end - begin))
        else:
            first, states = self._known(begin)
            states = states[begin - first : end - first]
            doubtful = np.flatnonzero(states == DOUBTFUL)
            if len(doubtful) > count:
                states, doubtful = states[: doubtful[count]], doubtful[:count]
            tested = len(doubtful) + SPAN
            end = begin + len(states)
            self._put(begin, self._decided(test, begin, states, doubtful))
        self._high = end
        return tested

    def _step_down(self, test: Callable[[int], bool], count: int) -> int:
        begin, end, tested = self.first, min(self._low, self.last + 1), count
        if self._known is None:
            begin = max(begin, end - count)
            self._put(begin, np.fromiter(map(test, range(begin, end)), bool, end - begin))
        elif end > begin:
            first, states = self._known(end - 1)
            begin = max(begin, first)
            states = states[begin - first : end - first]
            doubtful = np.flatnonzero(states == DOUBTFUL)
            if len(doubtful) > count:
                cut = int(doubtful[-count - 1]) + 1
                states, doubtful, begin = states[cut:], doubtful[-count:] - cut, begin + cut
            tested = len(doubtful) + SPAN
            self._put(begin, self._decided(test, begin, states, doubtful))
        self._low = begin
        return tested

    @staticmethod
    def _decided(
        test: Callable[[int], bool], begin: int, states: npt.NDArray[np.uint8], doubtful: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.bool_]:
        shown: npt.NDArray[np.bool_] = states == ACCEPTED
        for place in doubtful.tolist():
            shown[place] = test(begin + place)
        return shown

    def _put(self, begin: int, shown: npt.NDArray[np.bool_]) -> None:
        """Numbers from `begin` on, next to those that are known."""
        self._sums = self._lines = None
        if not self._blocks:
            self._base = begin // BLOCK
        while begin // BLOCK < self._base:
            self._blocks.insert(0, np.zeros(BLOCK, bool))
            self._counts.insert(0, 0)
            self._base -= 1
        done = 0
        while done < len(shown):
            number = begin + done
            block, within = number // BLOCK - self._base, number % BLOCK
            while block >= len(self._blocks):
                self._blocks.append(np.zeros(BLOCK, bool))
                self._counts.append(0)
            part = shown[done : done + BLOCK - within]
            self._blocks[block][within : within + len(part)] = part
            self._counts[block] += int(np.count_nonzero(part))
            done += len(part)

    def retest(self, number: int) -> None:
        """Test one number again, because something about it changed."""
        if self.test is None or not self._low <= number < self._high:
            return
        shown = self.test(number)
        block, within = number // BLOCK - self._base, number % BLOCK
        self._counts[block] += int(shown) - int(self._blocks[block][within])
        self._blocks[block][within] = shown
        self._sums = self._lines = None

    @property
    def _before(self) -> list[int]:
        if self._sums is None:
            self._sums = [0, *accumulate(self._counts)]
        return self._sums

    def __len__(self) -> int:
        if self.test is None:
            return max(0, self.last - self.first + 1)
        return self._before[-1]

    def __getitem__(self, position: int) -> int:
        if not 0 <= position < len(self):
            raise IndexError(position)
        if self.test is None:
            return self.first + position
        block = bisect_right(self._before, position) - 1
        if self._lines is None or self._lines[0] != block:
            self._lines = block, np.flatnonzero(self._blocks[block])
        return (self._base + block) * BLOCK + int(self._lines[1][position - self._before[block]])

    def __contains__(self, number: object) -> bool:
        if not isinstance(number, int):
            return False
        if self.test is None:
            return self.first <= number <= self.last
        block = number // BLOCK - self._base
        return 0 <= block < len(self._blocks) and bool(self._blocks[block][number % BLOCK])

    def position(self, number: int) -> int:
        """Line of the first number shown that is not smaller; the length when there is none."""
        if self.test is None:
            return min(max(0, number - self.first), len(self))
        block = number // BLOCK - self._base
        if block < 0:
            return 0
        if block >= len(self._blocks):
            return len(self)
        return self._before[block] + int(np.count_nonzero(self._blocks[block][: number % BLOCK]))

    def nearest(self, number: int) -> int | None:
        """The number shown that is nearest, the later one of two; None when nothing is shown."""
        position = self.position(number)
        around = [self[place] for place in (position, position - 1) if 0 <= place < len(self)]
        return min(around, key=lambda found: abs(found - number), default=None)
