"""An exchange: what the tracker holds of a request until it closes, and the transactions that come of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.findings import counted
from dissectors.frame import Frame, Header, Role
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, FUNCTIONS, ITEMS_ASKED, MAX_UNIT, answer_length
from dissectors.modbus.learned_timing import READ, WRITE
from dissectors.modbus.notation import CHECK, HEAD
from dissectors.quick_values import quickly_made
from dissectors.tracker import Interval, Transaction, Verdict

_OWN_PACE = 0x100
"""Added to a function code: a function that nobody knows takes a time of its own."""


@quickly_made
@dataclass(frozen=True, slots=True)
class Seen:
    """One frame as the tracker sees it: its number, its header, its unit and PDU octets."""

    no: int
    frame: Frame
    header: Header
    octets: bytes

    @property
    def unit(self) -> int | None:
        """First octet; None of an empty frame."""
        return self.octets[0] if self.octets else None


@dataclass(frozen=True, slots=True)
class Garble:
    """A damaged frame, or noise (`no` None), that came in place of an answer. `is_whole`: it has unit, function and
    length of a copy of the request. `octets`: how many of noise."""

    no: int | None
    end: int
    error: str
    is_whole: bool = False
    octets: int = 0

    @property
    def before_the_answer(self) -> str:
        """What it was, where the answer came after all."""
        error = f"{counted(self.octets, 'octet')} that are no frame" if self.octets else self.error
        return f"before the answer: {error}"


@dataclass(slots=True)
class Exchange:
    """A request and what became of it so far.

    `sure`: its shape is that of a request only. `fault`: why the request itself is damaged. `silent`: nobody answers
    it. `remark`: for the verdict when nothing answers. `disturbed`: something else came since, so the wait teaches
    nothing. `copied`: response time of a copy taken for the answer, until the next frame confirms it. `copies`: frames
    that are each its answer or a request again, in the order they came. `after_broadcast`: it says the same as the
    broadcast directly before it. `may_be_answer`: it has the shape of an answer, and a request may have been missed.
    `since`: the first request to this unit that waited with it, one directly behind the other.
    `outlives`: it was given up, and one directly behind it answered: which of the two, nobody knows.
    `pieces`: octets behind it that are no good frame, put together as they came; `pieces_from`: ns, when they began;
    `pieces_until`: when the newest of them did.
    `waited`: ns, until the next request came, where that closed it.
    """

    tx: int
    request: Seen
    sure: bool
    silent: bool = False
    fault: str | None = None
    attempt: int = 1
    of: int | None = None
    remark: str | None = None
    garble: Garble | None = None
    echoed: bool = False
    disturbed: bool = False
    answered: bool = False
    copied: int | None = None
    copies: list[Seen] = field(default_factory=list)
    after_broadcast: bool = False
    may_be_answer: bool = False
    waited: int | None = None
    since: int = 0
    outlives: bool = False
    pieces: bytes = b""
    pieces_from: int = 0
    pieces_until: int = 0
    octets: bytes = field(init=False)  # unit and PDU of the request
    unit: int = field(init=False)  # the unit asked, 0 … 255
    end: int = field(init=False)  # of the request, ns

    def __post_init__(self) -> None:
        self.since = self.since or self.tx
        self.octets = self.request.octets
        self.unit = self.octets[0] if self.octets else 0
        self.end = self.request.frame.end

    @property
    def pace(self) -> int:
        """What of the station's response times its answer is to be compared with; see `learned_timing.py`."""
        code = self.request.header.function
        function = FUNCTIONS.get(code) if code is not None else None
        if function is None:
            return _OWN_PACE + (code or 0)
        return WRITE if function.writes else READ

    @property
    def asks_nobody(self) -> bool:
        """Whether it reads from address 0: no broadcast, since it asks for an answer; any station may give it."""
        return self.unit == BROADCAST and self.request.header.role is Role.REQUEST

    def is_for(self, octets: bytes) -> bool:
        """Whether unit and function (as an exception or not) of an answer are those asked."""
        if len(octets) < 2 or len(self.octets) < 2:
            return False
        from_there = octets[0] == self.unit or self.asks_nobody or self._asks_any
        return from_there and octets[1] & ~EXCEPTION_BIT == self.octets[1]

    @property
    def _asks_any(self) -> bool:
        """Whether it asks, by a maker's function, an address that the standard reserves: so some makers search, and
        whoever it concerns answers, by its own address perhaps."""
        return self.unit > MAX_UNIT and self.octets[1] & ~EXCEPTION_BIT not in FUNCTIONS

    @property
    def last_end(self) -> int:
        """End of the newest frame that may be this request, ns."""
        return self.copies[-1].frame.end if self.copies else self.end

    def put_together(self, octets: bytes, start: int) -> None:
        """Take octets behind it that are no good frame: where reads come late, an echo may come in pieces."""
        if len(self.pieces) < len(self.request.frame.octets):
            self.pieces_from = self.pieces_from if self.pieces else start
            self.pieces_until = start
            self.pieces += octets

    def gap(self, start: int) -> int:
        """From the end of the request to `start`, ns, never negative."""
        return max(0, start - self.end)

    def latency(self, answer: Frame) -> Interval:
        """Response time with what the adapter allows: an answer may have begun, a request ended, earlier."""
        gap = self.gap(answer.start)
        return Interval(gap, max(0, gap - answer.slack), gap + self.request.frame.slack)

    def close(self, verdict: Verdict) -> Transaction:
        """The transaction when no good answer came."""
        garble = self.garble if verdict is Verdict.DAMAGED_ANSWER else None
        response = garble.no if garble else None
        if verdict is Verdict.UNDECIDED and self.copies:
            response = self.copies[-1].no
        return Transaction(
            id=self.tx,
            station=self.unit if self.octets else None,
            kind=self.request.header.kind,
            request=self.request.no,
            response=response,
            verdict=verdict,
            start=self.request.frame.start,
            end=max(self.last_end, garble.end) if garble else self.last_end,
            attempt=self.attempt,
            of=self.of,
            error=self.fault or (self.garble.error if self.garble else self.remark),
        )

    def close_with(self, answer: Seen, why: str | None) -> Transaction:
        """The transaction with its answer; `why` it does not fit, if so."""
        error = answer.header.error or why
        if why and not self.fault and not self.is_for(answer.octets):
            error = why  # what it would mean in answer to something else says nothing here
        if error is None and self.asks_nobody:
            error = f"unit {answer.unit} answered a request to address 0"
        if error is None and self._asks_any and answer.unit != self.unit:
            error = f"unit {answer.unit} answered a request to whoever it concerns"
        if error is None and self.fault:
            error = damaged_request(self.fault)
        if error is None and self.garble:
            error = self.garble.before_the_answer
        attempt = self.attempt + sum(copy is not answer for copy in self.copies)
        if answer.octets[1] & EXCEPTION_BIT and (self.fault or self.is_for(answer.octets)):
            verdict = Verdict.EXCEPTION
        else:
            verdict = Verdict.RETRY if attempt > 1 else Verdict.ANSWERED
        return Transaction(
            id=self.tx,
            station=answer.unit,
            kind=(answer if self.fault else self.request).header.kind,
            request=self.request.no,
            response=answer.no,
            verdict=verdict,
            start=self.request.frame.start,
            end=max(self.end, answer.frame.end),
            latency=None if attempt > self.attempt else self.latency(answer.frame),
            attempt=attempt,
            of=self.of,
            error=error,
        )


def answer_apart(tx: int, seen: Seen, verdict: Verdict, other: Exchange | None, error: str | None) -> Transaction:
    """The transaction of an answer that is late, unsolicited or a second one; `other` is the exchange it is about."""
    return Transaction(
        id=tx,
        station=seen.unit,
        kind=seen.header.kind,
        request=None,
        response=seen.no,
        verdict=verdict,
        start=seen.frame.start,
        end=seen.frame.end,
        latency=other.latency(seen.frame) if other and verdict is not Verdict.ANSWERED_TWICE else None,
        of=other.tx if other else None,
        error=error or seen.header.error,
    )


def damaged_request(fault: str) -> str:
    """In words: the request came damaged, and was answered all the same."""
    return f"request damaged at this tap: {fault}"


def is_begin_of(octets: bytes, whole: bytes) -> bool:
    """Whether octets are a request's first ones, not all, and so many that no answer to it begins so."""
    return _own_octets(whole) <= len(octets) < len(whole) and whole.startswith(octets)


def _own_octets(request: bytes) -> int:
    """From how many octets on a request differs from its answer: from the third, where that is not what an answer would
    count (RTU); else from the fourth."""
    if len(request) < HEAD or request[1] not in ITEMS_ASKED:
        return 4
    length = answer_length(request)
    return 3 if length is not None and request[HEAD] != length - HEAD - 1 - CHECK else 4


def echo_of(tx: int, seen: Seen, original: Exchange, error: str | None = None) -> Transaction:
    """The transaction of an echo; `error`: what is wrong with it."""
    return Transaction(
        id=tx,
        station=original.unit,
        kind=seen.header.kind,
        request=seen.no,
        response=None,
        verdict=Verdict.ECHO,
        start=seen.frame.start,
        end=seen.frame.end,
        of=original.tx,
        error=error,
    )
