"""What is wrong on a Modbus line: what is remembered of each row and transaction. `judgement.py` puts it into words.

Implements `dissectors.findings.Judge` for RTU and ASCII. An adapter's delay is always taken off in favour of the
station: it is slow when even the shortest reading is too long, too quick when even the longest is too short.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from dissectors.findings import ExceptionWords, Finding, Tally
from dissectors.frame import Damage, Event, Frame, Header, LineError, Noise, Role
from dissectors.line import Timing
from dissectors.modbus.adu import RTU_NAME, adu, rtu_check
from dissectors.modbus.evidence import Evidence
from dissectors.modbus.functions import BROADCAST
from dissectors.modbus.judgement import judge
from dissectors.modbus.learnt import Learnt
from dissectors.modbus.response_groups import Answered
from dissectors.modbus.station_record import Key, Station, middle
from dissectors.tracker import Placement, Transaction, Verdict

MS = 1_000_000
TURNAROUND = 90 * MS
"""Nobody speaks so soon after a broadcast: the master waits 100 … 200 ms (Modbus over Serial Line V1.02, 2.4.1)."""

SLOW_UNLEARNT = 500 * MS
_OPEN_KEPT = 4096
_HASTY_KEPT = 256
_LAST_STANDARD_UNIT = 247
_SPACING_KEPT = 64
_SPACING_LEAST = 8
_SETTLED_ELSEWHERE = (Verdict.ECHO, Verdict.DATA, Verdict.OPEN, Verdict.BROADCAST)


@dataclass(frozen=True, slots=True)
class _Asked:
    """The request of an open transaction."""

    no: int
    frame: Frame
    header: Header
    octets: bytes

    @property
    def unit(self) -> int:
        return self.octets[0] if self.octets else 0

    @property
    def key(self) -> Key:
        return self.header.kind, self.header.address


class ModbusFindings:
    """Fed row by row and transaction by transaction; gives findings at any time."""

    def __init__(self, timing: Timing) -> None:
        self._timing = timing
        self._learnt = Learnt(timing)
        self._seen = Evidence(timing)
        self._asked: dict[int, _Asked] = {}  # by transaction
        self._open: _Asked | None = None  # the newest request, while nothing has come after it
        self._broadcast: _Asked | None = None  # likewise
        self._before: Frame | None = None  # the row before, if it was a good frame
        self._codes: dict[int, int] = {}  # exception codes by transaction
        self._answers: dict[int, bytes] = {}  # good answers by transaction
        self._elsewhere: dict[int, int] = {}  # requests (by frame) that another unit answered, and which
        self._repeats: deque[int] = deque(maxlen=64)  # the last transactions that repeated another
        self._no_requests: deque[int] = deque(maxlen=64)  # frames that the tracker takes for requests, but are none
        self._spacing: dict[str, deque[int]] = {}  # silence an octet of the last frames of each sender, ns
        self._damaged: deque[int] = deque(maxlen=64)  # transactions of the last damaged answers

    # ---- the contract

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """See `dissectors.findings.Judge`."""
        seen = self._seen
        seen.first = event.start if seen.first is None else seen.first
        seen.now = max(seen.now, event.end)
        if isinstance(event, Noise) or header is None or placement is None:
            self._see_noise(no, event)
            self._before = self._open = None
            return
        octets = adu(event)
        self._see_gaps(no, event, header, placement)
        if placement.role is Role.RESPONSE:
            self._see_answer(no, event, header, placement, octets)
        else:
            self._see_request(_Asked(no, event, header, octets), placement)
        if header.ok and octets and octets[0] > _LAST_STANDARD_UNIT:
            self._station(octets[0]).reserved.add(event.start, no)
        self._before = event if header.ok else None

    def settle(self, transaction: Transaction) -> None:
        """See `dissectors.findings.Judge`."""
        asked = self._asked.pop(transaction.id, None)
        code = self._codes.pop(transaction.id, 0)
        answer = self._answers.pop(transaction.id, b"")
        verdict = transaction.verdict
        if verdict in _SETTLED_ELSEWHERE:
            self._seen.echoes += verdict is Verdict.ECHO
            if verdict is Verdict.BROADCAST and asked is not None:
                self._seen.cycles.add(asked.octets, asked.key, transaction.start)
            return
        if verdict is Verdict.DAMAGED_REQUEST:
            self._seen.damaged_requests.add(transaction.start, transaction.request)
            return
        if verdict is Verdict.UNSOLICITED:
            self._settle_unasked(transaction)
            return
        if transaction.station is None:
            return
        station = self._station(transaction.station)
        if transaction.attempt > 1:
            self._repeats.append(transaction.id)
        if verdict is Verdict.ANSWERED_TWICE and transaction.of not in self._repeats:
            station.twice.add(transaction.start, transaction.response)
        elif verdict in (Verdict.LATE, Verdict.ANSWERED_TWICE):  # each try has its answer, the first one came late
            station.late.add(transaction.start, transaction.response)
            station.heard(transaction.end)
        elif asked is not None:
            self._settle_request(station, transaction, asked, code, answer)

    def word_exceptions(self, words: ExceptionWords) -> None:
        """See `dissectors.findings.WordsExceptions`."""
        self._seen.maker_words = words

    def findings(self) -> tuple[Finding, ...]:
        """See `dissectors.findings.Judge`."""
        return judge(self._seen, self._learnt.timeout)

    # ---- rows

    def _see_request(self, asked: _Asked, placement: Placement) -> None:
        if len(self._asked) < _OPEN_KEPT:
            self._asked[placement.tx] = asked
        if self._is_no_request(asked):
            self._no_requests.append(asked.no)
            self._open = self._broadcast = None
            return
        self._seen.requests += 1
        if self._open is not None:
            self._waited_in_vain(self._open, asked)
        is_broadcast = placement.role is Role.BROADCAST or asked.unit == BROADCAST
        self._open = None if is_broadcast or not asked.header.ok else asked
        self._broadcast = asked if is_broadcast and asked.header.ok else None

    def _is_no_request(self, asked: _Asked) -> bool:
        """Whether it is an answer in the shape of a request: to a broadcast, or by another unit than the one asked."""
        if self._broadcast is not None and self._is_answer_to_broadcast(asked):
            self._seen.answers_to_broadcast.add(asked.frame.start, self._broadcast.no, asked.no)
            return True
        if self._open is not None and self._is_answer_of_another(self._open, asked):
            self._seen.pair((self._open.unit, asked.unit)).add(asked.frame.start, self._open.no, asked.no)
            self._elsewhere[self._open.no] = asked.unit
            return True
        return False

    def _waited_in_vain(self, before: _Asked, asked: _Asked) -> None:
        """A request after another that nothing has followed."""
        self._station(before.unit).waited += max(0, asked.frame.start - before.frame.start)
        if not asked.header.ok:
            return
        gap = max(0, asked.frame.start - before.frame.end)
        if asked.octets == before.octets:
            if gap > self._timing.t35 + self._timing.latency:  # no echo
                self._learnt.unanswered(gap)
            return
        if before.header.role is not Role.REQUEST:  # a write has the shape of its answer, which may have come late
            return
        self._learnt.unanswered(gap)
        if len(self._seen.hasty) < _HASTY_KEPT:
            self._seen.hasty.append((gap + before.frame.slack, before.unit, asked.frame.start, before.no, asked.no))

    def _see_answer(self, no: int, frame: Frame, header: Header, placement: Placement, octets: bytes) -> None:
        self._seen.answers += 1
        if self._broadcast is not None and frame.start - self._broadcast.frame.end < TURNAROUND:
            self._seen.answers_to_broadcast.add(frame.start, self._broadcast.no, no)
        self._broadcast = self._open = None
        if header.ok:
            if header.error is not None and len(octets) > 2 and octets[1] & 0x80:
                self._codes[placement.tx] = octets[2]
                if len(self._codes) > _OPEN_KEPT:
                    self._codes.clear()
            else:
                self._answers[placement.tx] = octets
                if len(self._answers) > _OPEN_KEPT:
                    self._answers.clear()
        elif placement.source is not None:
            self._damaged.append(placement.tx)
            station = self._station(placement.source)
            station.cut += frame.damage is Damage.SHORT
            if _ends_badly(frame):
                station.last_octet.add(frame.end, no)
            elif frame.damage is Damage.LONG or any(mark.error is LineError.FRAMING for mark in frame.marks[:-1]):
                station.talked_over.add(frame.end, no)

    def _see_noise(self, no: int, event: Event) -> None:
        if self._broadcast is not None and event.start - self._broadcast.frame.end < TURNAROUND:
            if len(event.octets) >= 3:
                self._seen.noise_after_broadcast.add(event.start, self._broadcast.no, no)
            return
        self._broadcast = None

    def _see_gaps(self, no: int, frame: Frame, header: Header, placement: Placement) -> None:
        """Silences that are provably too short between frames, or too long inside one."""
        timing, before = self._timing, self._before
        if frame.protocol != RTU_NAME:
            return
        sender = "master" if placement.role is not Role.RESPONSE else f"station {placement.source}"
        if before is not None and header.ok and not frame.skipped and before.octets != frame.octets:
            longest = max(0, frame.start - before.end) + before.slack
            if longest < timing.t35 - timing.line.bits(1):
                self._seen.gap_tally(self._seen.close, sender).add(frame.start, no - 1, no)
        self._see_pause(no, frame, sender)

    def _see_pause(self, no: int, frame: Frame, sender: str) -> None:
        """A silence inside a frame, beyond the spacing that this sender always leaves between its octets."""
        gaps = len(frame.octets) - 1
        if gaps < 1:
            return
        silence = frame.end - frame.slack - frame.start - len(frame.octets) * self._timing.char
        usual = self._spacing.setdefault(sender, deque(maxlen=_SPACING_KEPT))
        limit = self._timing.t15
        if silence > limit and len(usual) >= _SPACING_LEAST and silence - gaps * max(0, middle(usual)) > limit:
            self._seen.gap_tally(self._seen.paused, sender).add(frame.start, no)
        usual.append(silence // gaps)

    def _is_answer_to_broadcast(self, asked: _Asked) -> bool:
        """Whether what looks like a request is a station's copy of the broadcast before it, as itself or as 0."""
        broadcast = self._broadcast
        if broadcast is None or asked.octets[1:] != broadcast.octets[1:] or (self._seen.echoes and not asked.unit):
            return False
        gap = asked.frame.start - broadcast.frame.end
        return self._timing.char + self._timing.latency < gap < TURNAROUND

    def _is_answer_of_another(self, before: _Asked, asked: _Asked) -> bool:
        """Whether what looks like a request is the copy of the one before it, by a unit that is known to answer so."""
        return asked.octets[1:] == before.octets[1:] and (before.unit, asked.unit) in self._seen.pairs

    # ---- transactions

    def _settle_unasked(self, transaction: Transaction) -> None:
        """An answer that fits no request: of another unit than the one asked, or of nobody's asking."""
        other = self._asked.get(transaction.of) if transaction.of is not None else None
        if other is not None and transaction.station is not None and transaction.station != other.unit:
            self._elsewhere[other.no] = transaction.station
            if len(self._elsewhere) > _OPEN_KEPT:
                self._elsewhere.clear()
            pair = (other.unit, transaction.station)
            self._seen.pair(pair).add(transaction.start, other.no, transaction.response)
            return
        if not self._seen.requests and self._seen.answers == 1:
            return  # the capture began between a request and its answer
        if transaction.id in self._damaged:  # more likely a request, when nobody was asked
            self._seen.damaged_requests.add(transaction.start, transaction.response)
            return
        self._seen.unasked.add(transaction.start, transaction.response)

    def _settle_request(
        self, station: Station, transaction: Transaction, asked: _Asked, code: int, answer: bytes
    ) -> None:
        verdict = transaction.verdict
        if asked.no in self._no_requests:
            return
        if verdict is Verdict.NO_RESPONSE and asked.no in self._elsewhere:
            del self._elsewhere[asked.no]  # the pair is reported instead
            self._seen.repeated_elsewhere[asked.unit] += transaction.attempt > 1
            return
        request = station.request(asked.key)
        request.tries += 1
        if transaction.attempt == 1:
            request.turns += 1
            self._seen.cycles.add(asked.octets, asked.key, transaction.start)
        else:
            station.repeats.add(transaction.start, transaction.request)
            station.repeats_cost += max(0, transaction.start - station.last_start)
        station.last_start = transaction.start
        station.asked += 1
        if verdict is Verdict.NO_RESPONSE:
            request.missing.add(transaction.start, transaction.request)
            station.missing.add(transaction.start, transaction.request)
            station.silent.add(transaction.start, transaction.request)
            return
        station.heard(transaction.end)
        if verdict is Verdict.DAMAGED_ANSWER:
            station.damaged.add(transaction.end, transaction.request, transaction.response)
            station.garbled += transaction.response is None
            return
        station.answered += 1
        if transaction.latency is not None:
            station.times.add(transaction.latency)
            if asked.header.ok and transaction.attempt == 1:
                self._learnt.answered(transaction.station or 0, False, transaction.latency.nominal)
            self._compare_with_timeout(station, transaction, transaction.latency.low)
            if verdict is Verdict.ANSWERED and transaction.error is None and transaction.response is not None:
                came = Answered(transaction.response, transaction.end, transaction.latency, answer)
                station.compare(asked.key, asked.octets, came)
        if verdict is Verdict.EXCEPTION:
            station.exception(asked.key, code).add(transaction.end, transaction.request, transaction.response)
        elif (
            transaction.error is not None and asked.header.ok and not transaction.error.startswith("before the answer")
        ):
            station.unfit.add(transaction.end, transaction.request, transaction.response)
            if len(station.unfit_words) < 16:
                station.unfit_words[transaction.error] += 1

    def _compare_with_timeout(self, station: Station, transaction: Transaction, least: int) -> None:
        """Whether an answer took long; counted anew when the timeout gets known, since the limit is another then."""
        timeout = self._learnt.timeout
        limit = None if timeout is None else timeout * 7 // 10
        if (limit is None) != (station.slow_limit is None):
            station.slow, station.slow_of = Tally(), 0
        station.slow_limit = limit
        station.slow_of += 1
        if least > (SLOW_UNLEARNT if limit is None else limit):
            station.slow.add(transaction.end, transaction.request, transaction.response)

    def _station(self, unit: int) -> Station:
        return self._seen.stations.setdefault(unit, Station())


def _ends_badly(frame: Frame) -> bool:
    """Whether a damaged frame is right up to its last octet, or ends just before it."""
    if frame.damage is Damage.SHORT:
        return frame.expected is not None and frame.expected - len(frame.octets) == 1
    if frame.damage is not Damage.CHECK:
        return False
    if frame.marks:
        return all(mark.offset == len(frame.octets) - 1 for mark in frame.marks)
    check = rtu_check(frame) if frame.protocol == RTU_NAME else None
    return check is not None and check[0] >> 8 == check[1] >> 8
