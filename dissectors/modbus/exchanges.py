"""The exchanges of a bus: the open one, those that wait with it or came before it, and how each closes."""

from __future__ import annotations

from collections import deque

from dissectors.line import NS_PER_S
from dissectors.modbus.doubts import Doubts, of_chain, of_next, of_run
from dissectors.modbus.echoes import Echoes
from dissectors.modbus.exchange import Exchange, Seen, answer_apart
from dissectors.modbus.functions import FUNCTIONS
from dissectors.modbus.learned_timing import LearnedTiming
from dissectors.modbus.pairing import mismatch
from dissectors.tracker import Transaction, Verdict

GIVE_UP = 5 * NS_PER_S
"""An unanswered request is closed after 5 s of nothing while the master's timeout is unlearnt."""

_ENDLESS_KEPT = 64
_LATE = 3  # times what the master waited, within which an answer may still come
_WAITED_LEAST = 50_000_000  # ns; no master gives up sooner, it only seems so where an answer was missed

FIRST_SEEN = "the first frame of the capture: perhaps an answer whose request came before"
"""The remark on a first request that has the shape of an answer."""


class Exchanges:
    """Bounded: one open exchange, a short chain of equal requests before it, and the last few that closed.

    `last`: the exchange that closed last. `answered`, `given_up`: the newest of each. `chain`: equal requests before
    the open one, whose verdicts wait for it. `closed`: by the event under way. `only`: what all frames so far say;
    empty when they differ. `heard`: of each unit, the transaction that it answered last. `makers`: units with functions
    without a layout that they have answered. `copies_come_late`: whether copies of requests given up came into the wait
    for others; `crossed`: the newest request that one was taken to have come after. `twice`: the newest frame
    that seemed to be a second answer; `endless`: what is said again and again with hardly a pause.
    """

    def __init__(self, learnt: LearnedTiming, echoes: Echoes) -> None:
        self._learnt = learnt
        self._echoes = echoes
        self._doubts = Doubts(learnt)
        self._next_tx = 1
        self.closed: list[Transaction] = []
        self.open: Exchange | None = None
        self.last: Exchange | None = None
        self.answered: deque[Exchange] = deque(maxlen=4)
        self.given_up: deque[Exchange] = deque(maxlen=8)
        self.chain: list[Exchange] = []
        self.heard: dict[int, int] = {}
        self.only: bytes | None = None
        self.makers: set[tuple[int, int]] = set()
        self.copies_come_late = False
        self.crossed: Exchange | None = None
        self.twice = 0
        self.endless: set[bytes] = set()

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing waits, and what closed last was answered."""
        waits = self.open is not None or self.chain or self._doubts
        return not waits and (self.last is None or self.last.answered)

    @property
    def next_tx(self) -> int:
        """The number that the next transaction will have."""
        return self._next_tx

    def pass_by(self, newest: list[Exchange], given_up: list[Exchange], heard: dict[int, int], count: int) -> None:
        """So many transactions went by; `newest`: the last exchanges that were answered, and the last of all; `heard`:
        of each unit that answered, as here."""
        self.heard |= heard
        self.answered.extend([exchange for exchange in newest if exchange.answered])
        self.given_up.extend(given_up)
        self.last, self.only = newest[-1], b""
        self._next_tx += count

    def expire(self, now: int) -> None:
        """Close the open request when nothing has come until `now`, well beyond the master's timeout."""
        limit = GIVE_UP if self._learnt.timeout is None else self._learnt.timeout * 3 // 2
        request = self.open
        if request is None or now < request.last_end + limit:
            return
        if request.copies:
            self.finish_copies(request, None)
        else:
            self.close_open()

    def close_open(self, verdict: Verdict | None = None) -> None:
        """Close the open request, that no good answer came to."""
        request = self.open
        if request is None:
            return
        self.open, self.last = None, request
        self.forgive_pieces(request)
        if request is self.crossed:  # nobody answered it: what came into the wait for it may have been the next request
            self.copies_come_late = False
        if verdict is None:
            if request.fault:
                verdict = Verdict.DAMAGED_REQUEST
            elif request.silent:
                verdict = Verdict.DATA
            elif request.garble:
                verdict = Verdict.DAMAGED_ANSWER
            elif request.after_broadcast:
                error = f"unit {request.unit} answered a broadcast"
                self.closed.append(answer_apart(request.tx, request.request, Verdict.UNSOLICITED, None, error))
                return
            elif request.may_be_answer or (not request.sure and self._may_be_copy(request)):
                verdict = Verdict.UNDECIDED
            elif request.remark is FIRST_SEEN and request.tx == 1:
                verdict = Verdict.OPEN
            else:
                verdict = of_chain([*self.chain, request], self._learnt) if self.chain else Verdict.NO_RESPONSE
        self.drop_chain(Verdict.UNDECIDED if verdict is Verdict.UNDECIDED else Verdict.NO_RESPONSE)
        if verdict in (Verdict.NO_RESPONSE, Verdict.OPEN):  # a first frame that waited may be answered late, too
            self.given_up.append(request)
        self.closed.append(request.close(verdict))

    def forgive_pieces(self, request: Exchange) -> None:
        """What seemed a damaged answer is the request itself, given back in pieces and cut short."""
        if request.garble is not None and self._echoes.is_cut_in_pieces(request):
            request.garble, request.echoed = None, True

    def _may_be_copy(self, request: Exchange) -> bool:
        """Whether what looks like a request and got nothing may be an answer: where requests have no echo, one that had
        one; where all have, a repeat without."""
        usual = self._echoes.is_usual_of(request.unit)
        return not usual if request.echoed else usual and request.attempt > 1

    def drop_chain(self, verdict: Verdict) -> None:
        """Close the requests that waited for the open one, in the order they came."""
        for request in self.chain:
            if verdict is Verdict.NO_RESPONSE:
                self.given_up.append(request)
            self.closed.append(request.close(verdict))
        self.chain.clear()

    def finish_copies(self, request: Exchange, following: Seen | None) -> None:
        """Close a request with frames that are its answer or its repeats, or leave it to what will be learnt."""
        self.open, self.last = None, request
        verdict = None
        if following is not None:
            resembles = following.octets[:2] == request.octets[:2] and len(following.octets) == len(request.octets)
            verdict = of_next(request, following.frame.start, resembles, self._learnt)
        elif len(request.copies) > 1:
            verdict = of_run(request)
        if verdict is Verdict.ANSWERED and self.only == request.octets:
            verdict = Verdict.UNDECIDED  # where nothing else is said, an answer may have been the first frame
        if verdict is None:
            self._doubts.add(request)
        else:
            self._close_doubt(request, verdict)

    def note_answer(self, request: Exchange) -> None:
        """The request was answered."""
        request.answered = True
        self.heard[request.unit] = request.tx
        if request.octets[1:2] and request.octets[1] not in FUNCTIONS:
            self.makers.add((request.unit, request.octets[1]))
        for before in self.given_up:
            before.outlives |= before.unit == request.unit and request.since <= before.tx < request.tx

    def goes_on(self, seen: Seen) -> bool:
        """Whether a copy that comes too soon for this master is its next request all the same: nobody answers three
        times, so who says the same for the fourth time sends it for ever."""
        if seen.no == self.twice + 1 and len(self.endless) < _ENDLESS_KEPT:
            self.endless.add(seen.octets)
        return seen.octets in self.endless

    def close_as_late(self, copy: Exchange, before: Exchange) -> None:
        """The open request was none, but the late answer to one before."""
        self.open = None
        self.given_up.remove(before)
        self.closed.append(answer_apart(copy.tx, copy.request, Verdict.LATE, before, None))

    def _close_doubt(self, request: Exchange, verdict: Verdict) -> None:
        if verdict is Verdict.ANSWERED:
            answer = request.copies[0]
            self.note_answer(request)
            self._learnt.answered(request.unit, request.pace, request.gap(answer.frame.start))
            self.closed.append(request.close_with(answer, None))
            return
        if verdict is Verdict.NO_RESPONSE:
            self.given_up.append(request)
        self.closed.append(request.close(verdict))

    def decide_doubts(self, now: int | None) -> None:
        """Close what the bus has shown enough for; with None all that was left open."""
        for request, verdict in self._doubts.decide(now):
            self._close_doubt(request, verdict)

    def take_closed(self) -> tuple[Transaction, ...]:
        """The transactions that closed since, in order."""
        closed, self.closed = tuple(self.closed), []
        return closed

    def take_tx(self) -> int:
        """The number of the next transaction."""
        tx = self._next_tx
        self._next_tx += 1
        return tx

    def late_for(self, seen: Seen) -> Exchange | None:
        """The newest request given up lately that this answer fits.

        A station answers in the order in which it was asked: once it has answered a later request, it owes this answer
        no more. Which of several it answered that came one directly behind the other, nobody knows.
        """
        timeout = self._learnt.timeout
        for request in reversed(self.given_up):
            waited = GIVE_UP if request.waited is None else max(request.waited, _WAITED_LEAST)
            if request.gap(seen.frame.start) > _LATE * (timeout or waited):
                if timeout is not None:
                    return None
                continue
            if self._owes(request) and request.is_for(seen.octets) and mismatch(request.octets, seen.octets) is None:
                return request
        return None

    def _owes(self, request: Exchange) -> bool:
        return request.outlives or request.tx > self.heard.get(request.unit, 0)

    def repeats(self, request: Exchange, seen: Seen) -> Exchange | None:
        """The request answered lately that an answer fits which comes sooner than the station has ever answered."""
        fastest = self._learnt.fastest(request.unit)
        if fastest is None or request.latency(seen.frame).high >= fastest:
            return None
        fitting = (before for before in reversed(self.answered) if before.is_for(seen.octets) and not before.fault)
        return next((before for before in fitting if mismatch(before.octets, seen.octets) is None), None)
