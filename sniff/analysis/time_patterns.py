"""Time patterns of trouble: in step with the mains, in bursts at a steady interval, all at once. Pure, bounded.

Each pattern is told once, about the bus, and only where the bus's own rhythm does not explain it: a master that polls
every 100 ms is in step with 50 Hz by itself, what is asked every 5 s fails every 5 s, and so does a bus that speaks
every 5 s.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from dissectors.findings import Finding, Tally, counted, found
from dissectors.frame import Chunk, Event, Frame, LineError
from dissectors.line import NS_PER_S
from dissectors.tracker import Transaction
from dissectors.words import elapsed, milliseconds, percent
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.lost_together import LostTogether
from sniff.analysis.mains_hum import SAME, MainsHum
from sniff.analysis.other_settings import Fit, what_fits
from sniff.analysis.rounds import QUIET, Bouts, Rounds
from sniff.analysis.sender_findings import MASTER
from sniff.analysis.silences import Silences
from sniff.analysis.slower_bus import slower_by
from sniff.engine.session import LineEvent, Session

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times, TransactionColumns
    from sniff.engine.table import Table

BURSTS_LEAST = 6
BURSTS_KEPT = 500
BURST_OCTETS = 64
"""Octets of a burst that are compared with others."""

STRONG = 3
STEADY = 0.08

UNREADABLE_OCTETS = 40
UNREADABLE_ROWS = 6
UNREADABLE_KEPT = 8
STRETCH_OCTETS = 800

_MARKS = LineError.PARITY | LineError.FRAMING | LineError.BREAK


@dataclass(slots=True)
class _Burst:
    first: int
    last: int
    senders: set[str]
    rows: list[int]
    good_before: int  # good frames since the burst before
    struck: int  # octets with line errors, at least 1 a row
    marked: bool  # whether it has any
    octets: bytes  # of its first row


@dataclass(slots=True)
class _Stretch:
    """Octets without a good frame among them."""

    first: int
    last: int
    octets: int = 0
    marked: int = 0
    rows: list[int] = field(default_factory=list)
    count: int = 0
    sample: list[Chunk] = field(default_factory=list)
    sampled: int = 0
    fit: Fit | None = None
    asked: bool = False


@dataclass(frozen=True, slots=True)
class Stop:
    """`alive`: until when somebody was heard, `seen`: when it was missed first, `back`: when it was there again, None
    for not; ns. `stations`: those that stopped; none: the whole bus. `is_all`: whether that is everybody."""

    alive: int
    seen: int
    back: int | None
    stations: tuple[int, ...] = ()
    is_all: bool = True


class TimePatterns:
    """Fed rows, transactions and line events of one bus; `findings` may be asked at any time."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._char = session.line.char
        self._good = self._good_since = 0
        self._hum = MainsHum(session.adapter.latency)
        # bursts
        self._burst: _Burst | None = None  # the newest, which may go on
        self._bursts: list[_Burst] = []  # those before it
        self._only_strong = False  # weak ones were too many to keep
        self._rounds = Rounds()
        self._bouts = Bouts()
        # stretches that cannot be read
        self._stretch: _Stretch | None = None
        self._stretches: list[_Stretch] = []
        self._silences = Silences()
        self._lost = LostTogether(has_times=session.has_times)

    # ---- taking in

    def see(self, no: int, event: Event, sender: str) -> None:
        """Take the next row."""
        self._silences.see(event, sender == MASTER)
        is_good = isinstance(event, Frame) and event.ok
        self._bouts.see(event.start, event.end, is_good and sender != MASTER)
        if is_good and not is_struck(event):
            self._rounds.see(event.octets, event.start)
        self.see_trouble(no, event, sender)

    def see_trouble(self, no: int, event: Event, sender: str) -> None:
        """Take a row that `take` left out, at its place among those of `see_good`."""
        is_good = isinstance(event, Frame) and event.ok
        wrong = next((mark for mark in event.marks if mark.error & _MARKS), None)
        if any(mark.error & LineError.BREAK and mark.offset == len(event.octets) - 1 for mark in event.marks):
            self._silences.see_break(no)
        if is_good and wrong is None:
            self._good += 1
            self._good_since += 1
            self._end_stretch()
            self._hum.see_good(event.end)
            return
        if wrong is not None:
            moment: int | None = event.start + (wrong.offset + 1) * self._char
        elif len(event.octets) * self._char <= SAME:
            moment = event.start
        else:
            moment = None  # somewhere in a long frame
        if moment is not None:
            self._hum.see_trouble(moment, no, sender)
        self._see_trouble(no, event, sender)
        if is_good:
            self._end_stretch()
        else:
            self._see_unreadable(no, event)

    def take(self, table: Table, sound: Times, asks: Masks) -> None:
        """Take rows, behind the first of the bus, for what is the same whatever is between them.

        `sound`: places of the good frames without line errors. `asks`: of each row, whether a master without an
        address sent it.
        """
        self._silences.take(table.frames.start, table.frames.end, asks)
        self._bouts.take(table.frames.start, table.frames.end, table.good & ~asks)
        self._rounds.take(table, sound)

    def see_good(self, ends: Times) -> None:
        """Take good frames without line errors that follow one another, which `take` has had. `ends`: ns."""
        self._good += len(ends)
        self._good_since += len(ends)
        self._end_stretch()
        self._hum.see_many_good(ends)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        self._lost.settle(transaction)

    def settle_many(self, closed: TransactionColumns) -> None:
        """Take transactions that closed."""
        self._lost.settle_many(closed)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line: over a hole nothing is known."""
        if event.kind.is_hole:
            self._silences.miss(event.time)
            self._rounds.miss(event.time)

    def _see_trouble(self, no: int, event: Event, sender: str) -> None:
        burst = self._burst
        marked = sum(bool(mark.error & _MARKS) for mark in event.marks)
        struck = max(1, marked)
        if burst is not None and event.start - burst.last < QUIET:
            burst.last = max(burst.last, event.end)
            burst.struck += struck
            burst.marked |= marked > 0
            if len(burst.senders) < 8:
                burst.senders.add(sender)
        else:
            self._keep(burst)
            octets = event.octets[:BURST_OCTETS]
            self._burst = _Burst(event.start, event.end, {sender}, [no], self._good_since, struck, marked > 0, octets)
            self._good_since = 0

    def _keep(self, burst: _Burst | None) -> None:
        """A burst is over. Where there are too many, single errors are none."""
        bursts = self._bursts
        if burst is None or len(bursts) >= BURSTS_KEPT or (self._only_strong and burst.struck < STRONG):
            return
        bursts.append(burst)
        if len(bursts) == BURSTS_KEPT and not self._only_strong:
            self._only_strong = True
            self._bursts = [one for one in bursts if one.struck >= STRONG]

    def _see_unreadable(self, no: int, event: Event) -> None:
        stretch = self._stretch
        if stretch is None:
            stretch = self._stretch = _Stretch(event.start, event.end)
        stretch.last = event.end
        stretch.count += 1
        stretch.octets += len(event.octets)
        stretch.marked += sum(bool(mark.error & _MARKS) for mark in event.marks)
        if len(stretch.rows) < 8:
            stretch.rows.append(no)
        if stretch.sampled < STRETCH_OCTETS:
            stretch.sample.append(Chunk(event.end, event.octets[:STRETCH_OCTETS], event.marks))
            stretch.sampled += len(event.octets)

    def _end_stretch(self) -> None:
        stretch, self._stretch = self._stretch, None
        if stretch is not None and _is_unreadable(stretch) and len(self._stretches) < UNREADABLE_KEPT:
            self._stretches.append(stretch)

    # ---- judging

    def findings(self) -> Iterator[Finding]:
        """All patterns so far."""
        yield from self._hum.findings()
        yield from self._in_bursts()
        yield from self._unreadable()
        yield from self._silences.findings()
        yield from self._lost.findings(self._silences.first or 0, self._silences.now)

    def lasting_silence(self, now: int) -> Finding | None:
        """See `Silences.lasting`."""
        return self._silences.lasting(now)

    def stops(self) -> list[Stop]:
        """What stopped all at once so far: the whole bus, or stations of it."""
        silent = [Stop(begin, begin, end) for begin, end, _ in self._silences.whole()]
        lost = self._lost.losses(self._silences.first or 0, self._silences.now)
        return silent + [
            Stop(
                max(loss[0] for loss in together),
                moment,
                max(loss[2] for loss in together) if all(loss[2] for loss in together) else None,
                tuple(names),
                len(names) == self._lost.present,
            )
            for together, names, moment in lost
        ]

    def _in_bursts(self) -> Iterator[Finding]:
        """All bursts; where single errors lie between them, those of several."""
        bursts = self._bursts if self._burst is None else [*self._bursts, self._burst]
        if len(bursts) >= BURSTS_KEPT:
            return
        for least in (STRONG,) if self._only_strong else (1, STRONG):
            finding = self._steady([burst for burst in bursts if burst.struck >= least])
            if finding is not None:
                yield finding
                return

    def _steady(self, bursts: list[_Burst]) -> Finding | None:
        """What is told of these bursts; None where they have no interval of their own."""
        if len(bursts) < BURSTS_LEAST:
            return None
        intervals = [after.first - before.first for before, after in pairwise(bursts)]
        usual = sorted(intervals)[len(intervals) // 2]
        steady = sum(abs(interval - usual) <= STEADY * usual for interval in intervals)
        known = Counter(name for burst in bursts for name in burst.senders if name != "bus")
        struck = sorted(known.values(), reverse=True)
        elsewhere = struck[1] if len(struck) > 1 else 0  # noise beside the only one that is struck may be its remains
        between = sorted(burst.good_before for burst in bursts[1:])[len(intervals) // 2]
        if usual < NS_PER_S or steady < 0.75 * len(intervals) or between < 10:
            return None
        if self._rounds.is_own(usual) or self._bouts.is_own(usual):
            return None
        if not struck and not self._is_noise(bursts):
            return None  # somebody who speaks at that interval
        if struck and 10 * struck[0] >= 9 * len(bursts) and 10 * elsewhere < 3 * len(bursts):
            return None  # one sender's own rhythm
        tally = Tally()
        for burst in bursts:
            tally.add(burst.first, *burst.rows)
        longest = max(burst.last - burst.first for burst in bursts)
        seen = (
            f"{counted(len(bursts), 'burst')} of damage or noise, {steady} of {len(intervals)} intervals within "
            f"{STEADY:.0%} of {elapsed(usual)}, each {milliseconds(longest)} at most"
        )
        seen += "; it strikes whoever sends" if struck else "; with line errors, and no two alike"
        return tally.found(RULES["LN302"], "bus", seen)

    def _is_noise(self, bursts: list[_Burst]) -> bool:
        """Whether bursts beside which nobody is known are noise: with line errors, all different, at no lower rate."""
        octets = [burst.octets for burst in bursts]
        different = len(set(octets)) == len(octets)
        mostly_marked = 2 * sum(burst.marked for burst in bursts) >= len(bursts)
        return mostly_marked and different and not slower_by(octets, self._session.line)

    def _unreadable(self) -> Iterator[Finding]:
        told: list[tuple[_Stretch, str]] = []
        begin = self._silences.first or 0
        last = [self._stretch] if self._stretch is not None and _is_unreadable(self._stretch) else []
        for stretch in [*self._stretches, *last]:
            words = self._words_of(stretch)
            if words and self._good >= 20:
                told.append((stretch, words))
        if not told:
            return
        first = told[0][0]
        spans = ", ".join(_span(one.first - begin, one.last - begin) for one, _ in told)
        octets = sum(one.octets for one, _ in told)
        seen = f"{octets} octets and not one good frame at {spans}, good frames otherwise; {told[0][1]}"
        finding = found(
            RULES["LN303"],
            "bus",
            seen,
            first=first.first,
            last=told[-1][0].last,
            count=len(told),
            evidence=tuple(no for one, _ in told for no in one.rows),
        )
        fit = f"; at those times {first.fit.means}" if first.fit is not None else ""
        if first.fit is None and self._session.adapter.packets is not False:
            fit = _OR_TWO
        yield replace(finding, means=finding.means + fit)

    def _words_of(self, stretch: _Stretch) -> str:
        """Why the octets of a stretch are no noise; empty where they may be."""
        if not stretch.asked:
            session, stretch.asked = self._session, True
            timing = session.timing
            stretch.fit = what_fits(stretch.sample, session.line, timing.latency, session.protocol, timing.has_rate)
        if stretch.fit is not None:
            return stretch.fit.seen
        if 3 * stretch.marked >= stretch.octets and stretch.count >= 10:
            marked = percent(stretch.marked / stretch.octets, 0)
            if self._session.adapter.packets is False:
                return f"{marked} of them have line errors: another baud rate or format"
            return f"{marked} of them are in reads with line errors: another baud rate or format{_OR_TWO}"
        return ""


def _span(begin: int, end: int) -> str:
    """From when to when, ns since the begin of the capture: "12.0 … 14.5 s", "1 h 2 min … 1 h 5 min"."""
    first, last = elapsed(begin), elapsed(end)
    same = first.endswith(" s") and " " not in first.removesuffix(" s") and "." in last
    return f"{first.removesuffix(' s') if same else first} … {last}"


_OR_TWO = ", or two that talk at once, all the time"
"""What a flag that covers a whole read cannot tell from another baud rate."""


def _is_unreadable(stretch: _Stretch) -> bool:
    return stretch.octets >= UNREADABLE_OCTETS and stretch.count >= UNREADABLE_ROWS


def is_struck(event: Event) -> bool:
    """Whether a row has a line error that is not an overrun."""
    return any(mark.error & _MARKS for mark in event.marks)
