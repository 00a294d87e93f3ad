"""The bus's own rhythm: how often the same frame comes, and how often anybody speaks at all. Pure, bounded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from dissectors.histogram import Histogram
from dissectors.line import MS, NS_PER_S

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from dissectors.columns import Masks, Octets, Times
    from sniff.engine.table import Table

MOST_ROUNDS = 300
STEADY = 0.5
NEAR = 0.05
QUIET = NS_PER_S // 2
"""A bus that was silent for so long begins anew to speak; trouble that was away for so long, too."""
BOUTS_LEAST = 4


@dataclass(slots=True)
class _Round:
    """One frame that comes again and again: when first and last, and how often after the first time.

    `squares`: sum of the squares of the intervals between, in whole ms.
    """

    first: int
    last: int
    count: int = 0
    squares: int = 0

    def again(self, start: int, hole: int | None) -> None:
        """It came once more. `hole`: ns, of the latest; over it there is no interval."""
        if hole is not None and self.last < hole <= start:
            self.first += start - self.last
            self.last = start
            return
        self.count += 1
        self.squares += ((start - self.last) // MS) ** 2
        self.last = start

    @property
    def is_steady(self) -> bool:
        """Whether it keeps a rhythm: intervals scatter by less than half, as those of a poll do that is missed now and
        then; what comes at random scatters by the whole."""
        every = (self.last - self.first) / MS / self.count
        return self.squares / self.count < (1 + STEADY * STEADY) * every * every


class Rounds:
    """Fed the good frames of a bus; the first MOST_ROUNDS different ones are followed."""

    def __init__(self) -> None:
        self._rounds: dict[bytes, _Round] = {}
        self._by_mark: dict[int, _Round] = {}  # the same, as far as columns have asked
        self._hole: int | None = None

    def miss(self, time: int) -> None:
        """Octets may be lost at `time`, ns. Rows that it ended may still come."""
        self._hole = time

    def see(self, octets: bytes, start: int) -> None:
        """Take a frame. `start`: ns."""
        known = self._rounds.get(octets)
        if known is not None:
            known.again(start, self._hole)
        elif len(self._rounds) < MOST_ROUNDS:
            self._rounds[octets] = _Round(start, start)

    def take(self, table: Table, places: Times) -> None:
        """Take the frames at some places of a table, ascending."""
        import numpy as np

        from dissectors.fingerprints import LONGEST

        frames = table.frames.take(places)
        if not len(frames):
            return
        if int(frames.length.max()) > LONGEST or int(frames.length.min()) < 1:
            for begin, length, start in zip(
                frames.offset.tolist(), frames.length.tolist(), frames.start.tolist(), strict=True
            ):
                self.see(table.octets[begin : begin + length].tobytes(), start)
            return
        marks = _marks(table.octets, frames.offset, frames.length.astype(np.int64))
        order = np.argsort(marks, kind="stable")
        held = marks[order]
        begins = np.flatnonzero(np.append(True, held[1:] != held[:-1]))
        ends = np.append(begins[1:], len(held))
        firsts, lasts = order[begins], order[ends - 1]
        if len(self._rounds) < MOST_ROUNDS:
            chosen = np.argsort(firsts)  # in the order of first sight
        else:
            self._mark()
            known = np.array(sorted(self._by_mark), np.uint64)
            at = np.minimum(np.searchsorted(known, held[begins]), max(0, len(known) - 1))
            chosen = np.flatnonzero(known[at] == held[begins]) if len(known) else np.zeros(0, np.int64)
        for group in chosen.tolist():
            first, times = int(firsts[group]), int(ends[group] - begins[group])
            begin = int(frames.offset[first])
            octets = table.octets[begin : begin + int(frames.length[first])].tobytes()
            self.see(octets, int(frames.start[first]))
            one = self._rounds.get(octets)
            if times > 1 and one is not None:
                starts = frames.start[order[int(begins[group]) : int(ends[group])]]
                if self._hole is not None and one.last < self._hole <= int(starts[-1]):  # rows before it and behind it
                    for start in starts[1:].tolist():
                        one.again(start, self._hole)
                    continue
                one.count += times - 1
                one.squares += int((((starts[1:] - starts[:-1]) // MS) ** 2).sum())
                one.last = int(frames.start[lasts[group]])

    def _mark(self) -> None:
        """Say what columns know each of the frames by."""
        import numpy as np

        from dissectors.fingerprints import LONGEST

        if len(self._by_mark) == len(self._rounds):
            return
        for octets, one in self._rounds.items():
            held = np.frombuffer(octets, np.uint8)
            if 0 < len(held) <= LONGEST:
                mark = _marks(held, np.zeros(1, np.int64), np.array([len(held)], np.int64))
                self._by_mark[int(mark[0])] = one

    def is_own(self, interval: int) -> bool:
        """Whether something on this bus comes at that interval (ns) anyhow, or at a half or a third of it."""
        for one in self._rounds.values():
            if one.count >= 4 and one.is_steady:
                every = (one.last - one.first) / one.count
                if any(abs(interval - times * every) <= NEAR * interval for times in (1, 2, 3)):
                    return True
        return False


class Bouts:
    """When the bus begins to speak again after a silence that nobody waited in: trouble shows only where there are
    octets. Fed every row."""

    def __init__(self) -> None:
        self._now = 0
        self._begun: int | None = None
        self._is_at_rest = False  # the newest row is good, and no request
        self._every = Histogram()

    def see(self, start: int, end: int, at_rest: bool) -> None:
        """Take the next row; ns. `at_rest`: whether it is good and asks for nothing."""
        if self._is_at_rest and start - self._now >= QUIET:
            self._begin(start)
        self._now, self._is_at_rest = max(self._now, end), at_rest

    def take(self, starts: Times, ends: Times, at_rest: Masks) -> None:
        """Take rows, one or more."""
        import numpy as np

        before = np.maximum(np.maximum.accumulate(np.append(self._now, ends[:-1])), self._now)
        rested = np.append(self._is_at_rest, at_rest[:-1])
        for start in starts[rested & (starts - before >= QUIET)].tolist():
            self._begin(start)
        self._now, self._is_at_rest = max(self._now, int(ends.max())), bool(at_rest[-1])

    def is_own(self, interval: int) -> bool:
        """Whether the bus begins to speak at that interval, ns."""
        low, median, high = (self._every.quantile(part) for part in (0.25, 0.5, 0.75))
        if self._every.count < BOUTS_LEAST or low is None or median is None or high is None:
            return False
        return high - low <= 2 * NEAR * median and abs(interval - median) <= NEAR * interval

    def _begin(self, start: int) -> None:
        if self._begun is not None:
            self._every.add(max(0, start - self._begun))
        self._begun = start


def _marks(octets: Octets, begins: Times, lengths: Times) -> npt.NDArray[np.uint64]:
    from dissectors.fingerprints import fingerprints, gathered

    return fingerprints(*gathered(octets, begins, lengths), lengths)
