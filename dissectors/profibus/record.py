"""Record of one station, gathered for the rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from dissectors.busiest import summed
from dissectors.findings import EVIDENCE_MAX, Tally
from dissectors.frame import Flaw, Frame
from dissectors.last_silence import LastSilence
from dissectors.profibus.check_mistakes import ways
from dissectors.profibus.services import Service
from dissectors.profibus.telegram import parse
from dissectors.tracker import Transaction, Verdict
from dissectors.wrong_checks import WrongChecks

_EXCHANGE = Service.DATA_EXCHANGE.value
_WELL = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION))
_LISTENED = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION, Verdict.DAMAGED_ANSWER, Verdict.LATE))

_REPEATS_LEAST, _REPEATS = 10, 0.9
"""So many requests, and of all of them, that are answered only when they are sent again."""


@dataclass(slots=True)
class RequestsRecord:
    """Requests to a station and what became of them.

    `repeats`: of all kinds; `worst`: in a row, at most. `repeated`: those of requests that were answered well here.
    `before`: how the newest ended. `rubbish`: those in place of whose answer only octets came that are no telegram.
    `fresh`: requests without any telegram for an answer that are no repeats at once; `again`: repeats of requests
    without answer that were answered well. `exchanged`, `put_off`: requests for data exchange, and refused ones of
    them. `unheard`: requests without answer after which the master went on as after one: it changed the frame count
    bit, which it does for no other reason.
    """

    requests: int = 0
    answers: int = 0
    unanswered: Tally = field(default_factory=Tally)
    repeated: Tally = field(default_factory=Tally)
    damaged: Tally = field(default_factory=Tally)
    rubbish: Tally = field(default_factory=Tally)
    refused: Tally = field(default_factory=Tally)
    twice: Tally = field(default_factory=Tally)
    slow: Tally = field(default_factory=Tally)
    slowest: int = 0
    refusals: set[str] = field(default_factory=set)
    repeats: int = 0
    worst: int = 0
    before: Verdict | None = None
    fresh: int = 0
    again: int = 0
    exchanged: int = 0
    put_off: int = 0
    unheard: int = 0
    silence: LastSilence = field(default_factory=LastSilence)
    checks: WrongChecks = field(default_factory=WrongChecks)  # of the damaged answers
    flaws: dict[Flaw, Tally] = field(default_factory=dict)  # likewise: of those that one change makes good
    _newest: tuple[int, bytes] | None = None  # the newest request: its row and octets
    _previous: tuple[int, bytes] | None = None
    _silent: tuple[int, bytes] | None = None  # the newest request, where it is known that no answer was heard

    def ask(self, no: int, octets: bytes) -> None:
        """A request is sent."""
        self._previous, self._newest = self._newest, (no, octets)
        if self._silent is not None:
            self._go_on(self._silent[1], octets)
            self._silent = None

    @property
    def is_clear(self) -> bool:
        """Whether the next request tells nothing of the one before it."""
        return self._silent is None

    @property
    def silent(self) -> int:
        """Requests without answer that the master may not have had an answer to, either."""
        return self.unanswered.count - self.unheard

    @property
    def answers_repeats(self) -> bool:
        """Whether nearly every request is answered only when it is sent again, which chance does not do."""
        return self.again >= max(_REPEATS_LEAST, _REPEATS * (self.requests - self.repeats))

    def see_damaged(self, no: int, answer: Frame) -> None:
        """Take a damaged answer, in that row."""
        self.checks.see(no, answer.end, ways(answer))
        if answer.repair is not None:
            self.flaws.setdefault(answer.repair.flaw, Tally()).add(answer.end, no)

    def settle(self, closed: Transaction, slow: int) -> None:
        """Take an exchange with it. `slow`: ns that an answer may take."""
        verdict = closed.verdict
        if verdict is Verdict.ANSWERED_TWICE:
            self.twice.add(closed.start, closed.request, closed.response)
            return
        if closed.request is None or verdict is Verdict.ECHO:
            return
        self.requests += 1
        self.exchanged += closed.kind == _EXCHANGE
        self.answers += verdict in _LISTENED and closed.response is not None  # rubbish alone shows nobody
        if closed.attempt > 1:
            self.repeats += 1
            self.worst = max(self.worst, closed.attempt - 1)
            self.again += self.before is Verdict.NO_RESPONSE and verdict is Verdict.RETRY
            if self.before in _WELL:
                self.repeated.add(closed.start, closed.request)
        self.before = verdict
        if verdict is not Verdict.NO_RESPONSE:
            self.silence.heard()
        if verdict is Verdict.NO_RESPONSE:
            self.unanswered.add(closed.start, closed.request)
            self.silence.miss(closed.start, closed.request, is_repeat=closed.attempt > 1)
            self.fresh += closed.attempt == 1
            self._miss(closed.request)
        elif verdict is Verdict.DAMAGED_ANSWER:
            self.damaged.add(closed.start, closed.request, closed.response)
            if closed.response is None:
                self.rubbish.add(closed.start, closed.request)
                self.fresh += closed.attempt == 1
        elif verdict is Verdict.EXCEPTION:
            self.refused.add(closed.start, closed.request, closed.response)
            self.put_off += closed.kind == _EXCHANGE
            self.refusals.add(f"{closed.kind}: {closed.error}")
        if closed.latency is not None and closed.latency.low > slow and verdict is not Verdict.DAMAGED_ANSWER:
            self.is_slow(closed.latency.low, closed.start, closed.request, closed.response)

    def _miss(self, no: int) -> None:
        """No answer to the request in this row was heard; the next one may have been sent before that is known."""
        previous, newest = self._previous, self._newest
        if newest is not None and newest[0] == no:
            self._silent = newest
        elif newest is not None and previous is not None and previous[0] == no:
            self._go_on(previous[1], newest[1])

    def _go_on(self, before: bytes, after: bytes) -> None:
        """The master asked again or something else, behind a request whose answer was not heard."""
        if _counts_on(before, after):
            self.unheard += 1
            self.silence.heard()

    def is_slow(self, least: int, time: int, *rows: int | None) -> None:
        """Take an answer that came too late, after `least` ns."""
        self.slow.add(time, *rows)
        self.slowest = max(self.slowest, least)


def _counts_on(before: bytes, after: bytes) -> bool:
    """Whether the frame count bit of two requests says that the first one was answered."""
    one, other = parse(before).control, parse(after).control
    if one is None or other is None or not (one.fcv and other.fcv):
        return False
    return one.fcb is not other.fcb


def joined(tallies: Sequence[Tally]) -> Tally:
    """Several tallies as one; there must be one."""
    evidence = sorted(no for tally in tallies for no in tally.evidence)[:EVIDENCE_MAX]
    first, last = min(tally.first for tally in tallies), max(tally.last for tally in tallies)
    quarters = summed(tally.quarters for tally in tallies)
    return Tally(sum(tally.count for tally in tallies), first, last, evidence, quarters)
