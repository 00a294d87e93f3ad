"""Promptness: whether a frame comes when an answer to the open request would, by the times that this bus has shown."""

from __future__ import annotations

from dissectors.frame import Role
from dissectors.modbus.exchange import Exchange, Seen
from dissectors.modbus.functions import BROADCAST, FUNCTIONS
from dissectors.modbus.learned_timing import READ, LearnedTiming

AT_ONCE = 50_000_000
"""ns; no master repeats a request sooner, unless its timeout is known to be that short."""

_INTERFACES = 0x2B
_SPOILT_MOST = 2  # octets of a repeat


def has_no_layout(seen: Seen) -> bool:
    """Whether nobody knows how its function lays out request and answer: a maker's, or another interface than device
    identification behind function 43."""
    code = seen.header.function
    return code not in FUNCTIONS or (code == _INTERFACES and seen.header.role is Role.EITHER)


class Promptness:
    """Compares times with what was learnt. `silence`: ns, the shortest time after which somebody else may speak;
    `latency`: ns that the adapter holds octets back, which is in all that was learnt; `soonest`: ns, in which a station
    can begin an answer, allowed or not."""

    def __init__(self, learnt: LearnedTiming, silence: int, latency: int, soonest: int) -> None:
        self._learnt = learnt
        self._silence = silence
        self._soonest = soonest
        self._latency = latency

    def in_time(self, request: Exchange, seen: Seen) -> bool:
        """Whether it may have come within the time in which that station answers: a computer that was busy meanwhile
        takes it later."""
        late = max(0, seen.frame.slack - self._latency)
        return self._learnt.in_time(request.unit, request.pace, request.gap(seen.frame.start - late))

    def knows(self, request: Exchange) -> bool:
        """Whether that station's response times are learnt."""
        return self._learnt.response_limit(request.unit, request.pace) is not None

    def is_prompt(self, request: Exchange, seen: Seen) -> bool:
        """Whether it comes as soon as answers of that station are known to come, or sooner than any master goes on."""
        limits = (self._learnt.response_limit(request.unit, pace) for pace in (request.pace, READ))
        limit = max((limit for limit in limits if limit is not None), default=AT_ONCE)
        return request.gap(seen.frame.start) <= limit

    def is_doubtful(self, request: Exchange, seen: Seen, fits: bool) -> bool:
        """Whether a frame that comes late, for all that is learnt, may be the answer of a slow station. `fits`: it is
        what was asked for, as far as its octets tell (of some reads of coils they tell no more)."""
        if self.knows(request) or self._learnt.timeout is not None or request.garble or request.fault or request.silent:
            return False
        if request.unit == BROADCAST:
            return False
        return request.octets == seen.octets or has_no_layout(seen) or fits

    def is_too_soon(self, request: Exchange, seen: Seen) -> bool:
        """Whether it began before the station can have seen the end of this repeat: it answers an earlier attempt."""
        return request.attempt > 1 and request.latency(seen.frame).high < self._soonest

    def is_repeat_after_damage(self, request: Exchange, seen: Seen, echoing: bool | None) -> bool:
        """Whether a copy of a request comes well behind a damaged answer to it, with no learnt time that would make it
        the answer: a master that repeats is far more frequent than a second station with the same address. Where the
        damaged frame was the whole answer, it is the repeat whatever was learnt, and as soon as anybody can speak."""
        garble = request.garble
        if garble is None or echoing:
            return False
        silence = seen.frame.start - garble.end
        if garble.is_whole:
            return silence + max(self._latency, seen.frame.slack) >= self._silence
        return not self.knows(request) and silence >= self._learnt.too_soon(self._silence)

    def is_spoilt_repeat(self, request: Exchange, seen: Seen) -> bool:
        """Whether a damaged frame is the request again, all but an octet or two, when the master has given up: later
        than that station answers, and as late as other repeats come."""
        asked, said = request.octets, seen.octets
        if len(asked) != len(said) or sum(one != other for one, other in zip(asked, said, strict=True)) > _SPOILT_MOST:
            return False
        gap = request.gap(seen.frame.start)
        return self._learnt.is_timeout(gap) and not self._learnt.in_time(request.unit, request.pace, gap)
