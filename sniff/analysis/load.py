"""The load of a bus and how much of it is trouble, by second; mergeable."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from dissectors.frame import Frame
from dissectors.line import NS_PER_S, LineSettings
from sniff.analysis.holes import Holes
from sniff.engine.engine import Row
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from sniff.engine.table import Table

MOST_AT_ONCE = 100_000
"""Seconds that a table may span to be counted in one go."""

ON_ITS_WAY = NS_PER_S
"""ns that what was heard may take until it is counted."""

LEAST_HEARD = 0.1
"""Of a stretch of time of which nobody heard more than that, a chart shows no load."""

KEPT_SECONDS = 86_400
"""Seconds that are known one by one; a day of them takes some 20 MB."""


@dataclass(slots=True)
class Second:
    """One second of a bus. `busy`: ns with octets on the wire, as the octets' number gives it."""

    busy: int = 0
    octets: int = 0
    frames: int = 0
    damaged: int = 0
    noise: int = 0  # octets

    def merge(self, other: Second) -> Second:
        """Both together, as a new value."""
        return Second(
            self.busy + other.busy,
            self.octets + other.octets,
            self.frames + other.frames,
            self.damaged + other.damaged,
            self.noise + other.noise,
        )


@dataclass(slots=True)
class Load:
    """Totals, and the last seconds one by one: the newest `kept` of them, and up to a sixteenth more. What nobody heard
    (`holes`) is no time of which a share is told."""

    line: LineSettings
    total: Second = field(default_factory=Second)
    seconds: dict[int, Second] = field(default_factory=dict)
    first: int | None = None  # ns
    last: int | None = None
    kept: int = KEPT_SECONDS
    holes: Holes = field(default_factory=Holes)

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line."""
        if event.kind.is_hole:
            self.holes.miss(event, self.line.char)

    def add(self, row: Row) -> None:
        """Count one row; what a search heard with other settings is no load."""
        if row.searched is not None:
            return
        event = row.event
        self.holes.see(event.start, event.end)
        self.first = event.start if self.first is None else min(self.first, event.start)
        self.last = event.end if self.last is None else max(self.last, event.end)
        number = event.end // NS_PER_S
        second = self._second(number)
        octets = len(event.octets)
        busy = octets * self.line.char
        self.total.busy += busy
        late = min(busy, event.end - number * NS_PER_S)
        second.busy += late
        left, before = busy - late, number - 1
        while left > 0:  # it began in a second before
            of_it = min(left, NS_PER_S) if before * NS_PER_S > event.start else left
            self._second(before).busy += of_it
            left, before = left - of_it, before - 1
        for part in (self.total, second):
            part.octets += octets
            if isinstance(event, Frame):
                part.frames += 1
                part.damaged += not event.ok
            else:
                part.noise += octets

    def add_table(self, table: Table) -> None:
        """Count rows; the same as one after the other."""
        import numpy as np

        heard = table.heard
        starts, ends = table.frames.start[heard], table.frames.end[heard]
        if not len(ends):
            return
        octets, is_frame, ok = table.frames.length[heard], table.is_frame[heard], table.good[heard]
        numbers = ends // NS_PER_S
        base = int(numbers.min()) - 1
        early = octets.astype(np.int64) * self.line.char - (ends - numbers * NS_PER_S)  # of the second before
        if int(numbers.max()) - base > MOST_AT_ONCE or int(early.max()) > NS_PER_S:  # times that jump, rows of seconds
            for output in table.outputs():
                for row in output.rows:
                    self.add(row)
            return
        self.holes.take(starts, ends)
        self.first = int(starts.min()) if self.first is None else min(self.first, int(starts.min()))
        self.last = int(ends.max()) if self.last is None else max(self.last, int(ends.max()))
        places, least = numbers - base, int(numbers.max()) - base + 1
        begun = np.flatnonzero(early > 0)
        noise = np.flatnonzero(~is_frame)

        def summed(at: npt.NDArray[np.int64], values: npt.NDArray[Any] | None = None) -> npt.NDArray[np.int64]:
            whole: npt.NDArray[np.int64] = np.bincount(at, values, least).astype(np.int64)
            return whole  # exact: a second has less than 2**53 ns

        carried = summed(places, octets)
        busy = carried * self.line.char
        busy += summed(places[begun] - 1, early[begun]) - summed(places[begun], early[begun])
        frames = summed(places[is_frame]) if len(noise) else summed(places)
        columns = busy, carried, frames, summed(places[is_frame & ~ok]), summed(places[noise], octets[noise])
        self.total = self.total.merge(Second(*(int(column.sum()) for column in columns)))
        for number, counts in enumerate(zip(*(column.tolist() for column in columns), strict=True), base):
            if not any(counts):
                continue
            known, more = self.seconds.get(number), Second(*counts)
            if known is None:
                self._second(number)  # makes room
                self.seconds[number] = more
            else:
                self.seconds[number] = known.merge(more)

    def merge(self, other: Load) -> Load:
        """Both together, as a new value; of the seconds the newest are kept."""
        seconds = {
            number: self.seconds.get(number, Second()).merge(other.seconds.get(number, Second()))
            for number in sorted(self.seconds.keys() | other.seconds.keys())[-self.kept :]
        }
        firsts = [time for time in (self.first, other.first) if time is not None]
        lasts = [time for time in (self.last, other.last) if time is not None]
        first, last = min(firsts, default=None), max(lasts, default=None)
        holes = self.holes.merge(other.holes)
        return Load(self.line, self.total.merge(other.total), seconds, first, last, self.kept, holes)

    def _second(self, number: int) -> Second:
        second = self.seconds.get(number)
        if second is None:
            second = self.seconds[number] = Second()
            if len(self.seconds) > self.kept + self.kept // 16:  # many at once: each time costs a look at all
                for old in sorted(self.seconds)[: len(self.seconds) - self.kept]:
                    del self.seconds[old]
                second = self.seconds.setdefault(number, second)
        return second

    def share(self, over: int = 10, now: int | None = None) -> float:
        """Bus load, 0 … 1, over the last `over` seconds up to the newest event. `now`: of a bus that is listened to,
        ns: up to then, where it has been silent for longer than what was heard may be on its way."""
        if self.last is None or self.first is None:
            return 0.0
        end = self.last if now is None or now - self.last <= ON_ITS_WAY else now
        newest = end // NS_PER_S
        numbers = range(max(newest - over + 1, self.first // NS_PER_S), newest + 1)
        busy = sum(self.seconds[number].busy for number in numbers if number in self.seconds)
        begin = max(self.first, numbers.start * NS_PER_S)
        return min(1.0, busy / max(end - begin - self.holes.within(begin, end, now), self.line.char))

    def share_of(self, part: Second, start: int, end: int) -> float:
        """Bus load, 0 … 1, of a stretch (ns) whose seconds together are `part`; only what the capture covers counts."""
        return min(1.0, part.busy / max(self.heard_of(start, end), self.line.char))

    def drawn(self, busy: int, start: int, end: int) -> float | None:
        """What a chart shows of a stretch in which the line was busy for so long (all ns), 0 … 1: of its whole time but
        what nobody heard; None where that is nearly all."""
        heard = end - start - self.holes.within(start, end)
        return min(1.0, busy / heard) if heard > LEAST_HEARD * (end - start) else None

    def heard_of(self, start: int, end: int) -> int:
        """How much of a stretch (ns) the capture covers, from the first octet to the last without its holes, ns."""
        if self.last is None or self.first is None:
            return 0
        start, end = max(start, self.first), min(end, self.last)
        return max(0, end - start - self.holes.within(start, end))

    def overall(self) -> float:
        """Bus load, 0 … 1, over the whole capture."""
        if self.last is None or self.first is None or self.last <= self.first:
            return 0.0
        return min(1.0, self.busy / max(self.listened, self.line.char))

    @property
    def busy(self) -> int:
        """ns with octets on the wire, lost ones that were counted among them."""
        return self.total.busy + self.holes.counted

    @property
    def listened(self) -> int:
        """ns from the first octet to the last of which it is known how busy the bus was."""
        if self.last is None or self.first is None:
            return 0
        return max(0, self.last - self.first - self.holes.total + self.holes.counted)
