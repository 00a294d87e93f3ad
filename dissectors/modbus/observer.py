"""The observer of a Modbus line: remembers each row and transaction. `rules_bus.py` puts it into words.

Implements `dissectors.findings.Judge` for RTU and ASCII. An adapter's delay is always taken off in favour of the
station: it is slow when even the shortest reading is too long, too quick when even the longest is too short.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dissectors.findings import ExceptionWords, Finding, Tally
from dissectors.frame import Damage, Flaw, Frame, Role
from dissectors.line import MS
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.check_mistakes import ways
from dissectors.modbus.envelope import RTU_NAME
from dissectors.modbus.exchange import is_begin_of
from dissectors.modbus.learned_timing import READ
from dissectors.modbus.limits import ILLEGAL
from dissectors.modbus.pairing import is_answer
from dissectors.modbus.remembered import FINAL_KEPT, LOST_KEPT, OPEN_KEPT, SLOW_UNLEARNT, Unfit, slow_limit
from dissectors.modbus.response_groups import AnsweredRequest
from dissectors.modbus.row_observer import AT_ONCE, STRAY_KEPT, RowObserver
from dissectors.modbus.rules_bus import judge
from dissectors.modbus.second_answers import SecondAnswer, owed
from dissectors.modbus.station_record import Lost, StationRecord
from dissectors.modbus.wrong_ends import ends_badly, excess_of
from dissectors.tracker import Transaction, Verdict

_NO_WAIT = 10 * MS  # no master gives up so soon: it does not wait for one answer before it asks for the next
_EXCESS_KEPT = 256
_MAY_BE_TORN = (Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST, Verdict.NO_RESPONSE)
_SETTLED_ELSEWHERE = (Verdict.ECHO, Verdict.DATA, Verdict.OPEN, Verdict.BROADCAST)


class ModbusFindings(RowObserver):
    """Fed row by row and transaction by transaction; gives findings at any time."""

    # ---- the contract

    def settle(self, transaction: Transaction) -> None:
        """See `dissectors.findings.Judge`."""
        self.settle_copy(transaction)
        asked = self.asked.pop(transaction.id, None)
        code, answer = self.codes.pop(transaction.id, None), self.answers.pop(transaction.id, b"")
        stray, flaw = self.stray.pop(transaction.id, b""), self.flaws.pop(transaction.id, None)
        ended = self.bad_ends.pop(transaction.id, None)
        if (second := self.seconds.pop(transaction.id, None)) is not None and transaction.verdict is not Verdict.OPEN:
            if transaction.verdict is Verdict.NO_RESPONSE and asked is not None:
                transaction, answer = second.in_answer_to(transaction, asked), second.octets
            else:
                second.count()
        verdict = transaction.verdict
        if stray and asked is not None and self._came_back_in_pieces(asked, stray, verdict):
            self.seen.cut_echoes.add(transaction.start, asked.no)
            stray, flaw, ended = b"", None, None
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
        if verdict in (Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST) and self.came_late(transaction):
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
            if asked is not None:
                self.seen.checks_of_requests.see(asked.no, asked.frame.end, ways(asked.frame))
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
            if (lost := self.lost.pop(transaction.of or 0, None)) is not None:
                station.forgive(lost)  # perhaps this is its answer
            return
        if transaction.attempt > 1:
            self.repeats.append(transaction.id)
        if verdict is Verdict.ANSWERED_TWICE and transaction.of in self.copied:
            self.seen.asked_twice.add(transaction.start, transaction.response)  # what seemed an echo had its answer
        elif verdict is Verdict.ANSWERED_TWICE and self.may_be_next_request(transaction, answer):
            station.undecided.add(transaction.start, transaction.request, transaction.response)
        elif verdict is Verdict.ANSWERED_TWICE and transaction.of not in self.repeats:
            self._settle_second(station, transaction, answer)
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

    def _came_back_in_pieces(self, asked: AskedRequest, stray: bytes, verdict: Verdict) -> bool:
        """Whether what came behind a request is its begin, cut short, and was no answer by the times of its pieces."""
        return verdict is not Verdict.DAMAGED_ANSWER and is_begin_of(stray, asked.frame.octets)

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

    # ---- transactions

    def _is_torn(self, transaction: Transaction, asked: AskedRequest | None) -> bool:
        """Whether a late read, or a pause of the sender, made of it what it seems: LN206 tells whose are torn."""
        verdict, torn = transaction.verdict, self.torn
        if verdict in (Verdict.UNSOLICITED, Verdict.LATE, Verdict.ANSWERED_TWICE):
            return torn.may_answer(transaction.response)
        is_either = asked is not None and asked.header.role is Role.EITHER
        if verdict is Verdict.NO_RESPONSE and is_either and torn.may_answer(transaction.request):
            return True  # no request, but the confirmation of the one that was torn
        return verdict in _MAY_BE_TORN and torn.is_torn(transaction.id)

    def _see_end(self, unit: int, no: int, frame: Frame) -> None:
        """How a damaged answer of a station, in that row, ended."""
        station = self.station(unit)
        station.cut += frame.damage is Damage.SHORT
        station.checks.see(no, frame.end, ways(frame))
        if ends_badly(frame):
            station.last_octet.add(frame.end, no)

    def _settle_unasked(self, transaction: Transaction, ended: tuple[int, int, Frame] | None) -> None:
        """An answer that fits no request: of another unit than the one asked, or of nobody's asking. `ended`: itself,
        with its station and row, where it is damaged."""
        if transaction.of is not None and transaction.of == self.newest_for_nobody:
            self.seen.for_nobody[transaction.station or 0] += 1
            return
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
        if transaction.response == self.before_all:
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
        self.seen.unasked_behind_noise += transaction.response == self.rubbish + 1

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
            if may_be_answer or self.silences.may_have_been_answered(asked.no):
                return
        why = asked.fault
        is_carried_out = (asked.key, asked.octets) in station.same
        if why is None and (code in ILLEGAL or (verdict is Verdict.NO_RESPONSE and not is_carried_out)):
            why = asked.beyond
        if why is not None:
            self.seen.cannot_be(why, transaction.start, transaction.request, transaction.response)
            if verdict is Verdict.NO_RESPONSE:  # a station may pass over it
                self.seen.malformed_unanswered += 1
                return
        request = station.request(asked.key)
        request.tries += 1
        if transaction.attempt == 1:
            request.turns += 1
            self.seen.cycles.add(asked.octets, asked.key, transaction.start)
        else:
            self._settle_repeat(station, transaction, asked)
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
            self.lost[transaction.id] = Lost(
                asked.unit, asked.key, asked.no, asked.frame.end, is_unheard, is_waited_for
            )
            if len(self.lost) > LOST_KEPT:
                del self.lost[next(iter(self.lost))]
            return
        station.heard(transaction.end)
        if verdict is Verdict.DAMAGED_ANSWER:
            self.seen.strikes.struck(f"station {asked.unit}")
            station.damaged.add(transaction.end, transaction.request, transaction.response)
            station.garbled += transaction.response is None
            return
        if not asked.header.ok and not self.came_late(transaction) and not self.torn.is_torn(transaction.id):
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
            if why is None:
                station.exception(asked.key, code or 0).add(transaction.end, transaction.request, transaction.response)
            else:
                self.seen.malformed_codes[code or 0] += 1
        elif transaction.error is not None and asked.header.ok and self._is_unfit(transaction, asked, code, answer):
            if is_disturbed and (ways_round := self.seen.cycles.beside(asked.in_list, answer)):
                if self._is_within_a_turn(transaction, asked):
                    self.seen.cross(ways_round, transaction.end, transaction.request, transaction.response)
                return  # its own request is in the octets before
            unfit = Unfit(station, transaction, answer)
            if self.timing.latency < AT_ONCE or asked.header.role is Role.REQUEST:
                unfit.count()
            else:
                self.unfit = unfit
                self.settle_unfit(next(reversed(self.said), 0))

    def _settle_repeat(self, station: StationRecord, transaction: Transaction, asked: AskedRequest) -> None:
        """A request that was sent again. What was not held against the station is no try before it."""
        before = station.last_start
        after = 0 if before is None else transaction.start - before
        is_second = transaction.attempt == 2 and before is not None
        if is_second and transaction.verdict in (Verdict.RETRY, Verdict.EXCEPTION):
            self.seen.again.add(asked.unit, transaction.start, after, transaction.request, transaction.response)
        else:
            self.seen.again.further += 1
        if before is not None:
            station.repeats.add(transaction.start, transaction.request)
            station.repeats_cost += max(0, after)

    def _is_unfit(self, transaction: Transaction, asked: AskedRequest, code: int | None, answer: bytes) -> bool:
        """Whether the answer itself is not what was asked for: damage before a good answer is none of its faults."""
        if code is not None or transaction.id in self.contradictory:  # an exception to something else
            return True
        return bool(answer) and not is_answer(asked.octets, answer)

    def _is_within_a_turn(self, transaction: Transaction, asked: AskedRequest) -> bool:
        """Whether an answer came too soon for another request to have been asked and answered since."""
        turn = self.learnt.turn(asked.unit, asked.answer_time(self.timing.char))
        return turn is not None and transaction.latency is not None and transaction.latency.nominal <= turn[1]

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
            waited, ended_by, neighbours = self.waits.get(lost.no, (AT_ONCE, None, ()))
            if ended_by in self.seen.late_frames:
                return  # what ended the wait was no request, but another late answer
            if lost.no in self.hasty:
                self.seen.cross(neighbours, transaction.start, lost.no, transaction.response)
                return
            timeout = self.learnt.timeout
            if waited < (_NO_WAIT if timeout is not None and timeout < 2 * AT_ONCE else AT_ONCE):
                return
        station.late.add(transaction.start, transaction.response)

    def _settle_second(self, station: StationRecord, transaction: Transaction, answer: bytes) -> None:
        """A second answer, unless it is the late one to a request that the station left; where it comes into the wait
        for another, what becomes of that decides."""
        left = owed(self.lost, transaction, self.learnt.timeout)
        if left is not None:
            self._settle_late(station, replace(transaction, of=left))
            return
        second = SecondAnswer(station, transaction, answer, self.final.get(transaction.of or 0))
        tx, waiting = self.newest or 0, self.asked.get(self.newest or 0)
        if waiting is not None and waiting.unit == transaction.station and answer and tx not in self.seconds:
            self.seconds[tx] = second
        else:
            second.count()

    def _settle_for_nobody(self, transaction: Transaction, asked: AskedRequest) -> None:
        """A read of address 0, and who answered it."""
        seen = self.seen
        seen.to_nobody.add(transaction.start, transaction.request, transaction.response)
        self.newest_for_nobody = transaction.id
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
            is_longer=excess_of(asked, stray) is not None,
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
        if len(stray) == STRAY_KEPT or self.seen.late_speakers.is_due_from_another(asked.unit, transaction.start):
            return  # two may have spoken at once, which says nothing of how this one speaks
        station.garbage.of_text = asked.frame.protocol != RTU_NAME
        begins = stray[:1] == (b":" if station.garbage.of_text else asked.octets[:1])
        frames, marked = (transaction.request, transaction.response), transaction.id in self.marked
        station.garbage.add(stray, transaction.end, *frames, is_marked=marked, begins=begins)
        excess = excess_of(asked, stray)
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
