"""Echoes: copies of a request given back at once, sooner than a station can answer or a master repeat.

A bus with an echo (a converter or adapter that hears itself) gives back every request; most buses none.
"""

from __future__ import annotations

from collections import deque

from dissectors.frame import Damage
from dissectors.line import Timing
from dissectors.modbus.exchange import Exchange, Seen, is_begin_of
from dissectors.modbus.functions import BROADCAST
from dissectors.modbus.learned_timing import LearnedTiming
from dissectors.modbus.promptness import AT_ONCE, has_no_layout

ECHO_VOTES = 4
"""Answered requests with an echo, or without, that count at most against what is seen now."""

OWN_VOTES = 2
"""Answered requests of one station without an echo, more than with one, from which on what comes back at once on this
bus comes of another station."""

MOST_VOTES = 2 * ECHO_VOTES
"""More answers without an echo than these decide nothing."""

_GAPS_KEPT = 8


class Echoes:
    """What is known of echoes on one bus.

    `soonest`: ns, the shortest time in which a station can begin an answer. `limit`: ns, within which a copy is no
    answer. `usual`: whether this bus repeats requests at once; None while unlearnt.
    """

    def __init__(self, timing: Timing, soonest: int, learnt: LearnedTiming) -> None:
        self._timing = timing
        self._soonest = soonest
        self._learnt = learnt
        self.limit = max(soonest, timing.char + timing.latency)
        self.usual: bool | None = None
        self._votes = 0  # answered requests with an echo, less those without
        self._votes_of: dict[int, int] = {}  # the same by station
        self._gaps: deque[int] = deque(maxlen=_GAPS_KEPT)  # before the newest echoes of requests that are surely some

    def is_of_request(self, newest: Exchange | None, seen: Seen) -> bool:
        """Whether a sure request repeats the newest one at once; a master repeats only after its timeout."""
        if newest is None or newest.octets != seen.octets or newest.answered or newest.fault or newest.garble:
            return False  # behind a damaged answer a master may repeat at once
        if self._timing.latency >= AT_ONCE and (self.usual is False or (self.usual is None and _has_copies(newest))):
            return False  # no times tell, but others do; or there are more copies than one echo makes
        gap = newest.gap(seen.frame.start)
        if newest.echoed and gap >= self.limit:
            return False  # it came back already; who sends again so soon has a short timer
        if self._learnt.timeout is not None:
            return gap < self.limit or gap * 8 < self._learnt.timeout
        return gap < self.limit or (gap < AT_ONCE and newest.unit != BROADCAST)

    def is_of_write(self, request: Exchange, seen: Seen) -> bool:
        """Whether a copy that could be an answer comes too soon to be one."""
        latency = request.latency(seen.frame)
        if request.echoed or latency.low > max(self.limit, self._usual_gap() * 3 // 2):
            return False
        if self.usual is not None:
            return self.is_usual_of(request.unit)
        if not latency.nominal:
            return False  # both came in one read, which says nothing of the time between
        if latency.high < self._soonest:
            return True
        fastest = self._learnt.fastest(request.unit)
        return fastest is not None and latency.nominal + self._timing.char < fastest // 2

    def may_have_been_first(self, request: Exchange, seen: Seen) -> bool:
        """Whether the copy that was taken for the answer to a request may be its echo, and the next one, `seen`, the
        answer: nothing has told yet whether this bus has echoes, and the adapter leaves open that it came at once."""
        if self.usual is not None or request.copied is None or request.octets != seen.octets:
            return False
        return request.copied < self._soonest + max(self._learnt.margin, seen.frame.slack)

    def owes_answer(self, request: Exchange, seen: Seen) -> bool:
        """Whether the copy that was taken for the answer to a request was its echo, as this bus has one of each, and
        `seen` is the answer."""
        if request.copied is None or request.echoed or not request.answered or not self.is_usual_of(request.unit):
            return False
        return request.octets == seen.octets or (has_no_layout(seen) and request.is_for(seen.octets))

    def note(self, gap: int) -> None:
        """A request that is surely one came back `gap` ns after it. Where times do not tell that it came at once, only
        its answer shows an echo."""
        if self.usual is None and self._timing.latency < AT_ONCE:
            self.usual = True
        self._gaps.append(gap)

    def _usual_gap(self) -> int:
        """How long after a request its echo begins, ns, where this bus has one; 0 where not."""
        usual = sorted(self._gaps)[len(self._gaps) // 2] if self.usual and self._gaps else 0
        return min(usual, self._timing.t35 + self._timing.latency)  # later than that a station may have begun

    def is_cut(self, request: Exchange, octets: bytes, start: int) -> bool:
        """Whether octets are the begin of the request, given back at once and cut short."""
        if not is_begin_of(octets, request.request.frame.octets):
            return False
        gap = max(0, start - request.last_end)
        if request.sure:
            return gap < self.limit or gap < AT_ONCE
        return gap < self.limit and self.usual is not False  # a confirmation may be cut short, too

    def is_cut_in_pieces(self, request: Exchange) -> bool:
        """The same of octets that came in pieces: of an adapter that nobody named, the silence between them proves
        nothing."""
        last = max(0, request.pieces_until - request.last_end)
        return last < AT_ONCE and self.is_cut(request, request.pieces, request.pieces_from)

    def is_cut_behind(self, last: Exchange | None, seen: Seen, end: int | None) -> bool:
        """Whether a frame is the begin of a request that was answered by then, directly behind that answer (`end`):
        what gives requests back, or confirms them, was cut short. No master goes on so soon."""
        if last is None or end is None or seen.frame.damage is not Damage.SHORT:
            return False
        return seen.frame.start - end < self.limit and is_begin_of(seen.frame.octets, last.request.frame.octets)

    def is_usual_of(self, unit: int) -> bool:
        """Whether requests to that station come back at once: on this bus, or else from another station alone."""
        return bool(self.usual) and self._votes_of.get(unit, 0) > -OWN_VOTES

    def learn(self, unit: int, echoed: bool) -> None:
        """One more request that a station answered, with its copy before the answer or without. One says little where
        many were otherwise: a late read puts a repeat directly behind the request."""
        vote = 1 if echoed else -1
        self._votes_of[unit] = max(-ECHO_VOTES, min(ECHO_VOTES, self._votes_of.get(unit, 0) + vote))
        if self.usual is None or (echoed and not self._votes):
            self.usual = echoed
        self._votes = max(-ECHO_VOTES, min(ECHO_VOTES, self._votes + vote))
        if self._votes:
            self.usual = self._votes > 0


def _has_copies(request: Exchange) -> bool:
    """Whether a request came twice already: with an echo, or as a repeat of one."""
    return request.echoed or request.attempt > 1
