"""Answers in the shape of requests: what comes as soon as answers do, while a request waits, is none of the master's.

    01 03 00 10 00 02          01 00 01              a function that nobody asks for
    01 10 00 10 00 01 02 0007  01 06 00 10 00 07     the same address, by another function that writes
    01 03 00 10 00 02          01 03 03 00 07 00     as a request it would ask for more than there is
    01 04 00 10 00 02          01 05 04 0007 0008    by another function, and as long as none of its requests
    01 06 00 05 00 01          02 03 00 00 00 01     01 06 00 05 00 01     02 03 02 00 07
                               └ to another station  └ the late answer, and no request: 02 was still waited for

A master does not ask while it waits. But where this tap missed an answer, its next request stands in the same place: so
nothing is told of what comes later than answers do, and of late answers only where the bus has shown that they are.
"""

from __future__ import annotations

from dissectors.modbus.exchange import Exchange, Seen
from dissectors.modbus.exchanges import Exchanges
from dissectors.modbus.functions import FUNCTIONS
from dissectors.modbus.limits import beyond_limits
from dissectors.modbus.notation import HEAD
from dissectors.modbus.pairing import another_function, mismatch
from dissectors.modbus.promptness import AT_ONCE, Promptness, has_no_layout

_ADDRESS_END = HEAD + 2


class OddAnswers:
    """Compares with what waits, and with what the bus has shown."""

    def __init__(self, times: Promptness, held: Exchanges) -> None:
        self._times = times
        self._held = held

    def is_by_another_function(self, request: Exchange, seen: Seen) -> bool:
        """Whether the station that was asked answers by a function that is no master's, or by another that writes."""
        if seen.unit != request.unit or not self._may_be_answered(request, seen):
            return False
        code, asked = seen.header.function, request.octets[1]
        if code == asked:
            return False
        if has_a_length_of_none(seen):
            return True
        function = FUNCTIONS.get(code) if code is not None else None
        if function is None:
            return (request.unit, seen.octets[1]) not in self._held.makers
        same_place = seen.octets[HEAD:_ADDRESS_END] == request.octets[HEAD:_ADDRESS_END]
        return function.writes and FUNCTIONS[asked].writes and same_place

    def misshapen(self, request: Exchange, seen: Seen) -> str | None:
        """Why a frame is not the answer that was asked for, where it is one and looks like a request; None else."""
        if request.unit != seen.unit or not self._may_be_answered(request, seen):
            return None
        if not request.is_for(seen.octets):
            return another_function(request.octets, seen.octets) if has_a_length_of_none(seen) else None
        if FUNCTIONS[request.octets[1]].writes:
            return None
        if seen.header.error is not None:
            return seen.header.error
        return mismatch(request.octets, seen.octets) if beyond_limits(seen.octets) is not None else None

    def _may_be_answered(self, request: Exchange, seen: Seen) -> bool:
        is_plain = request.sure and not (request.fault or request.garble or request.request.header.error)
        has_layout = len(request.octets) > 1 and request.octets[1] in FUNCTIONS
        return is_plain and has_layout and self._times.is_prompt(request, seen)

    def late(self, request: Exchange, seen: Seen) -> Exchange | None:
        """The request given up that a frame answers, where another one waits; None where it may be a request."""
        gap = request.gap(seen.frame.start)
        if not self._held.copies_come_late or gap >= AT_ONCE:
            return None
        late = self._held.late_for(seen)
        if late is None or not _may_answer(late, seen) or (late.waited or 0) < max(AT_ONCE, 2 * gap):
            return None
        self._held.crossed = request
        return late

    def is_perhaps_slow(self, request: Exchange, seen: Seen) -> bool:
        """Whether a frame that nothing waits for any more may be the answer to the last request, of a maker's function:
        directly behind it, and no repeat, which would be as long."""
        if request.answered or not (has_no_layout(seen) and request.is_for(seen.octets)):
            return False
        return len(seen.octets) != len(request.octets) and self._held.late_for(seen) is request

    def learn(self, between: Exchange, answered: Exchange) -> Exchange | None:
        """A request was answered after all when another one had come, into the wait for it: the one given up that the
        other answers; None where it is none's answer, or is that request again."""
        if between.sure or not between.octets or between.octets == answered.octets:
            return None
        fitting = (one for one in reversed(self._held.given_up) if one is not answered and one is not between)
        late = next((one for one in fitting if _may_answer(one, between.request)), None)
        if late is not None:
            self._held.copies_come_late = True
        return late

    def crossing(self, between: Exchange, seen: Seen) -> tuple[Exchange, Exchange] | None:
        """The same where the other answer is a copy, too: which two requests were given up that `between` and the next
        frame answer. The second of them hardly waited, as no master does that waited for the first."""
        answered = self._held.given_up[-1] if self._held.given_up else None
        if answered is None or answered.octets != seen.octets or answered.waited is None:
            return None
        if answered.waited >= AT_ONCE or between.attempt > 1 or not self._times.is_prompt(between, seen):
            return None
        late = self.learn(between, answered)
        is_waited_for = late is not None and (late.waited or 0) >= max(AT_ONCE, 2 * answered.waited)
        return (late, answered) if late is not None and is_waited_for else None


def has_a_length_of_none(seen: Seen) -> bool:
    """Whether a good frame is as long as neither a request nor an answer of its function is."""
    frame, header = seen.frame, seen.header
    return header.ok and header.error is not None and frame.expected not in (None, len(frame.octets))


def _may_answer(request: Exchange, seen: Seen) -> bool:
    """Whether a frame that could be a request is an answer to that one: its copy, or of a function without a layout."""
    return request.octets == seen.octets or (has_no_layout(seen) and request.octets[:HEAD] == seen.octets[:HEAD])
