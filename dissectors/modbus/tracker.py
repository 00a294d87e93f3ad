"""Pairs the frames of a Modbus serial line: one master, at most one unicast request outstanding.

Direction is not in the octets of writes and diagnostics, whose good answer repeats the request. So:

1. What the shape decides (`peek`: REQUEST or RESPONSE) is believed, and teaches (`learned_timing.py`).
2. A copy of the open request is an echo when it comes sooner than a station can answer, an answer when it comes within
   the station's response time, and a repeat of the request after that.
3. A request closes the open one: unanswered, or answered by something damaged.
   Where no time is learnt, a copy that comes late is both at first (Role.EITHER), in one transaction with the request,
   until more is known (doubts.py).
4. An answer that does not fit belongs to an earlier request (late), to nobody (unsolicited), or is a second one.
5. A frame missed by the tap therefore costs its own transaction and no other.

Every frame is in exactly one transaction. A late or second answer has one of its own, which names the other (`of`).
An answer from another unit than the one asked is unsolicited and names the request, which stays open: the right unit
may still answer. (Some battery systems are asked at one address and always answer from another.)
"""

from __future__ import annotations

from dataclasses import replace

from dissectors.frame import Event, Header, Noise, Reason, Role
from dissectors.modbus.damaged import is_preamble
from dissectors.modbus.damaged_unit import names_another, unit_of
from dissectors.modbus.doubts import is_full
from dissectors.modbus.envelope import readable_adu
from dissectors.modbus.exchange import Exchange, Garble, Seen, answer_apart, echo_of
from dissectors.modbus.exchanges import FIRST_SEEN
from dissectors.modbus.functions import BROADCAST, ITEMS_ASKED
from dissectors.modbus.odd_answers import has_a_length_of_none
from dissectors.modbus.pairing import another_function, is_listen_only, is_restart, mismatch
from dissectors.modbus.promptness import AT_ONCE, has_no_layout
from dissectors.modbus.tracker_memory import TrackerMemory
from dissectors.tracker import Placement, Tracked, Transaction, Verdict

_IMPATIENT = "the master went on long before its timeout: the answer may have been missed at this tap"
_PERHAPS_ANSWER = "the master went on long before its timeout: perhaps an answer whose request was missed at this tap"
_REQUEST_OCTETS = 8  # of the commonest request, RTU
_TURNAROUND = 90_000_000
"""Nobody speaks so soon after a broadcast: the master waits 100 … 200 ms (Modbus over Serial Line V1.02, 2.4.1)."""

_CHAIN_MOST = 8  # equal requests in a row whose verdicts wait for each other
_GARBLE = 3  # so many octets of noise in place of an answer are a damaged answer
_QUIET_NOISE = frozenset((Reason.ZEROS, Reason.BREAK, Reason.PAD))


class ModbusTracker(TrackerMemory):
    """Implements `dissectors.tracker.Tracker` for RTU and ASCII lines."""

    # ---- the contract

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Place the next event; see `dissectors.tracker.Tracker`."""
        self._held.expire(event.start)
        if isinstance(event, Noise) or header is None:
            self._noise(event)
            return Tracked(None, self._held.take_closed())
        seen = Seen(no, event, header, readable_adu(event))
        if header.ok and self._held.only != seen.octets:
            self._held.only = seen.octets if self._held.only is None else b""
        if not header.ok or len(seen.octets) < 2:
            placement = self._damaged(self._as_named(seen))
        elif header.role is Role.RESPONSE:
            placement = self._response(seen)
        elif header.role in (Role.REQUEST, Role.BROADCAST):
            placement = self._request(seen)
        else:
            placement = self._either(seen)
        if header.ok and seen.unit:
            self._units.add(seen.unit)
        self._last_end = event.end
        self._last_was_answer = placement.role is Role.RESPONSE
        self._held.decide_doubts(event.end)
        return Tracked(placement, self._held.take_closed())

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Close the open request when the master has long given up at `now` (ns)."""
        # an answer that began in time may still be under way through the adapter
        self._held.expire(now - self._timing.latency - self._echoes.limit)
        self._held.decide_doubts(now)
        return self._held.take_closed()

    def close(self) -> tuple[Transaction, ...]:
        """End of capture."""
        if self._held.open is not None and self._held.open.copies:
            self._held.finish_copies(self._held.open, None)
        if self._held.open is not None:
            unfinished = not (self._held.open.fault or self._held.open.garble or self._held.open.silent)
            self._held.close_open(Verdict.OPEN if unfinished else None)
        self._held.decide_doubts(None)
        return self._held.take_closed()

    # ---- what the shape decides

    def _request(self, seen: Seen, sure: bool = True, fault: str | None = None) -> Placement:
        """A request: an echo of the newest one, its repeat, or another."""
        odd = self._odd.misshapen(self._held.open, seen) if sure and self._held.open is not None else None
        if odd is not None and self._held.open is not None:
            return self._answer(self._held.open, seen, odd)
        if sure and self._echoes.is_of_request(self._held.open or self._held.last, seen):
            newest = self._held.open or self._held.last
            self._echoes.note(0 if newest is None else newest.gap(seen.frame.start))
            return self._echo(seen)
        if self._held.open is not None and self._held.open.copies:
            self._held.finish_copies(self._held.open, seen)
        before = self._held.open
        copied = None if self._held.last is None else self._held.last.copied
        self._learn_from_next(seen, sure)
        request = Exchange(self._held.take_tx(), seen, sure, fault=fault)
        request.silent = is_listen_only(seen.octets) or (request.unit in self._mute and is_restart(seen.octets))
        if before is not None:
            if before.unit == request.unit:
                request.since = before.since
            if before.octets == seen.octets and not (before.fault or before.silent):
                request.attempt, request.of = before.attempt + 1, before.of or before.tx
            before.waited = waited = before.gap(seen.frame.start)
            hasty = self.timeout is not None and waited < self.timeout // 2
            if before.remark is None and hasty:
                before.remark = _IMPATIENT if before.sure else _PERHAPS_ANSWER
            if request.attempt > 1 and self._may_be_answered_by(before, seen):
                self._held.open, self._held.last = None, before
                self._held.chain.append(before)
            else:
                before.may_be_answer |= hasty and not (before.sure or before.attempt > 1 or before.echoed)
                self._held.close_open()
        elif self._held.last is not None and not sure and not fault:
            self._note_likeness(request, self._held.last, copied)
        if not sure and not fault and self._held.last is None:
            request.remark = FIRST_SEEN
        self._note_mode(request)
        if request.unit == BROADCAST and not fault and not request.asks_nobody:
            self._held.last = request
            self._held.closed.append(request.close(Verdict.BROADCAST))
            return Placement(seen.no, request.tx, Role.BROADCAST, destination=BROADCAST)
        self._held.open = request
        return Placement(seen.no, request.tx, Role.REQUEST, destination=seen.unit)

    def _note_likeness(self, request: Exchange, last: Exchange, copied: int | None) -> None:
        """Whether what looks like a request may be the answer to the broadcast before it, or to what an echo seemed to
        answer after `copied` ns."""
        gap = last.gap(request.request.frame.start)
        if last.unit == BROADCAST and last.octets[1:] == request.octets[1:]:
            request.after_broadcast = gap < _TURNAROUND
        elif last.octets == request.octets and copied is not None:
            request.may_be_answer = copied <= self._echoes.limit + self._timing.latency

    def _response(self, seen: Seen) -> Placement:
        """An answer: to the open request, a late, a second or an unsolicited one."""
        request = self._held.open
        late = self._held.late_for(seen)
        if request is not None:
            if request.is_for(seen.octets):
                why = None if request.fault else mismatch(request.octets, seen.octets)
                before = self._held.repeats(request, seen) if why and late is None else None
                if before is not None:
                    request.disturbed = True
                    return self._answer_apart(seen, Verdict.ANSWERED_TWICE, before)
                if late is None or not (why or self._times.is_too_soon(request, seen)):
                    return self._answer(request, seen, why)
            elif request.unit == seen.unit and late is None and not request.fault:
                return self._another_function(request, seen)
            elif request.fault and self._times.in_time(request, seen):
                return self._answer(request, seen, None)
            elif late is None:
                return self._from_elsewhere(request, seen)
            request.disturbed = True
            if late is not None and (copied := self._odd.learn(request, late)) is not None:
                self._held.close_as_late(request, copied)
        if late is not None:
            self._held.given_up.remove(late)
            return self._answer_apart(seen, Verdict.LATE, late)
        if self._is_second_answer(seen):
            last = self._held.last
            if last is not None and last.asks_nobody:  # so it asked all, and more than one answer
                error = f"unit {seen.unit} answered a request to address 0, too"
                return self._answer_apart(seen, Verdict.UNSOLICITED, last, error)
            return self._answer_apart(seen, Verdict.ANSWERED_TWICE, last)
        return self._answer_apart(seen, Verdict.UNSOLICITED)

    def _another_function(self, request: Exchange, seen: Seen) -> Placement:
        """An answer of the station that was asked, to something else: to a request before, or to this one, wrong."""
        before = self._held.repeats(request, seen)
        if before is not None:
            request.disturbed = True
            return self._answer_apart(seen, Verdict.ANSWERED_TWICE, before)
        if request.latency(seen.frame).high < self._soonest:
            return self._from_elsewhere(request, seen)
        return self._answer(request, seen, another_function(request.octets, seen.octets))

    # ---- what only time decides

    def _either(self, seen: Seen) -> Placement:
        """A frame that could be a request as well as a response, or is of no known shape."""
        request = self._held.open
        if request is None:
            return self._either_unasked(seen)
        if request.copies:
            return self._after_copy(request, seen)
        if request.is_for(seen.octets):
            if seen.header.function in ITEMS_ASKED and self._echoes.is_of_request(request, seen):
                return self._request(seen)  # coils that say what was asked for them, octet for octet, are hardly any
            if request.octets == seen.octets and self._echoes.is_of_write(request, seen):
                return self._echo(seen)
            if request.octets == seen.octets and self._times.is_repeat_after_damage(request, seen, self._echoes.usual):
                return self._request(seen, sure=False)
            why = None if request.fault else mismatch(request.octets, seen.octets)
            # a station may answer with the value that it really took, or with a wrong length; not where another's
            # answer came between, since the one that was late may be this very request
            is_odd = request.octets[:4] == seen.octets[:4] or has_a_length_of_none(seen)
            near = is_odd and not request.disturbed and self._times.is_prompt(request, seen)
            if (why is None or near or seen.header.role is Role.UNKNOWN) and self._times.in_time(request, seen):
                return self._answer(request, seen, why)
            if self._times.is_doubtful(request, seen, fits=why is None):
                return self._join(request, seen)
        elif (
            request.octets[1:] == seen.octets[1:] and self._times.knows(request) and self._times.in_time(request, seen)
        ):
            return self._from_elsewhere(request, seen)
        elif self._odd.is_by_another_function(request, seen):
            return self._another_function(request, seen)
        elif (late := self._odd.late(request, seen)) is not None:
            request.disturbed = True
            self._held.given_up.remove(late)
            return self._answer_apart(seen, Verdict.LATE, late)
        elif (crossed := self._odd.crossing(request, seen)) is not None:
            self._held.close_as_late(request, crossed[0])
            self._held.given_up.remove(crossed[1])
            return self._answer_apart(seen, Verdict.LATE, crossed[1])
        return self._request(seen, sure=False)

    def _after_copy(self, request: Exchange, seen: Seen) -> Placement:
        """A frame that could be anything, after one that is the answer to the open request or a request again."""
        newest = request.copies[-1]
        if newest.octets != seen.octets:
            return self._request(seen, sure=False)
        pause = max(0, seen.frame.start - request.last_end)
        gap = request.gap(request.copies[0].frame.start)
        if pause < self._echoes.limit and not self._may_be_next(pause, seen):  # whichever it was, this repeats it
            if self._echoes.is_usual_of(request.unit):
                return self._echo(seen)
            return self._answered_again(seen, request)
        if newest.octets != request.octets:  # the newest was a request, and this answers it
            return self._request(seen, sure=False)
        if self.learnt.in_time(request.unit, request.pace, pause) and not self.learnt.is_same(gap, pause):
            return self._answer(request, seen, None)
        if self.learnt.is_same(gap, pause) and not is_full(request):
            return self._join(request, seen)
        return self._request(seen, sure=False)

    def _may_be_next(self, pause: int, seen: Seen) -> bool:
        """Whether a copy `pause` ns behind the frame before may be the next request of a master that writes one value
        for ever: nothing else was said so far, and the adapter, or a late computer, leaves room for its pause."""
        slack = max(self._timing.latency, seen.frame.slack)
        return self._held.only == seen.octets and slack > 0 and pause + slack >= self.learnt.too_soon(self._silence)

    def _answered_again(self, seen: Seen, request: Exchange) -> Placement:
        """A copy that is no request, of one answered by a copy: a second answer, or the answer behind an echo."""
        is_open = self._echoes.may_have_been_first(request, seen)
        return self._answer_apart(seen, Verdict.UNDECIDED if is_open else Verdict.ANSWERED_TWICE, request)

    def _answer_behind_echo(self, request: Exchange, seen: Seen) -> Placement:
        """The answer to a request whose echo, read late, was taken for it."""
        request.echoed, request.copied = True, None
        return self._answer_apart(seen, Verdict.UNDECIDED, request)

    def _join(self, request: Exchange, seen: Seen) -> Placement:
        """Leave open what the frame is: it belongs to the request in any case."""
        request.copies.append(seen)
        return Placement(seen.no, request.tx, Role.EITHER)

    def _either_unasked(self, seen: Seen) -> Placement:
        """No request is open: a new one, unless it comes too soon for that."""
        last = self._held.last
        if last is not None and self._echoes.owes_answer(last, seen) and self._times.in_time(last, seen):
            return self._answer_behind_echo(last, seen)
        if last is not None and self._last_end == last.end and self._odd.is_perhaps_slow(last, seen):
            return self._answer_apart(seen, Verdict.UNDECIDED, last)
        gap = 0 if self._last_end is None else max(0, seen.frame.start - self._last_end)
        is_timed = self._timing.has_times and self._timing.latency < AT_ONCE  # else nothing comes too soon
        too_soon = is_timed and gap < self.learnt.too_soon(self._silence) and not self._may_be_next(gap, seen)
        if last is not None and last.octets == seen.octets and too_soon:
            if last.answered and (self._held.goes_on(seen) or (last.copied is None and has_no_layout(seen))):
                return self._request(seen, sure=False)
            if last.answered:
                self._held.twice = seen.no
                return self._answered_again(seen, last)
            return self._echo(seen)
        return self._request(seen, sure=False)

    def _damaged(self, seen: Seen) -> Placement:
        """A damaged frame: in answer to the open request, a damaged request, or neither."""
        request = self._held.open
        if request is not None and self._echoes.is_cut(request, seen.frame.octets, seen.frame.start):
            request.put_together(seen.frame.octets, seen.frame.start)
            return self._echo(seen, f"the echo ends after {len(seen.frame.octets)} octets")
        error = seen.header.error or "damaged"
        if request is None:
            if self._echoes.is_cut_behind(self._held.last, seen, self._last_end):
                return self._echo(seen, f"a copy that ends after {len(seen.frame.octets)} octets")
            if seen.header.role is Role.RESPONSE:
                return self._answer_apart(seen, Verdict.UNSOLICITED)
        elif self._is_damaged_answer(request, seen):
            request.put_together(seen.frame.octets, seen.frame.start)
            if request.garble is None:
                is_whole = len(seen.octets) == len(request.octets) and seen.octets[:2] == request.octets[:2]
                request.garble = Garble(seen.no, seen.frame.end, error, is_whole)
            return Placement(seen.no, request.tx, Role.RESPONSE, source=request.unit)
        return self._request(seen, sure=False, fault=error)

    def _noise(self, noise: Event) -> None:
        request = self._held.open
        if request is None or not isinstance(noise, Noise):
            return
        request.disturbed = True
        request.put_together(noise.octets, noise.start)
        if self._echoes.is_cut(request, noise.octets, noise.start):
            request.echoed = True
            return
        if request.garble or noise.reason in _QUIET_NOISE or len(noise.octets) < _GARBLE or is_preamble(noise):
            return
        if self.learnt.in_time(request.unit, request.pace, request.gap(noise.start)):
            many = len(noise.octets)
            request.garble = Garble(None, noise.end, f"{many} octets came in answer, but no frame", octets=many)

    # ---- judging

    def _is_damaged_answer(self, request: Exchange, seen: Seen) -> bool:
        """Whether a damaged frame came in answer. One that was cut may have the length of a request by chance: it is
        an answer all the same when it comes as soon as that station's answers do, which no master does; likewise where
        it seems to ask a station that nobody ever heard of, on a bus whose answers are heard."""
        if seen.header.role is Role.REQUEST:
            nobodys = seen.unit not in self._units and self.learnt.fastest(request.unit) is not None
            return (seen.unit == request.unit or nobodys) and self._times.is_prompt(request, seen)
        if request.is_for(seen.octets) and (request.garble is None or seen.header.role is Role.RESPONSE):
            return not self._times.is_spoilt_repeat(request, seen)
        return self._times.in_time(request, seen) and not names_another(seen, request.unit, self._units)

    def _as_named(self, seen: Seen) -> Seen:
        """A damaged frame with the station that its check makes of what it names."""
        unit = unit_of(seen.frame, seen.unit, self._units)
        if unit is None or unit == seen.unit:
            return seen
        return replace(seen, octets=bytes((unit,)) + seen.octets[1:])

    def _may_be_answered_by(self, before: Exchange, seen: Seen) -> bool:
        """Whether an equal request that comes later than answers usually do may be a slow answer all the same."""
        if before.sure or not self._is_plain(before) or (before.echoed and not self._echoes.is_usual_of(before.unit)):
            return False
        gap = before.gap(seen.frame.start)
        return len(self._held.chain) < _CHAIN_MOST and (self.timeout is None or gap < self.timeout * 9 // 10)

    def _is_plain(self, request: Exchange) -> bool:
        """Whether nothing at all came to a request that should have been answered."""
        return not (request.fault or request.silent or request.garble)

    def _is_second_answer(self, seen: Seen) -> bool:
        """Whether an answer follows the last one of that unit with no room for a request between."""
        last = self._held.last
        if last is None or not last.answered or self._last_end is None or not last.is_for(seen.octets):
            return False
        room = self.learnt.too_soon(self._silence) + _REQUEST_OCTETS * self._timing.char
        return seen.frame.start - self._last_end < room + (self.learnt.fastest(last.unit) or 0) // 2

    # ---- closing

    def _answer(self, request: Exchange, seen: Seen, why: str | None) -> Placement:
        self._learn_from_answer(request, seen, why)
        self._held.forgive_pieces(request)
        self._held.answered.append(request)
        self._held.drop_chain(Verdict.NO_RESPONSE)
        self._held.note_answer(request)
        self._held.open, self._held.last = None, request
        self._mute.discard(seen.octets[0])
        self._held.closed.append(request.close_with(seen, why))
        return Placement(seen.no, request.tx, Role.RESPONSE, source=seen.unit)

    def _from_elsewhere(self, request: Exchange, seen: Seen) -> Placement:
        """An answer of another unit or function while a request is open, which stays open."""
        request.disturbed = True
        error = None
        if seen.unit != request.unit:
            error = f"unit {seen.unit} answered a request to unit {request.unit}"
            request.remark = f"unit {seen.unit} answered instead"
        return self._answer_apart(seen, Verdict.UNSOLICITED, request, error)

    def _answer_apart(
        self, seen: Seen, verdict: Verdict, other: Exchange | None = None, error: str | None = None
    ) -> Placement:
        tx = self._held.take_tx()
        self._held.closed.append(answer_apart(tx, seen, verdict, other, error))
        return Placement(seen.no, tx, Role.RESPONSE, source=seen.unit)

    def _echo(self, seen: Seen, error: str | None = None) -> Placement:
        original = self._held.open or self._held.last
        assert original is not None  # an echo is of something
        original.echoed = True
        tx = self._held.take_tx()
        self._held.closed.append(echo_of(tx, seen, original, error))
        role = Role.BROADCAST if original.unit == BROADCAST else Role.REQUEST
        return Placement(seen.no, tx, role, destination=original.unit)
