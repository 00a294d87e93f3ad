"""Confirmations that could as well be the request again, decided once the bus has shown enough.

A good answer to a write repeats the request, and the answer of a function that nobody knows the layout of may look
like another request. Such a frame, that comes later than stations are known to answer, is

    request ----gap----> answer ---pause---> next        or        request ----gap----> request ---pause---> next

What tells them apart: a master that waited `gap` in vain does not give up sooner the second time; it repeats after its
timeout, neither sooner nor later; a timer is steadier than a station; a third copy after the same time is a timer's.
Where nothing tells, the transaction closes as UNDECIDED and nobody is accused.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise

from dissectors.line import NS_PER_S
from dissectors.modbus.exchange import Exchange
from dissectors.modbus.functions import FUNCTIONS
from dissectors.modbus.learned_timing import READ, LearnedTiming
from dissectors.tracker import Verdict

_KEPT = 16
_PATIENCE = 60 * NS_PER_S
_STEADY = 50  # a timer of a busy master strays by 1 in 50 at most
_RUN_MOST = 5  # copies of one request, evenly spaced, up to which they are repeats and not a value sent for ever


@dataclass(frozen=True, slots=True)
class _Doubt:
    exchange: Exchange
    gap: int  # from the request to what may be its answer, ns
    end: int


Decided = tuple[Exchange, Verdict]


def of_next(request: Exchange, start: int, resembles: bool, learnt: LearnedTiming) -> Verdict | None:
    """What a request and the copies after it were, when another frame starts; None where that does not tell.

    `resembles`: the other frame is a request like the first one (unit, function, length).
    """
    gap = request.gap(request.copies[0].frame.start)
    pause = max(0, start - request.last_end)
    if len(request.copies) > 1:
        return of_run(request)
    if pause + learnt.tolerance < gap * 9 // 10:
        return Verdict.ANSWERED  # nobody gives up sooner on the repeat
    cycle = start - request.request.frame.start
    if learnt.pauses_after_answers(gap, pause, cycle):
        return Verdict.ANSWERED
    if learnt.pauses_after_timeouts(gap, pause, cycle):
        return Verdict.NO_RESPONSE
    copy = request.copies[0]
    if copy.octets != request.octets and copy.header.function in FUNCTIONS and learnt.is_same(gap, pause):
        return Verdict.NO_RESPONSE  # two polls of coils, and a timer behind each
    is_other = copy.octets != request.octets and len(copy.octets) != len(request.octets)
    if is_other and (resembles or not learnt.is_same(gap, pause)):
        return Verdict.ANSWERED
    return None


def of_run(request: Exchange) -> Verdict:
    """What several copies are that follow a request, and each other, after the same time."""
    copies = 1 + len(request.copies)
    return Verdict.NO_RESPONSE if copies & 1 or copies <= _RUN_MOST else Verdict.UNDECIDED


def is_full(request: Exchange) -> bool:
    """Whether so many copies have come that no more belong to the same request."""
    return len(request.copies) >= _RUN_MOST


def of_chain(chain: list[Exchange], learnt: LearnedTiming) -> Verdict:
    """What requests are that equal each other and had no sure answer, where answers are known to come sooner."""
    gaps = [before.gap(after.request.frame.start) for before, after in pairwise(chain)]
    if any(learnt.is_timeout(gap) for gap in gaps):
        return Verdict.NO_RESPONSE
    steady = all(learnt.is_same(gap, gaps[0]) for gap in gaps)
    return Verdict.NO_RESPONSE if len(gaps) > 1 and steady else Verdict.UNDECIDED


class Doubts:
    """Requests with one frame each that the next one did not decide about; bounded in number and in time."""

    def __init__(self, learnt: LearnedTiming) -> None:
        self._learnt = learnt
        self._kept: deque[_Doubt] = deque()

    def __bool__(self) -> bool:
        return bool(self._kept)

    def add(self, exchange: Exchange) -> None:
        """Keep one until more is known."""
        self._kept.append(_Doubt(exchange, exchange.gap(exchange.copies[0].frame.start), exchange.last_end))

    def decide(self, now: int | None) -> list[Decided]:
        """Those that what has been learnt decides, and those that are too many or too old at `now` (None: the end)."""
        if not self._kept:
            return []
        decided: list[Decided] = []
        left: deque[_Doubt] = deque()
        varying = self._varying()
        for doubt in self._kept:
            verdict = self._verdict(doubt, varying)
            if verdict is None:
                left.append(doubt)
            else:
                decided.append((doubt.exchange, verdict))
        while left and (now is None or len(left) > _KEPT or now - left[0].end > _PATIENCE):
            decided.append((left.popleft().exchange, Verdict.UNDECIDED))
        self._kept = left
        return decided

    def _verdict(self, doubt: _Doubt, varying: set[int]) -> Verdict | None:
        learnt, unit = self._learnt, doubt.exchange.unit
        if learnt.is_timeout(doubt.gap):
            return Verdict.NO_RESPONSE
        timeout, limit = learnt.timeout, learnt.response_limit(unit, doubt.exchange.pace)
        if timeout is not None and doubt.gap < timeout * 9 // 10:
            return Verdict.ANSWERED  # the master was still waiting
        if limit is None:  # a write takes no less than a read
            limit = learnt.response_limit(unit, READ)
        if (limit is not None and doubt.gap <= limit) or unit in varying:
            return Verdict.ANSWERED
        return None

    def _varying(self) -> set[int]:
        """Units that answer other requests, and whose times here vary as no timer does."""
        gaps: dict[int, list[int]] = {}
        for doubt in self._kept:
            gaps.setdefault(doubt.exchange.unit, []).append(doubt.gap)
        spread = {unit: max(each) - min(each) - max(each) // _STEADY for unit, each in gaps.items()}
        return {unit for unit in spread if spread[unit] > self._learnt.margin and self._learnt.knows(unit)}
