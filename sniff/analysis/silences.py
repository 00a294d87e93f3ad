"""Silences of a bus that is never silent, with everything as before behind them, or that last. Pure, bounded."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from dissectors.findings import Finding, Tally
from dissectors.frame import Event
from dissectors.histogram import Histogram
from dissectors.line import MS, NS_PER_S
from dissectors.words import duration, elapsed
from sniff.analysis.line_rules import LINE_RULES as RULES

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

SILENT_LEAST = 3 * NS_PER_S
SILENT_WAITING = 10 * NS_PER_S
"""The same behind a request: a master may wait so long for an answer."""

SILENT_NOW = 60 * NS_PER_S
"""The same of a silence that lasts: nobody knows yet whether everything goes on as before."""

_NEXT = "whether the master runs and has its supply; the wiring from the bus to this tap"

SILENT_TIMES = 30
SILENT_KEPT = 8
SILENT_EVERY = 1800 * NS_PER_S
SILENT_SHARE = 0.1
"""So many silences may stand out of any bus; more where they are two an hour at most and a small part of the time."""

SILENT_SHOWN = 5
ROWS_AROUND = 50
BREAKS_KEPT = 256


class Silences:
    """Fed every row of one bus. `first`, `now`: ns, begin of the first row and the latest end; `first` None before."""

    def __init__(self) -> None:
        self.first: int | None = None
        self.now = 0
        self._rows = 0
        self._gaps = Histogram()
        self._silences: list[tuple[int, int, int]] = []  # begin, end, rows before
        self._longest = 0  # of all that were long, ns
        self._hole: int | None = None  # ns; no row has ended since
        self._asked = False  # the newest row is a request
        self._broken: deque[int] = deque(maxlen=BREAKS_KEPT)  # rows that end with a break

    def see(self, event: Event, asks: bool) -> None:
        """Take the next row. `asks`: whether a master without an address sent it."""
        if self.first is None:
            self.first = event.start
        else:
            gap = max(0, event.start - self.now)
            self._gaps.add(gap)
            self._see_gap(gap, self._asked, (self.now, event.start, self._rows))
        if self._hole is not None and event.end >= self._hole:  # else it is what the hole ended
            self._hole = None
        self.now = max(self.now, event.end)
        self._asked = asks
        self._rows += 1

    def take(self, starts: npt.NDArray[np.int64], ends: npt.NDArray[np.int64], asks: npt.NDArray[np.bool_]) -> None:
        """Take rows, one or more, behind the first."""
        import numpy as np

        before = np.maximum(np.maximum.accumulate(np.append(self.now, ends[:-1])), self.now)
        gaps = np.maximum(starts - before, 0)
        self._gaps.add_many(gaps)
        for place in np.flatnonzero(gaps >= SILENT_LEAST).tolist():
            asked = bool(asks[place - 1]) if place else self._asked
            if self._hole is not None and (ends[:place] >= self._hole).any():
                self._hole = None
            self._see_gap(int(gaps[place]), asked, (int(before[place]), int(starts[place]), self._rows + place))
        if self._hole is not None and int(ends.max()) >= self._hole:
            self._hole = None
        self.now = max(self.now, int(ends.max()))
        self._asked = bool(asks[-1])
        self._rows += len(starts)

    def see_break(self, no: int) -> None:
        """That row ends with a break: the line is held low behind it, nobody knows for how long."""
        self._broken.append(no)

    def miss(self, time: int) -> None:
        """Octets may be lost at `time`, ns: over a hole nothing is known. Rows that it ended may still come."""
        self._hole = time

    def _see_gap(self, gap: int, asked: bool, silence: tuple[int, int, int]) -> None:
        self._longest = max(self._longest, gap)
        long = gap >= (SILENT_WAITING if asked else SILENT_LEAST)
        if long and self._hole is None and len(self._silences) < 20 * SILENT_KEPT:
            self._silences.append(silence)

    def whole(self) -> list[tuple[int, int, int]]:
        """Silences that stand out so far: begin, end (ns), rows before."""
        usual = self._gaps.quantile(0.98)
        if usual is None or not self._silences:
            return []
        limit = max(SILENT_LEAST, SILENT_TIMES * usual)
        long = [one for one in self._silences if one[1] - one[0] >= limit]
        whole = [one for one in long if one[2] >= ROWS_AROUND and self._rows - one[2] >= ROWS_AROUND // 2]
        if not whole or self._is_its_way(long) or _is_regular([end - begin for begin, end, _ in long]):
            return []
        return whole

    def _is_its_way(self, long: list[tuple[int, int, int]]) -> bool:
        """Whether the bus is silent so often, or so long, that it is no interruption: over a night eight come soon."""
        span, silent = self.now - (self.first or 0), sum(end - begin for begin, end, _ in long)
        is_often = len(long) * SILENT_EVERY > span or silent > SILENT_SHARE * span
        return len(long) > SILENT_KEPT and is_often

    def lasting(self, now: int) -> Finding | None:
        """That nothing came any more up to `now` (ns), for longer than ever before, on a bus that is listened to."""
        usual, silence = self._gaps.quantile(0.98), now - self.now
        if usual is None or self._hole is not None or self._rows < ROWS_AROUND:
            return None
        if silence < max(SILENT_NOW, SILENT_TIMES * usual, 2 * self._longest):
            return None
        tally = Tally()
        tally.add(self.now, self._rows)
        often = silence // max(usual, MS)
        seen = f"not one octet for {duration(silence)} by now, {often} times as long as pauses were here"
        told = tally.found(RULES["LN304"], "bus", seen)
        return replace(told, means=f"{told.means}; or this tap came off the line", next=_NEXT, last=now, lasts=True)

    def findings(self) -> Iterator[Finding]:
        """What there is to say so far."""
        usual, whole = self._gaps.quantile(0.98), self.whole()
        if usual is None or not whole:
            return
        tally = Tally()
        for begin, _, row in whole:
            tally.add(begin, row, row + 1)
        longest = max(end - begin for begin, end, _ in whole)
        at = ", ".join(elapsed(begin - (self.first or 0)) for begin, _, _ in whole[:SILENT_SHOWN])
        at += f" … ({len(whole)} times in all)" if len(whole) > SILENT_SHOWN else ""
        most, often = "up to " if len(whole) > 1 else "", longest // max(usual, MS)
        seen = (
            f"not one octet for {most}{elapsed(longest)}, {often} times as long as pauses are here; from {at} "
            "on, and everything went on as before"
        )
        finding = tally.found(RULES["LN304"], "bus", seen)
        low = sum(row in self._broken for _, _, row in whole)
        yield _held_low(finding, low, len(whole)) if low else finding


def _held_low(finding: Finding, low: int, silences: int) -> Finding:
    """What is found of silences, where some begin with a break."""
    which = ("it" if silences == 1 else "each") + " begins" if low == silences else f"{low} of the {silences} begin"
    means = (
        "the line was held low, or somebody was at its wires: a short circuit, a plug, a driver that does not let go"
    )
    return replace(
        finding,
        seen=f"{finding.seen}; {which} with a break, where the line goes low",
        means=means if low == silences else f"{means}; or {finding.means}",
        next="who was at the wires then; each station taken off in turn, if it comes again",
    )


def _is_regular(spans: list[int]) -> bool:
    """Whether pauses belong to the bus's own rhythm: three or more that are alike."""
    middle = sorted(spans)[len(spans) // 2]
    return len(spans) >= 3 and sum(abs(span - middle) <= 0.25 * middle for span in spans) >= 0.7 * len(spans)
