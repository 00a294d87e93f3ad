"""Holes of a capture: stretches of time in which nobody heard the bus. Pure, bounded, mergeable.

What was not heard is neither silence nor a pause of the master: no share of the time and no interval counts it.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from sniff.engine.session import LineEvent, LineEventKind

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from dissectors.columns import Masks, Times

KEPT = 16_384
"""Holes that are known one by one; of more, the newest are, and how long all were together."""


@dataclass(slots=True)
class _Open:
    """A hole that no row has followed yet. `time`: of its first event; `begin`, `end`: ns, between which nobody heard,
    None where that reaches to the row before, and to the row behind. `is_counted`: it is octets that somebody counted.
    """

    time: int
    begin: int | None
    end: int | None
    is_counted: bool

    def go_on(self, other: _Open) -> None:
        """Take another that follows it without a row between."""
        self.begin = None if self.begin is None or other.begin is None else min(self.begin, other.begin)
        self.end = other.end
        self.is_counted = self.is_counted and other.is_counted


@dataclass(slots=True)
class Holes:
    """Fed the holes and the rows of one bus. `total`: ns, of all of them; `begins`, `ends`: ns, of those kept.

    A hole reaches from the row before to the row behind it at most. A port was away from when it went until it came
    back; of lost octets nobody knows when they came, but of those that were counted for how long the line was busy with
    them (`counted`, ns of `total`).
    """

    total: int = 0
    counted: int = 0
    begins: list[int] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)
    first: int | None = None  # ns, begin of the first row
    last: int | None = None  # ns, end of the latest
    _open: _Open | None = None
    _early: _Open | None = None  # that before the first row, which a part of a capture may begin with

    def miss(self, event: LineEvent, char: int | None = None) -> None:
        """Take a hole. `char`: ns that an octet takes; None: it does not matter that lost ones were counted."""
        hole = _Open(event.time, None, event.time, False)
        if event.kind is LineEventKind.UNPLUGGED:
            hole.begin, hole.end = event.time, None
        elif event.kind is LineEventKind.DROPPED and event.count > 0 and char is not None:
            hole.begin, hole.is_counted = event.time - event.count * char, True
        if self._open is None:
            self._open = hole
        elif event.kind is LineEventKind.REPLUGGED:
            self._open.end = hole.end
        else:
            self._open.go_on(hole)

    def see(self, start: int, end: int) -> None:
        """Take the next row; ns."""
        if self._open is not None and end >= self._open.time:  # else it is what the hole ended
            self._close(start)
        self._reach(start, end)

    def take(self, starts: Times, ends: Times) -> None:
        """Take rows, one or more."""
        if self._open is not None:
            import numpy as np

            behind = np.flatnonzero(ends >= self._open.time)
            if len(behind):
                at = int(behind[0])
                if at:
                    self._reach(int(starts[0]), int(ends[:at].max()))
                self._close(int(starts[at]))
        self._reach(int(starts[0]), int(ends.max()))

    def within(self, begin: int, end: int, now: int | None = None) -> int:
        """How much of a stretch was not heard, ns. `now`: ns, of a bus that is listened to: up to when a hole lasts."""
        first, after = bisect_right(self.ends, begin), bisect_left(self.begins, end)
        missed = sum(
            min(one_end, end) - max(one_begin, begin)
            for one_begin, one_end in zip(self.begins[first:after], self.ends[first:after], strict=True)
        )
        if self._open is not None and self.last is not None and now is not None:
            lasts = self._bounds(now)
            missed += max(0, min(lasts[1], end) - max(lasts[0], begin))
        return missed

    def lie_between(self, begin: int, end: int) -> bool:
        """Whether there was one between two rows that began then, ns."""
        return bisect_right(self.ends, begin) < bisect_right(self.ends, end)

    def are_between(self, begins: Times, ends: Times) -> Masks:
        """The same of many."""
        import numpy as np

        if not self.ends:
            return np.zeros(len(begins), bool)
        known: npt.NDArray[np.int64] = np.array(self.ends, np.int64)
        apart: Masks = known.searchsorted(begins, "right") < known.searchsorted(ends, "right")
        return apart

    def before(self, time: int, near: int) -> int:
        """For how long nobody had heard anything at a time, where a hole ended so near to it; ns."""
        at = bisect_right(self.ends, time) - 1
        return time - self.begins[at] if at >= 0 and time - self.ends[at] <= near else 0

    def after(self, time: int, near: int) -> int:
        """For how long nobody heard anything from a time on, where a hole began so near to it; ns."""
        at = bisect_left(self.begins, time)
        return self.ends[at] - time if at < len(self.begins) and self.begins[at] - time <= near else 0

    def merge(self, later: Holes) -> Holes:
        """With those of a later stretch of the same bus, as a new value."""
        open_, early = self._open, later._early if later.first is not None else later._open
        first = open_ or early
        known = None if first is None else replace(first)
        if known is not None and open_ is not None and early is not None:
            known.go_on(early)
        whole = replace(self, begins=[*self.begins], ends=[*self.ends], _open=known)
        if later.first is None or later.last is None:
            return whole
        if whole._open is not None:
            whole._close(later.first)
        both = sorted(zip(whole.begins + later.begins, whole.ends + later.ends, strict=True))[-KEPT:]
        whole.total, whole.counted = whole.total + later.total, whole.counted + later.counted
        whole.begins, whole.ends = [begin for begin, _ in both], [end for _, end in both]
        whole._reach(later.first, later.last)
        whole._open = later._open
        return whole

    def _reach(self, start: int, end: int) -> None:
        if self.last is None:
            self.first, self.last = start, end
        else:
            self.last = max(self.last, end)

    def _bounds(self, start: int) -> tuple[int, int]:
        """Where the hole that is open begins and ends, if the row behind it begins at `start`."""
        assert self._open is not None
        assert self.last is not None
        begin = self.last if self._open.begin is None else max(self.last, self._open.begin)
        return begin, max(begin, start if self._open.end is None else min(self._open.end, start))

    def _close(self, start: int) -> None:
        assert self._open is not None
        if self.last is None:
            self._early = self._open
        else:
            begin, end = self._bounds(start)
            self.total += end - begin
            self.counted += end - begin if self._open.is_counted else 0
            self.begins.append(begin)
            self.ends.append(end)
            if len(self.begins) > KEPT + KEPT // 16:
                del self.begins[:-KEPT], self.ends[:-KEPT]
        self._open = None
