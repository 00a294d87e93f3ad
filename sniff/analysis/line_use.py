"""The use of the line: how near a bus is to its limit, and what share broadcasts take; in every protocol. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from dissectors.findings import EVIDENCE_MAX, Finding, Severity, Tally, found
from dissectors.frame import Event, Frame, Role
from dissectors.line import NS_PER_S, LineSettings
from dissectors.words import percent
from sniff.analysis.holes import Holes
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    from dissectors.columns import Times
    from sniff.engine.table import Table

SHORT, LONG = 10, 30
"""Seconds over which a load is looked at: the first for a note, the second for a warning."""

BUSY, FULL = 0.80, 0.92
"""Of that time with octets on the line, from which on it is noted, and warned of."""

BROADCASTS_LEAST = 30
BROADCASTS_NOTED, BROADCASTS_TOO_MANY = 0.20, 0.40
"""Of all octets."""

BROADCASTS_FELT, BROADCASTS_COSTLY = 0.03, 0.15
"""Of all time, from which on they are noted, and may be warned of: those that leave the line free cost nobody."""

ONLY_BROADCASTS = 0.95
"""Of all octets: a bus that is made for them."""

MORE_THAN_ALL = 1.02
"""Of the time, from which on so many octets cannot have come at that rate."""


class LineUse:
    """Fed every row of one bus; `findings` may be asked at any time.

    `has_times`: false of a log without times, which says nothing of load. `is_assumed`: nobody said the rate; what
    share of the time octets take is only a guess then, and warns of nothing.
    """

    def __init__(self, line: LineSettings, *, has_times: bool = True, is_assumed: bool = False) -> None:
        self._has_times = has_times
        self._baud, self._is_assumed = line.baud, is_assumed
        self._char = line.char
        self._busy = 0  # ns of octets in all
        self._second: int | None = None
        self._first_second = 0
        self._seconds: deque[int] = deque([0], maxlen=LONG)  # ns busy in the last seconds, the present one last
        self._most = {SHORT: 0.0, LONG: 0.0}
        self._when = {SHORT: 0, LONG: 0}
        self._broadcast = Tally()
        self._broadcast_busy = 0
        self._first: int | None = None
        self._last = 0
        self._holes = Holes()

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line."""
        if event.kind.is_hole:
            self._holes.miss(event, self._char)

    def see(self, no: int, event: Event, role: Role) -> None:
        """Take the next row."""
        self._holes.see(event.start, event.end)
        self._first = event.start if self._first is None else self._first
        self._last = max(self._last, event.end)
        busy = len(event.octets) * self._char
        self._busy += busy
        self._load_one(event.end, busy)
        if role is Role.BROADCAST and isinstance(event, Frame) and event.ok:
            self._broadcast.add(event.start, no)
            self._broadcast_busy += busy

    def take(self, table: Table, broadcast: Times) -> None:
        """Take rows, one or more, behind the first of the bus. `broadcast`: places of the good broadcasts."""
        import numpy as np

        starts, ends = table.frames.start, table.frames.end
        busy = table.frames.length.astype(np.int64) * self._char
        self._holes.take(starts, ends)
        self._last = max(self._last, int(ends.max()))
        self._busy += int(busy.sum())
        seconds = ends // NS_PER_S
        late = np.minimum(busy, ends - seconds * NS_PER_S)
        if (ends[1:] < ends[:-1]).any() or (busy - late > NS_PER_S).any():  # times run backwards; rows of many seconds
            for end, of_row in zip(ends.tolist(), busy.tolist(), strict=True):
                self._load_one(end, of_row)
        else:
            begins = np.flatnonzero(np.append(True, seconds[1:] != seconds[:-1]))
            sums = (seconds[begins], np.add.reduceat(late, begins), np.add.reduceat(busy, begins))
            for second, of_second, of_both in zip(*(one.tolist() for one in sums), strict=True):
                self._load(second, of_second, of_both)
        self._broadcast.add_many(starts[broadcast].tolist(), (table.first + broadcast[:EVIDENCE_MAX]).tolist())
        self._broadcast_busy += int(busy[broadcast].sum())

    def _load_one(self, end: int, busy: int) -> None:
        """Octets that took `busy` ns up to `end`, over the seconds that they took; at low rates several."""
        self._load(end // NS_PER_S, min(busy, end % NS_PER_S), min(busy, end % NS_PER_S + NS_PER_S))
        left, at = busy - end % NS_PER_S - NS_PER_S, 3
        while left > 0 and at <= len(self._seconds):
            self._seconds[-at] += min(left, NS_PER_S)
            left, at = left - NS_PER_S, at + 1

    def _load(self, second: int, late: int, busy: int) -> None:
        """Octets that took `busy` ns, `late` of them in a second and the rest in the one before it."""
        self._come_to(second)
        self._seconds[-1] += late
        if late < busy and len(self._seconds) > 1:
            self._seconds[-2] += busy - late

    def _come_to(self, second: int) -> None:
        if self._second is None:
            self._second = self._first_second = second
        while self._second < second:
            if second - self._second > LONG:  # nothing for so long: begin anew
                self._seconds.clear()
                self._second = self._first_second = second
                self._seconds.append(0)
                break
            self._close_second()

    def _close_second(self) -> None:
        assert self._second is not None
        held = list(self._seconds)
        whole = self._second - self._first_second  # seconds before the present one that were heard from their begin
        for span, most in self._most.items():
            if len(held) >= span and whole >= span:
                share = sum(held[-span:]) / (span * NS_PER_S)
                if share > most:
                    self._most[span], self._when[span] = share, (self._second + 1 - span) * NS_PER_S
        self._seconds.append(0)
        self._second += 1

    def findings(self) -> Iterator[Finding]:
        """What there is to say so far."""
        if not self._has_times:
            return
        noted, full = self._most[SHORT], self._most[LONG]
        if noted >= BUSY or full >= FULL:
            span = LONG if full >= FULL else SHORT
            average = min(1.0, self._busy / self.heard)
            most = min(1.0, self._most[span])
            seen = f"octets on the line in {percent(most, 0)} of {span} s at the busiest, "
            seen += f"{percent(average, 0)} of all time"
            is_sure = full >= FULL and not self._is_assumed and self._most[span] <= MORE_THAN_ALL
            told = found(
                RULES["LN401"],
                "bus",
                f"{seen}, at {self._baud} Bd, which nobody said" if self._is_assumed else seen,
                first=self._when[span],
                last=self._when[span] + span * NS_PER_S,
                severity=Severity.WARNING if is_sure else Severity.NOTE,
            )
            yield told if self._most[span] <= MORE_THAN_ALL else self._too_many(told, span)
        share = self._broadcast_busy / self._busy if self._busy else 0.0
        of_time = self._broadcast_busy / self.heard
        if self._broadcast.count >= BROADCASTS_LEAST and share >= BROADCASTS_NOTED and of_time >= BROADCASTS_FELT:
            rate = self._broadcast.count * NS_PER_S / self.heard
            seen = f"{self._broadcast.count} broadcasts, {percent(share, 0)} of all octets"
            seen += "" if self._is_assumed else f", {percent(of_time, 0)} of all time"
            is_costly = BROADCASTS_TOO_MANY <= share < ONLY_BROADCASTS and of_time >= BROADCASTS_COSTLY
            severity = Severity.WARNING if is_costly and not self._is_assumed else Severity.NOTE
            yield self._broadcast.found(RULES["LN402"], "bus", f"{seen}, {rate:.1f} a second", severity)

    @property
    def heard(self) -> int:
        """ns from the first octet to the last without the holes; at least 1."""
        return max(1, self._last - (self._first or 0) - self._holes.total)

    def _too_many(self, told: Finding, span: int) -> Finding:
        """Of more octets than the line can carry: what is known of it is wrong, and the bus may have all the room."""
        return replace(
            told,
            seen=f"more octets than {self._baud} Bd carry: {self._most[span]:.0%} of {span} s at the busiest",
            means="the line runs at a higher baud rate than was said, or the times are not those of the line",
            next="the baud rate that was said (`-s`), and what clock stamped the octets",
        )
