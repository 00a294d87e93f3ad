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
from dissectors.modbus.heard import Heard
from dissectors.modbus.remembered import FINAL_KEPT, OPEN_KEPT
from dissectors.modbus.request_observer import RequestObserver
from dissectors.modbus.row_observer import AT_ONCE, STRAY_KEPT
from dissectors.modbus.rules_bus import judge
from dissectors.modbus.second_answers import SecondAnswer, owed
from dissectors.modbus.station_record import StationRecord
from dissectors.modbus.text_changes import request_length, sent_length
from dissectors.modbus.wrong_ends import ends_badly, excess_of
from dissectors.tracker import Transaction, Verdict

_NO_WAIT = 10 * MS  # no master gives up so soon: it does not wait for one answer before it asks for the next
_EXCESS_KEPT = 256
_MAY_BE_TORN = (Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST, Verdict.NO_RESPONSE)
_SETTLED_ELSEWHERE = (Verdict.ECHO, Verdict.DATA, Verdict.OPEN, Verdict.BROADCAST)


class ModbusFindings(RequestObserver):
    """Fed row by row and transaction by transaction; gives findings at any time."""

    # ---- the contract

    def settle(self, transaction: Transaction) -> None:
        """See `dissectors.findings.Judge`."""
        self.settle_copy(transaction)
        transaction, heard = self._with_second_answer(transaction, self._take_heard(transaction.id))
        asked, verdict = heard.asked, transaction.verdict
        if asked is not None and heard.stray and self._came_back_in_pieces(asked, heard.stray, verdict):
            self.seen.cut_echoes.add(transaction.start, asked.no)
            heard = Heard(asked, heard.code, heard.answer)
        if verdict in _SETTLED_ELSEWHERE:
            self._settle_elsewhere(transaction, asked)
            return
        if verdict in (Verdict.DAMAGED_ANSWER, Verdict.DAMAGED_REQUEST) and self.came_late(transaction):
            return  # a frame was torn by a late read, not spoilt
        if self._is_torn(transaction, asked):
            return
        if heard.ended is not None:
            self._see_end(heard, *heard.ended)
        if verdict is Verdict.DAMAGED_REQUEST:
            self._settle_damaged_request(transaction, heard)
        elif asked is not None and asked.is_for_nobody:
            self._settle_for_nobody(transaction, asked)
        elif verdict is Verdict.UNSOLICITED:
            self._settle_unasked(transaction, heard.ended)
        elif transaction.station is not None:
            self._settle_of(self.station(transaction.station), transaction, heard)

    def _settle_of(self, station: StationRecord, transaction: Transaction, heard: Heard) -> None:
        """What a station was asked, and whether and when it answered."""
        verdict, asked = transaction.verdict, heard.asked
        if verdict is Verdict.UNDECIDED:
            station.undecided.add(transaction.start, transaction.request, transaction.response)
            if (lost := self.lost.pop(transaction.of or 0, None)) is not None:
                station.forgive(lost)  # perhaps this is its answer
            return
        if transaction.attempt > 1:
            self.repeats.append(transaction.id)
        if verdict is Verdict.ANSWERED_TWICE and transaction.of in self.copied:
            self.seen.asked_twice.add(transaction.start, transaction.response)  # what seemed an echo had its answer
        elif verdict is Verdict.ANSWERED_TWICE and self.may_be_next_request(transaction, heard.answer):
            station.undecided.add(transaction.start, transaction.request, transaction.response)
        elif verdict is Verdict.ANSWERED_TWICE and transaction.of not in self.repeats:
            self._settle_second(station, transaction, heard.answer)
        elif verdict in (Verdict.LATE, Verdict.ANSWERED_TWICE):  # each try has its answer, the first one came late
            self._settle_late(station, transaction)
        elif asked is not None:
            self._settle_asked(station, transaction, asked, heard)

    def _settle_asked(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, heard: Heard
    ) -> None:
        """A request with its own answer, good, damaged or none."""
        if heard.answer:
            self.final[transaction.id] = heard.answer
            if len(self.final) > FINAL_KEPT:
                del self.final[next(iter(self.final))]
        is_damaged = transaction.verdict is Verdict.DAMAGED_ANSWER and asked.no not in self.no_requests
        if is_damaged:
            self._see_hit(transaction, asked, heard.stray)
        self.settle_request(station, transaction, asked, heard)
        if is_damaged:
            self._settle_damaged(station, transaction, asked, heard)
        elif heard.answer or heard.code is not None:
            self.seen.carried_over.begin_anew()

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

    # ---- what was heard of a transaction

    def _take_heard(self, transaction: int) -> Heard:
        """What is kept of a transaction, which is not needed any more."""
        return Heard(
            self.asked.pop(transaction, None),
            self.codes.pop(transaction, None),
            self.answers.pop(transaction, b""),
            self.stray.pop(transaction, b""),
            self.flaws.pop(transaction, None),
            self.bad_ends.pop(transaction, None),
        )

    def _with_second_answer(self, transaction: Transaction, heard: Heard) -> tuple[Transaction, Heard]:
        """The same, answered by what seemed a second answer to another request where nothing else came."""
        second = self.seconds.pop(transaction.id, None)
        if second is None or transaction.verdict is Verdict.OPEN:
            return transaction, heard
        if transaction.verdict is Verdict.NO_RESPONSE and heard.asked is not None:
            return second.in_answer_to(transaction, heard.asked), replace(heard, answer=second.octets)
        second.count()
        return transaction, heard

    # ---- transactions

    def _settle_elsewhere(self, transaction: Transaction, asked: AskedRequest | None) -> None:
        """An echo, a broadcast, or what is no matter of requests and answers."""
        if transaction.verdict is Verdict.ECHO:
            self.seen.echoes += 1
            self.copied.append(transaction.of)
            if transaction.station is not None:
                station = self.station(transaction.station)
                station.echoed += 1
                original = self.asked.get(transaction.of or 0)
                if original is not None and original.header.role is Role.REQUEST:
                    station.request(original.key).echoed += 1
        elif transaction.verdict is Verdict.BROADCAST and asked is not None:
            self.seen.cycles.add(asked.octets, asked.key, transaction.start)

    def _is_torn(self, transaction: Transaction, asked: AskedRequest | None) -> bool:
        """Whether a late read, or a pause of the sender, made of it what it seems: LN206 tells whose are torn."""
        verdict, torn = transaction.verdict, self.torn
        if verdict in (Verdict.UNSOLICITED, Verdict.LATE, Verdict.ANSWERED_TWICE):
            return torn.may_answer(transaction.response)
        is_either = asked is not None and asked.header.role is Role.EITHER
        if verdict is Verdict.NO_RESPONSE and is_either and torn.may_answer(transaction.request):
            return True  # no request, but the confirmation of the one that was torn
        return verdict in _MAY_BE_TORN and torn.is_torn(transaction.id)

    def _settle_damaged_request(self, transaction: Transaction, heard: Heard) -> None:
        """A request that is damaged, of whatever station."""
        asked = heard.asked
        self.seen.strikes.struck("master")
        octets = asked.frame.octets if asked is not None else b""
        self.seen.late_speakers.damaged_request(octets, transaction.start, transaction.request)
        self.seen.damaged_requests.add(transaction.start, transaction.request)
        self.seen.see_behind(transaction.start, transaction.request)
        if asked is not None:
            self._keep_damaged(asked.frame)
            self.seen.checks_of_requests.see(asked.no, asked.frame.end, ways(asked.frame))
        if heard.flaw is not None:
            tallies = self.seen.requests_damaged_by
            tallies.setdefault(heard.flaw, Tally()).add(transaction.start, transaction.request)

    def _keep_damaged(self, frame: Frame) -> None:
        """A damaged frame that is a request, or may be one."""
        if frame.protocol == RTU_NAME:
            if frame.octets[0] in self.seen.stations:
                self.seen.stations[frame.octets[0]].damaged_requests += 1
            self.seen.text_damage.add(frame.octets, request_length(frame.octets))

    def _see_end(self, heard: Heard, unit: int, no: int, frame: Frame) -> None:
        """How a damaged answer of a station, in that row, ended."""
        station, asked = self.station(unit), heard.asked
        if asked is not None and heard.flaw in (Flaw.FIRST_MISSING, Flaw.FIRST_SPOILT):
            station.first_lost.add(max(0, frame.start - asked.frame.end), asked.no, no)
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
            if ended is not None:
                self._keep_damaged(ended[2])
            self.seen.late_speakers.damaged_request(octets, transaction.start, transaction.response)
            if self.seen.late_speakers.shows(octets, transaction.start):
                return
            self.seen.strikes.struck("master")
            self.seen.damaged_requests.add(transaction.start, transaction.response)
            self.seen.see_behind(transaction.start, transaction.response)
            return
        self.seen.unasked.add(transaction.start, transaction.response)
        if transaction.station in self.seen.stations:
            self.seen.stations[transaction.station].unasked += 1
        self.seen.unasked_behind_noise += transaction.response == self.rubbish + 1

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
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, heard: Heard
    ) -> None:
        """Something came in place of an answer: in what way it is wrong."""
        stray = heard.stray
        if stray and asked.frame.protocol == RTU_NAME:
            station.text_damage.add(stray, sent_length(asked.frame.octets, stray))
            self.seen.carried_over.hear(
                asked.frame.octets, stray, transaction.end, transaction.request, transaction.response
            )
        if heard.flaw is not None:
            station.flaw(heard.flaw).add(transaction.end, transaction.request, transaction.response)
            return
        if not stray:
            return
        if len(stray) == STRAY_KEPT or self.seen.late_speakers.is_due_from_another(asked.unit, transaction.start):
            return  # two may have spoken at once, which says nothing of how this one speaks
        station.garbage.of_text = asked.frame.protocol != RTU_NAME
        begins = stray[:1] == (b":" if station.garbage.of_text else asked.octets[:1])
        frames, marked = (transaction.request, transaction.response), transaction.id in self.marked
        station.garbage.add(
            stray, transaction.end, *frames, is_marked=marked, begins=begins, request=asked.frame.octets
        )
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
