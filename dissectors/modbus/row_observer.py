"""What each row of a Modbus line tells the rules, whatever comes of its transaction: that is `observer.py`'s."""

from __future__ import annotations

from dissectors.frame import Event, Frame, Header, Noise, Role
from dissectors.line import MS
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.cut_echo import CutEcho
from dissectors.modbus.envelope import readable_adu
from dissectors.modbus.functions import BROADCAST, COPIED, EXCEPTION_BIT, FUNCTIONS
from dissectors.modbus.long_silences import SILENCE_LEAST
from dissectors.modbus.remembered import (
    BEGIN,
    LAST_STANDARD_UNIT,
    LOST_KEPT,
    OPEN_KEPT,
    Remembered,
)
from dissectors.tracker import Placement, Transaction, Verdict

TURNAROUND = 90 * MS
"""Nobody speaks so soon after a broadcast: the master waits 100 … 200 ms (Modbus over Serial Line V1.02, 2.4.1)."""

AT_ONCE = 50 * MS
"""No master repeats a request so soon."""

_LEAST_REQUEST = 4
"""Octets of the shortest request."""

STRAY_KEPT = 600
"""Octets, more than the longest frame; of more nothing is said."""


class RowObserver(Remembered):
    """Fed row by row."""

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """See `dissectors.findings.Judge`."""
        seen = self.seen
        gap = event.start - seen.now
        if not event.octets and seen.first is not None:  # nobody heard what was before it
            seen.begin_anew(max(0, gap))
        seen.first = event.start if seen.first is None else seen.first
        seen.now = max(seen.now, event.end)
        if self._is_cut_echo(no, event):
            return
        if self.timing.latency >= AT_ONCE:
            self._note_said(no, event, header, placement)
        is_behind_silence = gap >= SILENCE_LEAST and self.silences.is_one(gap)
        if is_behind_silence:
            self._see_silence(gap, placement)
        tx = self.newest if placement is None or header is None else placement.tx
        self.torn.see(no, event, tx, is_good_frame=header is not None and header.ok)
        if isinstance(event, Noise) or header is None or placement is None:
            self._gather(event)
            self._see_broken(no, event, event.octets)
            self._see_noise(no, event)
            self.rubbish = no if len(event.octets) >= _LEAST_REQUEST else self.rubbish
            self.open = None
            self.gaps.hear_noise()
            self.ends.hear_noise(event)
            return
        if event.slack > self.timing.latency + MS:
            self.late.add((no,))
        octets = readable_adu(event)
        if not header.ok:
            self._see_broken(no, event, octets)
        else:
            self._await_cut_echo(event, header, placement)
        self.gaps.see(no, event, header, placement)
        self.ends.see(no, event, header, placement)
        if placement.role is Role.RESPONSE:
            self._see_answer(no, event, header, placement, octets)
        elif placement.role is Role.EITHER:
            self.open = self.broadcast = None
        else:
            self.newest = placement.tx
            self._see_request(AskedRequest(no, event, header, octets, is_behind_silence), placement)
        if header.ok and octets and octets[0] > LAST_STANDARD_UNIT:
            self.station(octets[0]).reserved.add(event.start, no)

    def _note_said(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """Where times do not tell: what a request says; an answer that seemed unfit may have been the same request."""
        is_request = placement is not None and placement.role is not Role.RESPONSE and header is not None and header.ok
        self.said[no] = readable_adu(event) if is_request and isinstance(event, Frame) else b""
        if len(self.said) > OPEN_KEPT:
            del self.said[next(iter(self.said))]
        self.settle_unfit(no)

    def _see_silence(self, gap: int, placement: Placement | None) -> None:
        """A long silence before a row: what was given up in it as not answered may have been, and nobody waited."""
        asked = self.open
        is_answer = placement is not None and placement.tx == self.newest
        if asked is None or is_answer or not self.silences.note(asked.no, gap):
            return
        self.open = None
        for tx, lost in list(self.lost.items()):
            if lost.no == asked.no:
                self.station(lost.unit).withdraw(self.lost.pop(tx))

    def _see_request(self, asked: AskedRequest, placement: Placement) -> None:
        if len(self.asked) < OPEN_KEPT:
            self.asked[placement.tx] = asked
        if not asked.header.ok:
            self._note_flaw(placement.tx, asked.frame)
        if self._is_no_request(asked):
            self.no_requests.append(asked.no)
            self.open = self.broadcast = None
            return
        self.seen.requests += 1
        if asked.header.ok and len(asked.octets) > BEGIN and len(self.begins) < OPEN_KEPT:
            self.begins.add(asked.octets[:BEGIN])
        if self.open is not None:
            self.waited_in_vain(self.open, asked)
        is_broadcast = placement.role is Role.BROADCAST or (asked.unit == BROADCAST and not asked.is_for_nobody)
        self.open = None if is_broadcast or not asked.header.ok else asked
        self.broadcast = asked if is_broadcast and asked.header.ok else None

    def _is_no_request(self, asked: AskedRequest) -> bool:
        """Whether it is an answer in the shape of a request: to a broadcast, or by another unit than the one asked."""
        if self.broadcast is not None and self._is_answer_to_broadcast(asked):
            self.copies_of_broadcast[asked.no] = self.broadcast.no, asked
            if asked.unit == BROADCAST or len(self.copies_of_broadcast) > OPEN_KEPT:
                self._count_copy(next(iter(self.copies_of_broadcast)))
            return True
        if self.open is not None and self._is_answer_of_another(self.open, asked):
            self.seen.pair((self.open.unit, asked.unit)).add(asked.frame.start, self.open.no, asked.no)
            self.elsewhere[self.open.no] = asked.unit
            return True
        return False

    def settle_copy(self, transaction: Transaction) -> None:
        """What says the same as the broadcast before it: a station's answer to that, or a request that has its own."""
        no = transaction.request or transaction.response or 0
        if no not in self.copies_of_broadcast or transaction.verdict is Verdict.OPEN:
            return
        if transaction.request == no and transaction.response is not None:
            del self.copies_of_broadcast[no]
            self.seen.requests += 1
            if no in self.no_requests:
                self.no_requests.remove(no)
        else:
            self._count_copy(no)

    def _count_copy(self, no: int) -> None:
        before, said = self.copies_of_broadcast.pop(no)
        self.seen.answers_to_broadcast.add(said.frame.start, before, no)
        self.seen.broadcast_answers[said.unit] += 1

    def waited_in_vain(self, before: AskedRequest, asked: AskedRequest) -> None:
        """A request after another that nothing has followed."""
        self.station(before.unit).waited += max(0, asked.frame.start - before.frame.start)
        if not asked.header.ok or before.is_for_nobody:
            return
        gap = max(0, asked.frame.start - before.frame.end)
        if asked.octets == before.octets:
            if gap > self.timing.t35 + self.timing.latency and before.header.role is Role.REQUEST:  # no echo
                self.learnt.unanswered(gap, repeated=True)
            return
        if before.header.role is not Role.REQUEST:  # a write has the shape of its answer, which may have come late
            return
        self.learnt.unanswered(gap)
        turn = self.learnt.turn(before.unit, before.answer_time(self.timing.char), gap)
        if turn is not None and gap < turn[0]:
            self.hasty.append(before.no)
        elif turn is not None and gap > turn[1]:
            self.waited_for.append(before.no)
        elif turn is not None and not self.learnt.may_hide_a_wait(gap):
            self.unheard.append(before.no)
        late = () if asked.header.role is Role.REQUEST else ((asked.in_list, before.in_list),)
        self.waits[before.no] = gap, asked.no, ((before.in_list, asked.in_list), *late)
        if len(self.waits) > LOST_KEPT:
            del self.waits[next(iter(self.waits))]
        row = gap + before.frame.slack, before.unit, asked.frame.start, before.no, asked.no, late
        self.seen.broke_in(self.seen.hasty, row)

    def _see_answer(self, no: int, frame: Frame, header: Header, placement: Placement, octets: bytes) -> None:
        if not self.seen.answers and not self.seen.requests:
            self.before_all = no
        self.seen.answers += 1
        if self.broadcast is not None and frame.start - self.broadcast.frame.end < TURNAROUND:
            self.seen.answers_to_broadcast.add(frame.start, self.broadcast.no, no)
        if self.broadcast is not None and placement.source is not None:
            self.seen.broadcast_answers[placement.source] += 1
        self.broadcast = self.open = None
        if header.ok:
            is_exception = len(octets) > 2 and bool(octets[1] & EXCEPTION_BIT)
            if header.error is not None and is_exception:
                self.codes[placement.tx] = octets[2]
                if len(self.codes) > OPEN_KEPT:
                    self.codes.clear()
            else:
                self.answers[placement.tx] = octets
                if len(self.answers) > OPEN_KEPT:
                    self.answers.clear()
                if header.error is not None:
                    self.contradictory.append(placement.tx)
        elif placement.source is not None:
            self.damaged.append(placement.tx)
            self._gather(frame)
            self._note_flaw(placement.tx, frame)
            self.bad_ends[placement.tx] = placement.source, no, frame
            if len(self.bad_ends) > OPEN_KEPT:
                self.bad_ends.clear()

    def _see_noise(self, no: int, event: Event) -> None:
        if self.broadcast is not None and event.start - self.broadcast.frame.end < TURNAROUND:
            if len(event.octets) >= 3:
                self.seen.noise_after_broadcast.add(event.start, self.broadcast.no, no)
            return
        if self.open is None and self.broadcast is None and len(event.octets) >= BEGIN:
            self.seen.late_speakers.noise(event.start, no)
        self.broadcast = None

    def _is_answer_to_broadcast(self, asked: AskedRequest) -> bool:
        """Whether what looks like a request is a station's copy of the broadcast before it, as itself or as 0."""
        broadcast = self.broadcast
        if broadcast is None or asked.octets[1:] != broadcast.octets[1:] or (self.seen.echoes and not asked.unit):
            return False
        gap = asked.frame.start - broadcast.frame.end
        soonest = 0 if asked.unit else self.timing.char + self.timing.latency  # an echo names all, as what it repeats
        return soonest <= gap < TURNAROUND

    def _is_answer_of_another(self, before: AskedRequest, asked: AskedRequest) -> bool:
        """Whether what looks like a request is the copy of the one before it, by a unit that is known to answer so: a
        read is no answer, and where the station mostly answers itself, another's answer was one to a lost request."""
        may_be = asked.header.role is not Role.REQUEST and asked.octets[1:] == before.octets[1:]
        return may_be and self.seen.is_answered_elsewhere(before.unit, asked.unit)

    def _gather(self, event: Event) -> None:
        """Keep octets that are no good frame, in the transaction of the newest request."""
        tx = self.newest
        if tx is None:
            return
        before = self.stray.get(tx, b"")
        self.stray[tx] = (before + event.octets)[:STRAY_KEPT]
        if event.marks:
            self.marked.append(tx)
        if len(self.stray) > OPEN_KEPT:
            self.stray.clear()

    def _note_flaw(self, tx: int, frame: Frame) -> None:
        if frame.repair is not None:
            self.flaws[tx] = frame.repair.flaw
            if len(self.flaws) > OPEN_KEPT:
                self.flaws.clear()

    def _see_broken(self, no: int, event: Event, octets: bytes) -> None:
        """A damaged frame that begins as a request to another station, while one is asked: somebody else spoke."""
        asked, begin = self.open, octets[:BEGIN]
        if asked is None or begin not in self.begins or begin[0] == asked.unit:
            return
        gap = max(0, event.start - asked.frame.end)
        row = gap + asked.frame.slack, asked.unit, event.start, asked.no, no, ()
        self.seen.broke_in(self.seen.broken_in, row)

    def _is_cut_echo(self, no: int, event: Event) -> bool:
        """Whether it is the begin of the request before it, given back at once and cut short, or goes on with that."""
        is_first = not self.given_back.octets
        if not self.given_back.takes(event, AT_ONCE):
            return False
        if is_first:
            self.seen.cut_echoes.add(event.start, no)
        return True

    def _await_cut_echo(self, frame: Frame, header: Header, placement: Placement) -> None:
        """A good frame: what stands behind it may be its own begin, where it may be a request."""
        within = AT_ONCE if header.role is Role.REQUEST else self.timing.t35
        self.given_back = CutEcho() if placement.role is Role.RESPONSE else CutEcho(frame, within)

    def came_late(self, transaction: Transaction) -> bool:
        """Whether a row of it, or the next one, came in a late read; behind a request noise that came in answer."""
        request, response = transaction.request or transaction.response or 0, transaction.response or 0
        is_noise = not response and transaction.verdict is Verdict.DAMAGED_ANSWER
        return self.late.among(request, max(request, response) + 1 + is_noise)

    def may_be_next_request(self, transaction: Transaction, answer: bytes) -> bool:
        """Whether a second answer may be the master's next request, the same again: it, or the frame before it, was
        read too late to say how long the master paused."""
        row = transaction.response
        if row is None or not self.late.among(row - 1, row) or len(answer) < 2 or answer[1] & EXCEPTION_BIT:
            return False
        return answer[1] in COPIED or answer[1] not in FUNCTIONS
