"""What becomes of each request of a Modbus line: whether it counts, is answered, by what, and how soon."""

from __future__ import annotations

from dissectors.frame import Role
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.heard import Heard
from dissectors.modbus.learned_timing import READ
from dissectors.modbus.limits import ILLEGAL
from dissectors.modbus.pairing import is_answer
from dissectors.modbus.remembered import LOST_KEPT, SLOW_UNLEARNT, Unfit, slow_limit
from dissectors.modbus.response_groups import AnsweredRequest
from dissectors.modbus.row_observer import AT_ONCE, RowObserver
from dissectors.modbus.station_record import Lost, Requested, StationRecord
from dissectors.tracker import Interval, Transaction, Verdict


class RequestObserver(RowObserver):
    """Told of each request when it closes."""

    def settle_request(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, heard: Heard
    ) -> None:
        """A request that closed, with its answer, the code of its exception, or neither."""
        if self._says_nothing(transaction, asked):
            return
        is_missing = transaction.verdict is Verdict.NO_RESPONSE
        why = self._why_it_cannot_be(station, transaction, asked, heard.code)
        if why is not None:
            station.impossible.add(why, transaction.start, transaction.request, transaction.response)
            if is_missing:  # a station may pass over it
                station.impossible.unanswered += 1
                return
        request = self._count_try(station, transaction, asked)
        if is_missing:
            self._settle_missing(station, request, transaction, asked)
            return
        station.heard(transaction.end)
        if transaction.verdict is Verdict.DAMAGED_ANSWER:
            self.seen.strikes.struck(f"station {asked.unit}")
            station.damaged.add(transaction.end, transaction.request, transaction.response)
            station.garbled += transaction.response is None
            return
        self._count_answer(station, transaction, asked, heard.answer)
        if transaction.verdict is Verdict.EXCEPTION:
            self._settle_exception(station, transaction, asked, heard.code or 0, is_right=why is not None)
        elif transaction.error is not None and asked.header.ok and self._is_unfit(transaction, asked, heard):
            self._settle_unfit(station, transaction, asked, heard)

    def _says_nothing(self, transaction: Transaction, asked: AskedRequest) -> bool:
        """Whether nothing can be said of its station: it was no request, or is reported as something else."""
        if asked.no in self.no_requests:
            return True
        if transaction.verdict is not Verdict.NO_RESPONSE:
            return False
        if asked.no in self.elsewhere:
            del self.elsewhere[asked.no]  # the pair is reported instead
            self.seen.repeated_elsewhere[asked.unit] += transaction.attempt > 1
            return True
        may_be_answer = asked.is_behind_silence and asked.header.role is not Role.REQUEST
        return may_be_answer or self.silences.may_have_been_answered(asked.no)

    def _why_it_cannot_be(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, code: int | None
    ) -> str | None:
        """What is wrong with a request, where nobody can carry it out; None where it may be right."""
        if asked.fault is not None:
            return asked.fault
        is_carried_out = (asked.key, asked.octets) in station.same
        is_passed_over = transaction.verdict is Verdict.NO_RESPONSE and not is_carried_out
        return asked.beyond if code in ILLEGAL or is_passed_over else None

    def _count_try(self, station: StationRecord, transaction: Transaction, asked: AskedRequest) -> Requested:
        """One more request to a station."""
        request = station.request(asked.key)
        request.tries += 1
        if transaction.attempt == 1:
            request.turns += 1
            self.seen.cycles.add(asked.octets, asked.key, transaction.start)
        else:
            self._settle_repeat(station, transaction, asked)
        station.last_start = transaction.start
        station.asked += 1
        return request

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

    # ---- no answer

    def _settle_missing(
        self, station: StationRecord, request: Requested, transaction: Transaction, asked: AskedRequest
    ) -> None:
        """A request that nobody answered; perhaps the answer comes late, or was not heard here."""
        for tally in (request.missing, station.missing, station.silent):
            tally.add(transaction.start, transaction.request)
        is_unheard, is_waited_for = asked.no in self.unheard, asked.no in self.waited_for
        if is_unheard:
            station.unheard.add(transaction.start, transaction.request)
        elif asked.no not in self.hasty:  # who did not wait for it cannot have been spoken into
            self.seen.late_speakers.unanswered(
                asked.unit, asked.due, transaction.start, transaction.end, self.learnt.timeout
            )
        station.waited_for += is_waited_for
        lost = Lost(asked.unit, asked.key, asked.no, asked.frame.end, is_unheard, is_waited_for)
        self.lost[transaction.id] = lost
        if len(self.lost) > LOST_KEPT:
            del self.lost[next(iter(self.lost))]

    # ---- an answer

    def _count_answer(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, answer: bytes
    ) -> None:
        """A good answer, or exception: that it came, and when."""
        is_torn = self.torn.is_torn(transaction.id)
        if not asked.header.ok and not self.came_late(transaction) and not is_torn:
            self.seen.damaged_here.add(transaction.start, transaction.request)
        self.seen.strikes.whole()
        self.seen.late_speakers.answered(asked.unit, f"station {asked.unit}", transaction.start)
        if transaction.response is not None:
            self.seen.newest_answer = transaction.response, asked.unit
        station.answered += 1
        station.copies += answer == asked.octets
        if transaction.latency is not None and not is_torn:
            self._count_time(station, transaction, asked, answer, transaction.latency)

    def _count_time(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, answer: bytes, took: Interval
    ) -> None:
        """How long an answer took."""
        station.times.add(took)
        if asked.header.ok and transaction.attempt == 1:
            self.learnt.answered(transaction.station or 0, READ, took.nominal)
        self._compare_with_timeout(station, transaction, took.low)
        if transaction.verdict is Verdict.ANSWERED and transaction.error is None and transaction.response is not None:
            came = AnsweredRequest(transaction.response, transaction.end, took, answer)
            station.compare(asked.key, asked.octets, came)

    def _compare_with_timeout(self, station: StationRecord, transaction: Transaction, least: int) -> None:
        """Whether an answer took long; counted anew when the timeout gets known, since the limit is another then."""
        limit = slow_limit(self.learnt.timeout)
        station.compare_with(limit, 1)
        if least > (SLOW_UNLEARNT if limit is None else limit):
            self.gaps.took_long(station.slow, transaction)

    def _settle_exception(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, code: int, is_right: bool
    ) -> None:
        """A station that refused, rightly where the request cannot be carried out."""
        if is_right:
            station.impossible.codes[code] += 1
        else:
            station.exception(asked.key, code).add(transaction.end, transaction.request, transaction.response)

    # ---- an answer to something else

    def _is_unfit(self, transaction: Transaction, asked: AskedRequest, heard: Heard) -> bool:
        """Whether the answer itself is not what was asked for: damage before a good answer is none of its faults."""
        if heard.code is not None or transaction.id in self.contradictory:  # an exception to something else
            return True
        return bool(heard.answer) and not is_answer(asked.octets, heard.answer)

    def _settle_unfit(
        self, station: StationRecord, transaction: Transaction, asked: AskedRequest, heard: Heard
    ) -> None:
        """An answer that is not what was asked for. Where octets that are no good frame came before it, its own request
        may be in them."""
        ways_round = self.seen.cycles.beside(asked.in_list, heard.answer) if heard.stray else ()
        if ways_round:
            if self._is_within_a_turn(transaction, asked):
                self.seen.cross(ways_round, transaction.end, transaction.request, transaction.response)
            return
        if heard.code is None and (asked.fault or asked.beyond) is not None:
            rows = transaction.request, transaction.response
            station.impossible.in_kind.add(transaction.end, *rows)
            if asked.fault is None and asked.beyond is not None:  # others are counted already
                station.impossible.add(asked.beyond, transaction.start, *rows)
            return
        unfit = Unfit(station, transaction, heard.answer)
        if self.timing.latency < AT_ONCE or asked.header.role is Role.REQUEST:
            unfit.count()
        else:
            self.unfit = unfit
            self.settle_unfit(next(reversed(self.said), 0))

    def _is_within_a_turn(self, transaction: Transaction, asked: AskedRequest) -> bool:
        """Whether an answer came too soon for another request to have been asked and answered since."""
        if transaction.latency is None:
            return False
        took = transaction.latency.nominal
        turn = self.learnt.turn(asked.unit, asked.answer_time(self.timing.char), took)
        return turn is not None and took <= turn[1]
