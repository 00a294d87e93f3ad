"""The observer of a Modbus line: remembers each row and transaction. `rules_bus.py` puts it into words.

Implements `dissectors.findings.Judge` for RTU and ASCII. An adapter's delay is always taken off in favour of the
station: it is slow when even the shortest reading is too long, too quick when even the longest is too short.
"""

from __future__ import annotations

from collections.abc import Callable

from dissectors.checksums import crc16_modbus
from dissectors.findings import ExceptionWords, Finding, Tally
from dissectors.frame import Damage, Event, Flaw, Frame, Header, Noise, Role
from dissectors.line import MS
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.envelope import RTU_NAME, readable_adu, rtu_check
from dissectors.modbus.exchange import is_begin_of
from dissectors.modbus.functions import BROADCAST, COPIED, EXCEPTION_BIT, FUNCTIONS, answer_length
from dissectors.modbus.learned_timing import READ
from dissectors.modbus.long_silences import SILENCE_LEAST
from dissectors.modbus.pairing import is_answer
from dissectors.modbus.remembered import (
    BEGIN,
    FINAL_KEPT,
    HASTY_KEPT,
    LAST_STANDARD_UNIT,
    LOST_KEPT,
    OPEN_KEPT,
    SLOW_UNLEARNT,
    Remembered,
    slow_limit,
)
from dissectors.modbus.response_groups import AnsweredRequest
from dissectors.modbus.rules_bus import judge
from dissectors.modbus.station_record import Lost, StationRecord
from dissectors.tracker import Placement, Transaction, Verdict

TURNAROUND = 90 * MS
"""Nobody speaks so soon after a broadcast: the master waits 100 … 200 ms (Modbus over Serial Line V1.02, 2.4.1)."""

AT_ONCE = 50 * MS
"""No master repeats a request so soon."""

_NO_WAIT = 10 * MS  # no master gives up so soon: it does not wait for one answer before it asks for the next
_STRAY_KEPT = 600  # octets, more than the longest frame; of more nothing is said
_EXCESS_KEPT = 256
_WORDS_KEPT = 16
_TALKED_OVER = 3  # octets by which an answer must be too long before somebody else has spoken
_MAY_BE_TORN = (Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST, Verdict.NO_RESPONSE)
_SETTLED_ELSEWHERE = (Verdict.ECHO, Verdict.DATA, Verdict.OPEN, Verdict.BROADCAST)


class ModbusFindings(Remembered):
    """Fed row by row and transaction by transaction; gives findings at any time."""

    # ---- the contract

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """See `dissectors.findings.Judge`."""
        seen = self.seen
        gap = event.start - seen.now
        seen.first = event.start if seen.first is None else seen.first
        seen.now = max(seen.now, event.end)
        if self._is_cut_echo(event):
            seen.cut_echoes.add(event.start, no)
            return
        is_behind_silence = gap >= SILENCE_LEAST and self.silences.is_one(gap)
        if is_behind_silence:
            self._see_silence(gap, placement)
        tx = self.newest if placement is None or header is None else placement.tx
        self.torn.see(no, event, tx, is_good_frame=header is not None and header.ok)
        if isinstance(event, Noise) or header is None or placement is None:
            self._gather(event)
            self._see_broken(no, event, event.octets)
            self._see_noise(no, event)
            self.open = None
            self.gaps.hear_noise()
            self.ends.hear_noise(event)
            return
        if event.slack > self.timing.latency + MS:
            self.late_read = no
        octets = readable_adu(event)
        if not header.ok:
            self._see_broken(no, event, octets)
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

    def settle(self, transaction: Transaction) -> None:
        """See `dissectors.findings.Judge`."""
        asked = self.asked.pop(transaction.id, None)
        code = self.codes.pop(transaction.id, None)
        answer = self.answers.pop(transaction.id, b"")
        stray, flaw = self.stray.pop(transaction.id, b""), self.flaws.pop(transaction.id, None)
        ended = self.bad_ends.pop(transaction.id, None)
        verdict = transaction.verdict
        if verdict in _SETTLED_ELSEWHERE:
            if verdict is Verdict.ECHO:
                self.seen.echoes += 1
                self.copied.append(transaction.of)
                if transaction.station is not None:
                    station = self.station(transaction.station)
                    station.echoed += 1
                    original = self.asked.get(transaction.of or 0)
                    if original is not None and original.header.role is Role.REQUEST:
                        station.request(original.key).echoed += 1
            if verdict is Verdict.BROADCAST and asked is not None:
                self.seen.cycles.add(asked.octets, asked.key, transaction.start)
            return
        damaged = verdict in (Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST)
        if damaged and self.late_read >= (transaction.request or transaction.response or 0):
            return  # a frame was torn by a late read, not spoilt
        if self._is_torn(transaction, asked):
            return
        if ended is not None:
            self._see_end(*ended)
            if asked is not None and flaw in (Flaw.FIRST_MISSING, Flaw.FIRST_SPOILT):
                waited = max(0, ended[2].start - asked.frame.end)
                self.station(ended[0]).first_lost.add(waited, asked.no, ended[1])
        if verdict is Verdict.DAMAGED_REQUEST:
            octets = asked.frame.octets if asked is not None else b""
            self.seen.strikes.struck("master")
            self.seen.late_speakers.damaged_request(octets, transaction.start, transaction.request)
            self.seen.damaged_requests.add(transaction.start, transaction.request)
            if flaw is not None:
                tallies = self.seen.requests_damaged_by
                tallies.setdefault(flaw, Tally()).add(transaction.start, transaction.request)
            return
        if asked is not None and asked.is_for_nobody:
            self._settle_for_nobody(transaction, asked)
            return
        if verdict is Verdict.UNSOLICITED:
            self._settle_unasked(transaction, ended)
            return
        if transaction.station is None:
            return
        station = self.station(transaction.station)
        if verdict is Verdict.UNDECIDED:
            station.undecided.add(transaction.start, transaction.request, transaction.response)
            return
        if transaction.attempt > 1:
            self.repeats.append(transaction.id)
        if verdict is Verdict.ANSWERED_TWICE and transaction.of in self.copied:
            self.seen.asked_twice.add(transaction.start, transaction.response)  # what seemed an echo had its answer
        elif verdict is Verdict.ANSWERED_TWICE and self._may_be_next_request(transaction, answer):
            station.undecided.add(transaction.start, transaction.request, transaction.response)
        elif verdict is Verdict.ANSWERED_TWICE and transaction.of not in self.repeats:
            station.twice.add(transaction.start, transaction.response)
            first = self.final.get(transaction.of or 0)
            station.same_twice += not answer or first is None or first == answer
        elif verdict in (Verdict.LATE, Verdict.ANSWERED_TWICE):  # each try has its answer, the first one came late
            self._settle_late(station, transaction)
        elif asked is not None:
            if answer:
                self.final[transaction.id] = answer
                if len(self.final) > FINAL_KEPT:
                    del self.final[next(iter(self.final))]
            damaged = verdict is Verdict.DAMAGED_ANSWER and asked.no not in self.no_requests
            if damaged:
                self._see_hit(transaction, asked, stray)
            self.settle_request(station, transaction, asked, code, answer, is_disturbed=bool(stray))
            if damaged:
                self._settle_damaged(station, transaction, asked, stray, flaw)

    def _may_be_next_request(self, transaction: Transaction, answer: bytes) -> bool:
        """Whether a second answer may be the master's next request, the same again: it, or the frame before it, was
        read too late to say how long the master paused."""
        row = transaction.response
        if row is None or self.late_read < row - 1 or len(answer) < 2 or answer[1] & EXCEPTION_BIT:
            return False
        return answer[1] in COPIED or answer[1] not in FUNCTIONS

    def word_exceptions(self, words: ExceptionWords) -> None:
        """See `dissectors.findings.WordsExceptions`."""
        self.seen.maker_words = words

    def know_stations(self, said: Callable[[int], bool]) -> None:
        """See `dissectors.findings.KnowsStations`."""
        self.seen.has_numbers = said

    def findings(self) -> tuple[Finding, ...]:
        """See `dissectors.findings.Judge`."""
        self.gaps.judge_slow(left=0)
        return judge(self.seen, self.learnt.timeout)

    # ---- rows

    def _see_silence(self, gap: int, placement: Placement | None) -> None:
        """A long silence before a row: what was given up in it as not answered may have been."""
        asked = self.open
        is_answer = placement is not None and placement.tx == self.newest
        if asked is None or is_answer or not self.silences.note(asked.no, gap):
            return
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
            self.seen.answers_to_broadcast.add(asked.frame.start, self.broadcast.no, asked.no)
            self.seen.broadcast_answers[asked.unit] += 1
            return True
        if self.open is not None and self._is_answer_of_another(self.open, asked):
            self.seen.pair((self.open.unit, asked.unit)).add(asked.frame.start, self.open.no, asked.no)
            self.elsewhere[self.open.no] = asked.unit
            return True
        return False

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
        turn = self.learnt.turn(before.unit, before.answer_time(self.timing.char))
        if turn is not None:
            kind = self.hasty if gap < turn[0] else self.unheard if gap <= turn[1] else self.waited_for
            kind.append(before.no)
        self.waits[before.no] = gap
        if len(self.waits) > LOST_KEPT:
            del self.waits[next(iter(self.waits))]
        if len(self.seen.hasty) < HASTY_KEPT:
            self.seen.hasty.append((gap + before.frame.slack, before.unit, asked.frame.start, before.no, asked.no))

    def _see_answer(self, no: int, frame: Frame, header: Header, placement: Placement, octets: bytes) -> None:
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
        return self.timing.char + self.timing.latency < gap < TURNAROUND

    def _is_answer_of_another(self, before: AskedRequest, asked: AskedRequest) -> bool:
        """Whether what looks like a request is the copy of the one before it, by a unit that is known to answer so."""
        return asked.octets[1:] == before.octets[1:] and (before.unit, asked.unit) in self.seen.pairs

    # ---- transactions

    def _is_torn(self, transaction: Transaction, asked: AskedRequest | None) -> bool:
        """Whether a late read made of it what it seems; where a station's frames are so often, it is the station."""
        verdict, torn = transaction.verdict, self.torn
        if verdict in (Verdict.UNSOLICITED, Verdict.LATE, Verdict.ANSWERED_TWICE):
            return torn.may_answer(transaction.response)
        is_either = asked is not None and asked.header.role is Role.EITHER
        if verdict is Verdict.NO_RESPONSE and is_either and torn.may_answer(transaction.request):
            return True  # no request, but the confirmation of the one that was torn
        if verdict not in _MAY_BE_TORN or not torn.is_torn(transaction.id):
            return False
        unit = transaction.station
        return unit is None or torn.is_seldom(unit, self.station(unit).asked)

    def _see_end(self, unit: int, no: int, frame: Frame) -> None:
        """How a damaged answer of a station, in that row, ended."""
        station = self.station(unit)
        station.cut += frame.damage is Damage.SHORT
        check = rtu_check(frame) if frame.protocol == RTU_NAME and frame.damage is Damage.CHECK else None
        if check is not None and not frame.marks:
            station.wrong_check(check[0] ^ check[1], len(frame.octets)).add(frame.end, no, check[1])
        if _ends_badly(frame):
            station.last_octet.add(frame.end, no)

    def _settle_unasked(self, transaction: Transaction, ended: tuple[int, int, Frame] | None) -> None:
        """An answer that fits no request: of another unit than the one asked, or of nobody's asking. `ended`: itself,
        with its station and row, where it is damaged."""
        other = self.asked.get(transaction.of) if transaction.of is not None else None
        if other is not None and transaction.station is not None and transaction.station != other.unit:
            self.elsewhere[other.no] = transaction.station
            if len(self.elsewhere) > OPEN_KEPT:
                self.elsewhere.clear()
            pair = (other.unit, transaction.station)
            self.seen.pair(pair).add(transaction.start, other.no, transaction.response)
            return
        if transaction.response in self.no_requests:
            return
        if not self.seen.requests and self.seen.answers == 1:
            return  # the capture began between a request and its answer
        if transaction.id in self.damaged:  # more likely a request, when nobody was asked
            octets = ended[2].octets if ended is not None else b""
            self.seen.late_speakers.damaged_request(octets, transaction.start, transaction.response)
            if self.seen.late_speakers.shows(octets, transaction.start):
                return
            self.seen.strikes.struck("master")
            self.seen.damaged_requests.add(transaction.start, transaction.response)
            return
        self.seen.unasked.add(transaction.start, transaction.response)

    def settle_request(
        self,
        station: StationRecord,
        transaction: Transaction,
        asked: AskedRequest,
        code: int | None,
        answer: bytes,
        is_disturbed: bool = False,
    ) -> None:
        """A request that closed, with its answer, the code of its exception, or neither. `is_disturbed`: octets
        that are no good frame came before the answer."""
        verdict = transaction.verdict
        if asked.no in self.no_requests:
            return
        if verdict is Verdict.NO_RESPONSE and asked.no in self.elsewhere:
            del self.elsewhere[asked.no]  # the pair is reported instead
            self.seen.repeated_elsewhere[asked.unit] += transaction.attempt > 1
            return
        if verdict is Verdict.NO_RESPONSE:
            may_be_answer = asked.is_behind_silence and asked.header.role is not Role.REQUEST
            if may_be_answer or self.silences.hide_answer_to(asked.no):
                return
        if asked.fault is not None:
            self.seen.malformed.add(transaction.start, transaction.request, transaction.response)
            if len(self.seen.malformed_words) < _WORDS_KEPT:
                self.seen.malformed_words[asked.fault] += 1
        request = station.request(asked.key)
        request.tries += 1
        if transaction.attempt == 1:
            request.turns += 1
            self.seen.cycles.add(asked.octets, asked.key, transaction.start)
        else:
            after = transaction.start - station.last_start
            if transaction.attempt == 2 and verdict in (Verdict.RETRY, Verdict.EXCEPTION):
                self.seen.again.add(asked.unit, transaction.start, after, transaction.request, transaction.response)
            else:
                self.seen.again.further += 1
            station.repeats.add(transaction.start, transaction.request)
            station.repeats_cost += max(0, transaction.start - station.last_start)
        station.last_start = transaction.start
        station.asked += 1
        if verdict is Verdict.NO_RESPONSE:
            request.missing.add(transaction.start, transaction.request)
            station.missing.add(transaction.start, transaction.request)
            station.silent.add(transaction.start, transaction.request)
            is_unheard = asked.no in self.unheard
            if is_unheard:
                station.unheard.add(transaction.start, transaction.request)
            elif asked.no not in self.hasty:  # who did not wait for it cannot have been spoken into
                self.seen.late_speakers.unanswered(
                    asked.unit, asked.due, transaction.start, transaction.end, self.learnt.timeout
                )
            is_waited_for = asked.no in self.waited_for
            station.waited_for += is_waited_for
            self.lost[transaction.id] = Lost(asked.unit, asked.key, asked.no, is_unheard, is_waited_for)
            if len(self.lost) > LOST_KEPT:
                del self.lost[next(iter(self.lost))]
            return
        station.heard(transaction.end)
        if verdict is Verdict.DAMAGED_ANSWER:
            self.seen.strikes.struck(f"station {asked.unit}")
            station.damaged.add(transaction.end, transaction.request, transaction.response)
            station.garbled += transaction.response is None
            return
        if not asked.header.ok and self.late_read < asked.no and not self.torn.is_torn(transaction.id):
            self.seen.damaged_here.add(transaction.start, transaction.request)
        self.seen.strikes.whole()
        self.seen.late_speakers.answered(asked.unit, f"station {asked.unit}", transaction.start)
        station.answered += 1
        station.copies += answer == asked.octets
        if transaction.latency is not None and not self.torn.is_torn(transaction.id):
            station.times.add(transaction.latency)
            if asked.header.ok and transaction.attempt == 1:
                self.learnt.answered(transaction.station or 0, READ, transaction.latency.nominal)
            self._compare_with_timeout(station, transaction, transaction.latency.low)
            if verdict is Verdict.ANSWERED and transaction.error is None and transaction.response is not None:
                came = AnsweredRequest(transaction.response, transaction.end, transaction.latency, answer)
                station.compare(asked.key, asked.octets, came)
        if verdict is Verdict.EXCEPTION:
            if asked.fault is None:
                station.exception(asked.key, code or 0).add(transaction.end, transaction.request, transaction.response)
            else:
                self.seen.malformed_codes[code or 0] += 1
        elif transaction.error is not None and asked.header.ok and self._is_unfit(transaction, asked, code, answer):
            if is_disturbed and self._answers_another(transaction, asked, answer):
                self.seen.crossed.add(transaction.end, transaction.request, transaction.response)
                return
            station.unfit.add(transaction.end, transaction.request, transaction.response)
            if len(station.unfit_words) < _WORDS_KEPT:
                station.unfit_words[transaction.error] += 1

    def _is_unfit(self, transaction: Transaction, asked: AskedRequest, code: int | None, answer: bytes) -> bool:
        """Whether the answer itself is not what was asked for: damage before a good answer is none of its faults."""
        if code is not None or transaction.id in self.contradictory:  # an exception to something else
            return True
        return bool(answer) and not is_answer(asked.octets, answer)

    def _answers_another(self, transaction: Transaction, asked: AskedRequest, answer: bytes) -> bool:
        """Whether an answer fits what that station is asked besides, and there was no time for a turn in between: the
        octets before it hide a request that came while this one waited."""
        turn = self.learnt.turn(asked.unit, asked.answer_time(self.timing.char))
        soon = turn is not None and transaction.latency is not None and transaction.latency.nominal <= turn[1]
        return soon and any(is_answer(other, answer) for other in self.seen.cycles.asked_of(asked.unit))

    def _compare_with_timeout(self, station: StationRecord, transaction: Transaction, least: int) -> None:
        """Whether an answer took long; counted anew when the timeout gets known, since the limit is another then."""
        limit = slow_limit(self.learnt.timeout)
        station.compare_with(limit, 1)
        if least > (SLOW_UNLEARNT if limit is None else limit):
            self.gaps.took_long(station.slow, transaction)

    def _settle_late(self, station: StationRecord, transaction: Transaction) -> None:
        """An answer after the next request: its own request is not lost; late only if the master has waited at all."""
        station.heard(transaction.end)
        self.seen.late(transaction.response)
        lost = self.lost.pop(transaction.of or 0, None)
        if lost is not None:
            station.forgive(lost)
            waited = self.waits.get(lost.no, AT_ONCE)
            if lost.no in self.hasty:
                self.seen.crossed.add(transaction.start, lost.no, transaction.response)
                return
            if waited < _NO_WAIT:
                return
        station.late.add(transaction.start, transaction.response)

    def _settle_for_nobody(self, transaction: Transaction, asked: AskedRequest) -> None:
        """A read of address 0, and who answered it."""
        seen = self.seen
        seen.to_nobody.add(transaction.start, transaction.request, transaction.response)
        if transaction.verdict in (Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION):
            seen.for_nobody[transaction.station or 0] += 1
        seen.cycles.add(asked.octets, asked.key, transaction.start)

    def _see_hit(self, transaction: Transaction, asked: AskedRequest, stray: bytes) -> None:
        """A damaged answer that the late one of another station may have hit."""
        self.seen.late_speakers.damaged_answer(
            asked.unit,
            f"station {asked.unit}",
            stray,
            transaction.start,
            *(transaction.request, transaction.response),
            is_longer=_excess(asked, stray) is not None,
        )

    def _settle_damaged(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, stray: bytes, flaw: Flaw | None
    ) -> None:
        """Something came in place of an answer: in what way it is wrong."""
        if flaw is not None:
            station.flaw(flaw).add(transaction.end, transaction.request, transaction.response)
            return
        if not stray:
            return
        if len(stray) == _STRAY_KEPT or self.seen.late_speakers.is_due_from_another(asked.unit, transaction.start):
            return  # two may have spoken at once, which says nothing of how this one speaks
        begins = stray[:1] == b":" if asked.frame.protocol != RTU_NAME else stray[:1] == asked.octets[:1]
        frames = transaction.request, transaction.response
        marked = transaction.id in self.marked
        station.garbage.add(stray, transaction.end, *frames, is_marked=marked, begins=begins)
        excess = _excess(asked, stray)
        if excess is not None and self._outlasts(transaction, asked):
            station.outlasting.add(transaction.end, transaction.request, transaction.response)
        elif excess is not None:
            station.talked_over.add(transaction.end, transaction.request, transaction.response)
            if len(station.excess) < _EXCESS_KEPT:
                station.excess.append(excess)

    def _outlasts(self, transaction: Transaction, asked: AskedRequest) -> bool:
        """Whether what came was not over when the master gave up: it is the master that spoke into it."""
        timeout = self.learnt.timeout
        return timeout is not None and transaction.end - asked.frame.end > timeout - self.timing.latency

    def _gather(self, event: Event) -> None:
        """Keep octets that are no good frame, in the transaction of the newest request."""
        tx = self.newest
        if tx is None:
            return
        before = self.stray.get(tx, b"")
        self.stray[tx] = (before + event.octets)[:_STRAY_KEPT]
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
        if len(self.seen.broken_in) < HASTY_KEPT:
            self.seen.broken_in.append((gap + asked.frame.slack, asked.unit, event.start, asked.no, no))

    def _is_cut_echo(self, event: Event) -> bool:
        """Whether it is the begin of the request before it, given back at once and cut short."""
        asked = self.open
        if asked is None or not is_begin_of(event.octets, asked.frame.octets):
            return False
        gap = max(0, event.start - asked.frame.end)
        return gap < (AT_ONCE if asked.header.role is Role.REQUEST else self.timing.t35)


def _excess(asked: AskedRequest, stray: bytes) -> int | None:
    """By how many octets what came is too long, where it began as the answer; None where it did not, or is not."""
    if asked.frame.protocol != RTU_NAME or stray[:2] != asked.octets[:2] or stray[1] not in FUNCTIONS:
        return None
    expected = answer_length(asked.frame.octets)
    excess = len(stray) - expected if expected is not None else 0
    return excess if excess >= _TALKED_OVER else None


def _ends_badly(frame: Frame) -> bool:
    """Whether a damaged frame is right up to its last octet, or ends just before it."""
    if frame.damage is Damage.SHORT:
        if frame.expected is None or frame.expected - len(frame.octets) != 1:
            return False
        # an octet lost further in leaves a wrong check
        return frame.protocol != RTU_NAME or frame.octets[-1] == crc16_modbus(frame.octets[:-1]) & 0xFF
    if frame.damage is not Damage.CHECK:
        return False
    if frame.marks:
        return all(mark.offset == len(frame.octets) - 1 for mark in frame.marks)
    check = rtu_check(frame) if frame.protocol == RTU_NAME else None
    return check is not None and check[0] >> 8 == check[1] >> 8
