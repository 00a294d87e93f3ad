"""Times of reads: how long octets were held back, told by when reads came and how much each held. Pure.

A capture that names no adapter may have exact times (a logic analyser's, a simulation's) or be the work of a USB
adapter with a latency timer. Two things tell, neither of them by what the octets mean:

* *Impossible reads.* A read that holds more octets than can have come on the wire since the read before: some of them
  were there before, and were held back. Summed up over a run of reads this gives a lower bound.
* *A grid.* Reads at multiples of one period, at any phase of what is sent: an adapter that hands over what it has when
  its timer runs out. Then each read holds at most what comes in one period, and wherever a period ends inside a frame
  two reads stand exactly one period apart. A capture in which a read is a whole frame has neither, whatever rhythm its
  master keeps.

The bound that is given has a margin: a frame of the USB (1 ms) and the scatter of the reads. Looked at is the begin of
a capture (`LOOKED_AT` reads), so that a file is opened at once however long it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from dissectors.line import MS, NS_PER_S, LineSettings

LOOKED_AT = 2048
"""Reads of a capture that are looked at."""

PERIODS = (64, 50, 40, 32, 25, 20, 16, 12, 10, 8, 6, 5, 4, 3, 2, 1)
"""Periods of latency timers that are tried, ms, the longest first."""

FULL_PACKETS = (62, 64)
"""Octets of a USB packet that is full and does not wait for the timer."""

LEAST_ROUNDED = 3
"""Intervals of which each is a whole number of tenths of milliseconds, which unrounded times hardly give."""

LEAST_INTERVALS = 12
FASTEST = 450
"""ns an octet: half of what it takes at 12 MBd, 11 bits each."""

FEW_INTERVALS, LONG_PERIOD = 5, 10
"""So many intervals are enough when all lie on a grid of so many ms or more, which chance alone hardly does."""

LEAST_SPLITS = 3.0
LEAST_WHOLE = 2
HURRIED_LEAST = 100_000  # ns
HURRIED_SHARE = 20
ON_GRID = 0.85
USB_FRAME = MS
LONGEST_INTERVAL = 1000 * MS  # two clocks drift apart over longer ones
FAST = 0.97  # senders may be 2 % faster than the nominal rate, and stamps are rounded
# ms; times of reads that are over a second wrong are no times, and mean no more with a larger bound
_BOUNDS = (3, 5, 10, 18, 22, 33, 50, 70, 100, 140, 200, 300, 500, 1000)  # ms


@dataclass(frozen=True, slots=True)
class ReadTimes:
    """The first reads of a capture: for each the ns since the read before (−1: not known) and how many octets it held.

    Made by `ReadTimes.of`; the same for any line settings.
    """

    intervals: tuple[int, ...] = ()
    octets: tuple[int, ...] = ()

    @classmethod
    def of(cls, reads: Sequence[tuple[int, int]]) -> ReadTimes:
        """`reads`: (time in ns, octets) in their order; no octets: a hole, after which the time before says nothing."""
        intervals: list[int] = []
        octets: list[int] = []
        before: int | None = None
        for time, count in reads:
            if not count:
                before = None
                continue
            intervals.append(-1 if before is None or time < before else time - before)
            octets.append(count)
            before = time
        return cls(tuple(intervals), tuple(octets))

    @property
    def are_none(self) -> bool:
        """Whether reads came faster than any line brings octets: somebody only put them in order."""
        told = [pair for pair in zip(self.intervals, self.octets, strict=True) if pair[0] >= 0]
        return len(told) >= LEAST_INTERVALS and sum(one for one, _ in told) < FASTEST * sum(many for _, many in told)

    @property
    def told(self) -> int:
        """How many intervals there are, of reads that are not at once."""
        return sum(interval > 0 for interval in self.intervals)

    @property
    def unit(self) -> int:
        """What all intervals are multiples of, ns: 1, 10, 100 … 1 ms; what is finer was rounded away. A second, where
        reads of the same one show that it is not their rhythm.
        """
        known = [interval for interval in self.intervals if interval >= 0]
        at_once = sum(not interval for interval in known)
        if len(known) >= LEAST_ROUNDED and 3 * at_once >= len(known) and not any(one % NS_PER_S for one in known):
            return NS_PER_S
        unit = MS
        for interval in self.intervals:
            while unit > 1 and interval > 0 and interval % unit:
                unit //= 10
        return unit


@dataclass(frozen=True, slots=True)
class HeldBack:
    """What reads say. `latency`: ns by which an octet may have been held back, 0 when nothing speaks against exactness.

    `period`: of the grid, ns, 0 without one. `proved`: ns by which an octet certainly was. `impossible`: how many
    stretches of reads hold more than can have come.
    """

    latency: int = 0
    period: int = 0
    proved: int = 0
    impossible: int = 0


EXACT = HeldBack()


def held_back(reads: ReadTimes, line: LineSettings, bound: int = 0) -> HeldBack:
    """What the reads say on a line with these settings. `bound`: ns that are known to be held back anyhow."""
    worst = _backlogs(reads, line.char, bound + line.char + reads.unit)
    proved = max(worst, default=0)
    hurried = 0 if bound else _hurried(reads, line.char)
    proved = max(proved, hurried)
    period, scatter = _grid(reads, line.char)
    rounded = reads.unit if reads.unit >= MS // 10 and reads.told >= LEAST_ROUNDED else 0
    if not period and not proved:
        return HeldBack(rounded) if rounded else EXACT
    latency = period + USB_FRAME + 2 * scatter + rounded if period else 0
    if proved > latency:
        latency = next((b * MS for b in _BOUNDS if 4 * b * MS >= 5 * proved), _BOUNDS[-1] * MS)
    return HeldBack(latency, period, proved, len(worst))


def _backlogs(reads: ReadTimes, char: int, allowed: int) -> list[int]:
    """Of each stretch that holds more octets than can have come: ns of line time too much, where over `allowed`."""
    found: list[int] = []
    backlog = Backlog(char, allowed)
    for interval, count in zip(reads.intervals, reads.octets, strict=True):
        if backlog.add(interval, count):
            del found[backlog.stretches - 1 :]
            found.append(int(backlog.now))
    return found


def _hurried(reads: ReadTimes, char: int) -> int:
    """ns by which reads came sooner after the one before than their octets take on the line; 0 where few did.

    Where one in twenty comes clearly sooner, the ones before them were late: by a timer of 1 ms on a slow bus, or by a
    computer that wakes now sooner, now later. A backlog of less than a character shows in nothing else.
    """
    pairs = [pair for pair in zip(reads.intervals, reads.octets, strict=True) if pair[0] >= 0]
    least = HURRIED_LEAST + reads.unit
    sooner = [int(FAST * count * char) - interval for interval, count in pairs]
    sooner = sorted(over for over in sooner if over > least)
    if len(sooner) < LEAST_INTERVALS or HURRIED_SHARE * len(sooner) < len(pairs):
        return 0
    return sooner[int(0.95 * (len(sooner) - 1))]


class Backlog:
    """Line time of octets beyond what can have come, ns; summed up over reads until they have caught up.

    `now`: of the present stretch of reads; `worst`: of all; `stretches`: how many went over what is
    `allowed` (ns).
    """

    __slots__ = ("_char", "_most", "allowed", "now", "stretches", "worst")

    def __init__(self, char: int, allowed: int) -> None:
        self._char = char
        self.allowed = allowed
        self._most = 0.0
        self.now = self.worst = 0.0
        self.stretches = 0

    @property
    def is_over(self) -> bool:
        """Whether the present stretch of reads goes over what is allowed."""
        return bool(self._most)

    def add(self, interval: int, octets: int) -> bool:
        """Take a read so many ns after the one before (negative: not known); whether it is worse than before."""
        if interval < 0:
            self.now = self._most = 0.0
            return False
        self.now = max(0.0, self.now + FAST * octets * self._char - interval)
        if not self.now:
            self._most = 0.0
        if self.now <= max(self.allowed, self._most):
            return False
        self.stretches += not self._most
        self._most = self.now
        self.worst = max(self.worst, self.now)
        return True


def _grid(reads: ReadTimes, char: int) -> tuple[int, int]:
    """Period of the grid that reads lie on and how far they scatter about it, ns; (0, 0) for none."""
    pairs = [
        (interval, count)
        for interval, count in zip(reads.intervals, reads.octets, strict=True)
        if 0 < interval <= LONGEST_INTERVAL and count not in FULL_PACKETS
    ]
    if len(pairs) < FEW_INTERVALS:
        return 0, 0
    in_whole_ms = reads.unit == MS  # as people write: multiples of 5 and 10 ms prove nothing
    for ms in PERIODS:
        if (in_whole_ms and ms % 5 == 0) or (len(pairs) < LEAST_INTERVALS and ms < LONG_PERIOD):
            continue
        scatter = _fits(pairs, ms * MS, char)
        if scatter is not None:
            return ms * MS, scatter
    return 0, 0


def _fits(pairs: Sequence[tuple[int, int]], period: int, char: int) -> int | None:
    """How far reads scatter about multiples of `period`; None where that is no latency timer's."""
    tolerance = min(period // 8, max(600_000, period // 16))
    few = pairs[:64]
    if sum(_off(interval, period) <= tolerance for interval, _ in few) < (ON_GRID - 0.15) * len(few):
        return None
    errors = [_off(interval, period) for interval, _ in pairs]
    on_grid = sorted(error for error in errors if error <= tolerance)
    if len(on_grid) < (ON_GRID if len(pairs) >= LEAST_INTERVALS else 1) * len(pairs):
        return None
    longest = period + tolerance + USB_FRAME + char // 2  # an octet that ends in the period began before it
    if sum(FAST * count * char > longest for _, count in pairs) > 0.03 * len(pairs):
        return None  # whole frames: a timer would have cut them
    # Where a period ends inside a frame, two reads stand one period apart.
    expected = sum(count for _, count in pairs) * char / period
    apart = [(interval, count) for interval, count in pairs if abs(interval - period) <= tolerance]
    if expected < LEAST_SPLITS or len(apart) < 0.4 * expected:
        return None
    if not (_ends_anywhere(apart, period, tolerance, char) or _is_whole_elsewhere(pairs, period, tolerance)):
        return None
    return on_grid[int(0.95 * (len(on_grid) - 1))]


def _ends_anywhere(apart: Sequence[tuple[int, int]], period: int, tolerance: int, char: int) -> bool:
    """Whether reads one period apart end anywhere in a frame, so that they hold now this many octets, now that.

    On a slow bus what comes in a whole period is as good as always as many octets: there those tell that hold less,
    the ends of frames. Octets read one by one as they come stand apart by what they take on the line, not by a timer.
    """
    slow = period < 6 * char
    short = period - tolerance - (char // 4 if slow else char)
    ends = Counter(count for _, count in apart if count * char < short)
    if 10 * ends.total() >= len(apart):
        if slow and 10 * ends.total() <= 9 * len(apart):
            return True
        if len(ends) >= 3 and max(ends.values()) <= 0.7 * ends.total():
            return True
    counts = Counter(count for _, count in apart)
    if len(counts) < (3 if period > 3 * char else 2) or max(counts.values()) > 0.6 * len(apart):
        return False
    as_sent = sum(abs(interval - count * char) <= max(tolerance, char // 4) for interval, count in apart)
    return 2 * as_sent <= len(apart)


def _is_whole_elsewhere(pairs: Sequence[tuple[int, int]], period: int, tolerance: int) -> bool:
    """Whether reads one period apart hold together what others held alone: one frame, cut where the period ended. Where
    a master keeps a rhythm that goes well with the period, it is cut at the same place each time."""
    follows = [abs(interval - period) <= tolerance for interval, _ in pairs]
    alone, together = Counter[int](), Counter[int]()
    for place, (_, count) in enumerate(pairs):
        if follows[place]:
            together[pairs[place - 1][1] + count if place and not follows[place - 1] else 0] += 1
        elif place + 1 == len(pairs) or not follows[place + 1]:
            alone[count] += 1
    cut = sum(times for size, times in together.items() if alone[size] >= LEAST_WHOLE)
    return cut >= FEW_INTERVALS and 4 * cut >= 3 * together.total()


def _off(interval: int, period: int) -> int:
    """Distance to the nearest multiple of the period, from one on."""
    times = max(1, (interval + period // 2) // period)
    return abs(interval - times * period)
