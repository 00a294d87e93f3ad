"""Pairing N2 commands and answers. An answer carries no address, so only order and time tell whose it is.

1. One master, one open command. An answer belongs to the open one, unless its form cannot answer that one and does
   answer the one before it, which had none: then it is late.
2. A command closes the one before it: no response, or a damaged answer where octets came that are no frame.
3. The same octets again, at once, are an echo; within GIVE_UP of the unanswered try, with no other command between,
   a retry.
4. A second answer without a command between: late where that station still owes one within GIVE_UP (a retry makes
   two commands, and both may be answered), else answered twice (two stations with one address).
5. How long a master waits is its own setting (NAE 250 ms to 3 s), so silence alone closes a command after GIVE_UP.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

from dissectors.frame import Event, Frame, Header, Noise, Reason, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.n2.commands import parse_command
from dissectors.n2.forms import fits
from dissectors.n2.header import BROADCAST
from dissectors.tracker import Interval, Placement, Tracked, Transaction, Verdict

GIVE_UP = 3 * NS_PER_S
"""Longest time that a master waits for an answer, ns (upper end of the NAE's setting; digimat.n2's default)."""

_LONGEST = 256  # characters of an answer that may have begun in time and not be read yet
_OWING = 16  # commands remembered that a late answer may still answer
_SPOILT = 2  # octets of noise in answer to a command that count as a damaged answer


@dataclass(slots=True)
class _Exchange:
    """A command and what became of it."""

    id: int
    no: int
    octets: bytes
    station: int | None
    kind: str
    start: int
    end: int
    slack: int
    attempt: int
    of: int | None
    damaged: bool
    spoilt: int = 0  # octets of noise since the command
    answer: bytes = b""
    answer_end: int = 0

    @property
    def first_try(self) -> int:
        return self.id if self.of is None else self.of


class N2Tracker:
    """Gives each frame of a bus its transaction, and each transaction its verdict."""

    def __init__(self, timing: Timing) -> None:
        self._latency = timing.latency
        self._char = timing.char
        self._at_once = max(timing.t35, timing.char + timing.latency)
        self._next = 1
        self._open: _Exchange | None = None
        self._missed: _Exchange | None = None  # the last command, closed without a good answer
        self._owing: deque[_Exchange] = deque(maxlen=_OWING)  # commands without any answer, oldest first
        self._done: _Exchange | None = None  # the last command, when it was closed by an answer

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event; `header` is None exactly for noise."""
        if header is None or isinstance(event, Noise):
            self._hear_noise(event)
            return Tracked()
        closed: list[Transaction] = []
        if self._open is not None and event.start - self._open.end > GIVE_UP:
            closed.append(self._close_unanswered(self._open))
        if event.octets[:1] == b">":
            placement = self._command(no, event, header, closed)
        else:
            placement = self._answer(no, event, header, closed)
        return Tracked(placement, tuple(closed))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns); give the transactions that this closes."""
        if self._open is None or now - self._open.end <= GIVE_UP + self._latency + _LONGEST * self._char:
            return ()
        return (self._close_unanswered(self._open),)

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: what is open stays so."""
        if self._open is None:
            return ()
        left, self._open = self._open, None
        return (_transaction(left, Verdict.OPEN),)

    # --- commands ---

    def _command(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        open_ = self._open
        if open_ is not None and frame.octets == open_.octets and frame.start - open_.end <= self._at_once:
            return self._echo(no, frame, header, header.role, open_, closed)
        if open_ is not None:
            closed.append(self._close_unanswered(open_))
        missed = self._missed
        attempt, of = 1, None
        if missed is not None and missed.octets == frame.octets and frame.start - missed.end <= GIVE_UP:
            attempt, of = missed.attempt + 1, missed.first_try
        self._open = _Exchange(
            id=self._take_id(),
            no=no,
            octets=frame.octets,
            station=header.destination,
            kind=header.kind,
            start=frame.start,
            end=frame.end,
            slack=frame.slack,
            attempt=attempt,
            of=of,
            damaged=not header.ok,
        )
        self._done = None
        return Placement(no, self._open.id, header.role, None, header.destination)

    def _close_unanswered(self, exchange: _Exchange) -> Transaction:
        self._open, self._missed, self._done = None, exchange, None
        if exchange.spoilt >= _SPOILT:
            return _transaction(exchange, Verdict.DAMAGED_ANSWER, error="octets that are no frame")
        if exchange.damaged:
            return _transaction(exchange, Verdict.DAMAGED_REQUEST)
        if exchange.station == BROADCAST:
            return _transaction(exchange, Verdict.BROADCAST)
        self._owing.append(exchange)
        return _transaction(exchange, Verdict.NO_RESPONSE)

    def _owing_answer(self, station: int | None, now: int) -> _Exchange | None:
        """Take the oldest command to a station that had no answer within GIVE_UP."""
        for exchange in self._owing:
            if exchange.station == station and now - exchange.end <= GIVE_UP:
                self._owing.remove(exchange)
                return exchange
        return None

    def _hear_noise(self, event: Event) -> None:
        if self._open is not None and not (isinstance(event, Noise) and event.reason is Reason.PAD):
            self._open.spoilt += len(event.octets)

    # --- answers ---

    def _answer(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        open_, missed = self._open, self._missed
        if open_ is None:
            return self._orphan(no, frame, header, closed)
        if missed is not None and frame.start - missed.end <= 2 * GIVE_UP and _answers_rather(missed, open_, frame):
            self._missed = None
            self._owing = deque((e for e in self._owing if e is not missed), _OWING)
            return self._separate(no, frame, header, Verdict.LATE, missed, closed)
        self._open, self._missed, self._done = None, None, open_
        open_.answer, open_.answer_end = frame.octets, frame.end
        verdict = Verdict.ANSWERED if open_.attempt == 1 else Verdict.RETRY
        if open_.damaged:
            verdict = Verdict.DAMAGED_REQUEST
        if header.kind == "negative-acknowledge":
            verdict = Verdict.EXCEPTION
        if not header.ok:
            verdict = Verdict.DAMAGED_ANSWER
            self._missed = open_
        done = _transaction(open_, verdict, error=header.error)
        latency = self._interval(frame.start - open_.end, open_.slack)
        closed.append(replace(done, response=no, end=frame.end, latency=latency))
        return Placement(no, open_.id, Role.RESPONSE, open_.station, None)

    def _orphan(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        """An answer that no open command asked for."""
        done, missed = self._done, self._missed
        if done is not None:
            if (owing := self._owing_answer(done.station, frame.start)) is not None:
                return self._separate(no, frame, header, Verdict.LATE, owing, closed)
            if frame.octets == done.answer and frame.start - done.answer_end <= self._at_once:
                return self._echo(no, frame, header, Role.RESPONSE, done, closed)
            if frame.start - done.end <= GIVE_UP:
                return self._separate(no, frame, header, Verdict.ANSWERED_TWICE, done, closed)
        elif missed is not None and frame.start - missed.end <= 2 * GIVE_UP:
            self._missed = None
            self._owing = deque((e for e in self._owing if e is not missed), _OWING)
            return self._separate(no, frame, header, Verdict.LATE, missed, closed)
        return self._separate(no, frame, header, Verdict.UNSOLICITED, None, closed)

    def _separate(
        self, no: int, frame: Frame, header: Header, verdict: Verdict, to: _Exchange | None, closed: list[Transaction]
    ) -> Placement:
        """A transaction of its own for an answer that came too late, twice or unasked."""
        station = to.station if to else None
        transaction = Transaction(
            id=self._take_id(),
            station=station,
            kind=to.kind if to else header.kind,
            request=None,
            response=no,
            verdict=verdict,
            start=frame.start,
            end=frame.end,
            latency=self._interval(frame.start - to.end, to.slack) if to and verdict is Verdict.LATE else None,
            of=to.first_try if to else None,
            error=header.error,
        )
        closed.append(transaction)
        return Placement(no, transaction.id, Role.RESPONSE, station, None)

    def _echo(
        self, no: int, frame: Frame, header: Header, role: Role, of: _Exchange, closed: list[Transaction]
    ) -> Placement:
        request, response = (None, no) if role is Role.RESPONSE else (no, None)
        source, destination = (of.station, None) if role is Role.RESPONSE else (None, of.station)
        echo = Transaction(
            id=self._take_id(),
            station=of.station,
            kind=of.kind,
            request=request,
            response=response,
            verdict=Verdict.ECHO,
            start=frame.start,
            end=frame.end,
            of=of.id,
        )
        closed.append(echo)
        return Placement(no, echo.id, role, source, destination)

    def _interval(self, nominal: int, slack: int) -> Interval:
        return Interval(nominal, max(0, nominal - self._latency), max(0, nominal + slack))

    def _take_id(self) -> int:
        self._next += 1
        return self._next - 1


def _transaction(exchange: _Exchange, verdict: Verdict, error: str | None = None) -> Transaction:
    return Transaction(
        id=exchange.id,
        station=exchange.station,
        kind=exchange.kind,
        request=exchange.no,
        response=None,
        verdict=verdict,
        start=exchange.start,
        end=exchange.end,
        attempt=exchange.attempt,
        of=exchange.of,
        error=error,
    )


def _answers_rather(missed: _Exchange, open_: _Exchange, frame: Frame) -> bool:
    """Whether a good answer has the wrong form for the open command and the right one for the one before."""
    if frame.damage is not None or missed.damaged:
        return False
    return (
        fits(parse_command(open_.octets), frame.octets) is False
        and fits(parse_command(missed.octets), frame.octets) is True
    )
