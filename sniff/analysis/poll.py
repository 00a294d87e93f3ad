"""One entry of the master's programme: what is asked of a station again and again, how often, with which success."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from dissectors.histogram import Histogram
from dissectors.line import NS_PER_S
from dissectors.questions import Question
from dissectors.tracker import Verdict
from sniff.analysis.holes import Holes

MOST_SLICES = 256
"""Stretches of time in which the requests of one entry are counted; beyond it each becomes twice as long."""

ANSWERS = frozenset((Verdict.ANSWERED, Verdict.RETRY))
TIMED = ANSWERS | {Verdict.EXCEPTION}
UNASKED = frozenset((Verdict.DATA, Verdict.LATE, Verdict.ECHO, Verdict.UNSOLICITED, Verdict.ANSWERED_TWICE))
"""Transactions that are no request of their own."""


class PollKey(NamedTuple):
    """Which entry. `source`: who asks, None where frames do not say; `station`: None for all; `kind`: of request."""

    source: int | None
    station: int | None
    kind: str
    question: Question


@dataclass(slots=True)
class Slices:
    """How often something happened in each stretch of time; the same whatever parts it is put together from.

    `width`: ns of a stretch, a second times a power of two; `counts`: by number of the stretch, time // width.
    """

    width: int = NS_PER_S
    counts: dict[int, int] = field(default_factory=dict)

    def add(self, time: int, count: int = 1) -> None:
        """Count what happened at a time, ns."""
        self.reach(time, time)
        place = time // self.width
        self.counts[place] = self.counts.get(place, 0) + count

    def reach(self, first: int, last: int) -> None:
        """Make the stretches long enough to hold times from `first` to `last` too, ns."""
        held = [place * self.width for place in (min(self.counts), max(self.counts))] if self.counts else []
        first, last = min([first, *held]), max([last, *held])
        while last // self.width - first // self.width >= MOST_SLICES:
            self._widen()

    def merge(self, other: Slices) -> Slices:
        """Both together, as a new value."""
        whole = Slices(self.width, dict(self.counts))
        for place, count in other.counts.items():
            whole.add(place * other.width, count)
        while whole.width < other.width:
            whole._widen()
        return whole

    def _widen(self) -> None:
        self.width *= 2
        halved: dict[int, int] = {}
        for place, count in self.counts.items():
            halved[place // 2] = halved.get(place // 2, 0) + count
        self.counts = halved


@dataclass(slots=True)
class Poll:
    """All requests of one entry. Times are ns.

    `asked`: requests, repeats not among them (`repeats`); `verdicts`: of both; `late`: answers that came too late, to
    requests that stand in `verdicts` as without. `first`, `last`: begin of the first and of the last request;
    `newest`: of the last that is no repeat. `every`: from one request to the next, without repeats; `between`: with
    them; neither over a hole. `latency`: of answers. `slices`: how many were asked when, without repeats.
    """

    key: PollKey
    asked: int = 0
    repeats: int = 0
    late: int = 0
    verdicts: Counter[Verdict] = field(default_factory=Counter)
    first: int | None = None
    last: int | None = None
    begun: int | None = None  # the first that is no repeat
    newest: int | None = None
    every: Histogram = field(default_factory=Histogram)
    between: Histogram = field(default_factory=Histogram)
    latency: Histogram = field(default_factory=Histogram)
    slices: Slices = field(default_factory=Slices)
    request: int = 0  # number of the row of the last request

    def add(
        self, start: int, attempt: int, verdict: Verdict, latency: int | None, request: int, holes: Holes | None = None
    ) -> None:
        """Take a request that closed. `holes`: over which there is no interval, since requests may be missing."""
        self.verdicts[verdict] += 1
        self.request = request
        if self.last is not None and not _are_apart(self.last, start, holes):
            self.between.add(start - self.last)
        self.first = start if self.first is None else self.first
        self.last = start
        if attempt > 1:
            self.repeats += 1
        else:
            self.asked += 1
            if self.newest is not None and not _are_apart(self.newest, start, holes):
                self.every.add(start - self.newest)
            self.begun = start if self.begun is None else self.begun
            self.newest = start
            self.slices.add(start)
        if latency is not None and verdict in TIMED:
            self.latency.add(latency)

    @property
    def answered(self) -> int:
        """Requests that got what they asked for."""
        return sum(self.verdicts[verdict] for verdict in ANSWERS)

    @property
    def exceptions(self) -> int:
        """Requests that were refused."""
        return self.verdicts[Verdict.EXCEPTION]

    @property
    def unanswered(self) -> int:
        """Requests to which nothing came, not even late."""
        return max(0, self.verdicts[Verdict.NO_RESPONSE] - self.late)

    @property
    def damaged(self) -> int:
        """Requests whose answer was damaged."""
        return self.verdicts[Verdict.DAMAGED_ANSWER]

    @property
    def cycle(self) -> Histogram:
        """From one request to the next; with repeats only where nothing else was heard."""
        return self.every if self.every.count else self.between

    @property
    def interval(self) -> int | None:
        """From one request to the next as it usually is, ns; None where there was but one."""
        return self.cycle.quantile(0.5)

    @property
    def jitter(self) -> int | None:
        """By how much nine of ten intervals differ at most, halved: ± ns; None with less than three requests."""
        apart = self.cycle.apart(0.05, 0.95)
        return None if apart is None or self.cycle.count < 2 else apart // 2

    def merge(self, later: Poll, holes: Holes | None = None) -> Poll:
        """With what a later stretch saw of the same entry, as a new value. `holes`: of both."""
        every, between = self.every.merge(later.every), self.between.merge(later.between)
        if self.newest is not None and later.begun is not None and not _are_apart(self.newest, later.begun, holes):
            every.add(later.begun - self.newest)
        if self.last is not None and later.first is not None and not _are_apart(self.last, later.first, holes):
            between.add(later.first - self.last)
        return replace(
            self,
            asked=self.asked + later.asked,
            repeats=self.repeats + later.repeats,
            late=self.late + later.late,
            verdicts=self.verdicts + later.verdicts,
            first=later.first if self.first is None else self.first,
            last=self.last if later.last is None else later.last,
            begun=later.begun if self.begun is None else self.begun,
            newest=self.newest if later.newest is None else later.newest,
            every=every,
            between=between,
            latency=self.latency.merge(later.latency),
            slices=self.slices.merge(later.slices),
            request=later.request or self.request,
        )


def _are_apart(begin: int, end: int, holes: Holes | None) -> bool:
    return holes is not None and holes.lie_between(begin, end)
