"""Telegrams become transactions.

    request ──► open ──► answer of that station to that master, or SC          answered; after a repeat: retry
                  │ ───► answer that refuses (UE, RR, RS)                      exception
                  │ ───► damaged telegram or rubbish in its place              damaged answer
                  │ ───► next request, token, silence                          no answer; a poll: one-way
    SDN, to one or to all                                                      data, broadcast
    token                                                                      one-way
    a request, the same octets at once        echo: no master repeats within the silence that it owes
    answer without a request                  late after no answer; answered twice, echo after an answer; else unasked

A request with the frame count bit in use and the same as in the one before it, to the same station, is that one again:
the master has not understood the answer. Where octets were damaged since, nothing is said of that: the request between
may have been lost here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from dissectors.frame import Event, Frame, Header, Noise, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.plain_tracker import closed_exchange
from dissectors.profibus.control import Control
from dissectors.profibus.header import meant
from dissectors.profibus.telegram import SYN, parse
from dissectors.profibus.turn import Due, Turn
from dissectors.tracker import NOTHING_TRACKED, Placement, Tracked, Transaction, Verdict

PATIENCE = NS_PER_S
"""ns after which no answer comes any more; a master's slot time is far shorter, and its next telegram says so."""

_ASKS = (Role.REQUEST, Role.POLL)


@dataclass(slots=True)
class _Asked:
    """A request. `attempt`, `of`: as in `Transaction`. `disturbed`: rubbish came where its answer should be."""

    id: int
    no: int
    frame: Frame
    header: Header
    control: Control | None
    attempt: int = 1
    of: int | None = None
    disturbed: bool = False
    answer: bytes = b""
    is_answered: bool = False


class Past(NamedTuple):
    """An answered request that rows in bulk ended with: its row, frame and header, and the octets of its answer."""

    no: int
    frame: Frame
    header: Header
    answer: bytes


class ProfibusTracker:
    """The tracker of one bus."""

    def __init__(self, timing: Timing) -> None:
        self._patience = PATIENCE + timing.latency
        self._syn = timing.line.bits(SYN) if timing.has_times else 0  # without times nothing is sure to come at once
        self._tx = 0
        self._open: _Asked | None = None
        self._past: _Asked | None = None  # the last request, once it is closed
        self._turn = Turn(timing)
        self._is_clear = True  # nothing was damaged since the last good request

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        before = self.advance(event.start)
        if header is None or not isinstance(event, Frame):
            self._is_clear = False
            self._turn.see_noise(event.end)
            if self._open is not None and isinstance(event, Noise):
                self._open.disturbed = True
            return Tracked(None, before) if before else NOTHING_TRACKED
        if not event.ok and event.repair is None:
            return self._damaged(no, event, header, before)
        self._turn.see(parse(meant(event)), event.start, event.end, event.ok)
        return self._by_role(no, event, header, before)

    def _by_role(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        if header.role is Role.RESPONSE:
            return self._answer(no, frame, header, before)
        if header.role in _ASKS:
            return self._ask(no, frame, header, before)
        return self._send(no, frame, header, before)

    def _damaged(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        """A telegram with an octet wrong, any one: the turn says whose it is."""
        asked, due = self._open, None
        if asked is not None:
            is_sure = asked.frame.ok or asked.frame.repair is not None
            station = asked.header.destination if is_sure else None
            due = Due(station, asked.header.source, asked.header.role is Role.POLL)
        speaker = self._turn.speaker(parse(frame.octets), len(frame.octets), frame.start, frame.end, due)
        header = replace(header, source=speaker.source, destination=speaker.destination)
        if speaker.answers:
            return self._answer(no, frame, header, before)
        if asked is not None and header.role is Role.RESPONSE:
            return self._send(no, frame, header, before)
        return self._by_role(no, frame, header, before)

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns)."""
        if self._open is None or now - self._open.frame.end <= self._patience:
            return ()
        return self._give_up()

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: an answer could still have come."""
        asked, self._open = self._open, None
        return () if asked is None else (closed_exchange(asked, Verdict.OPEN),)

    # For rows in bulk

    @property
    def is_at_rest(self) -> bool:
        """Whether no request is open."""
        return self._open is None

    @property
    def next_id(self) -> int:
        """The id of the next transaction."""
        return self._tx + 1

    def may_repeat(self, octets: bytes) -> bool:
        """Whether a request of those octets would be the last one again."""
        return self._past is not None and self._past.frame.octets == octets

    @property
    def turn(self) -> Turn:
        """Whose turn it is."""
        return self._turn

    def pass_by(self, count: int, past: Past | None, asked: bool) -> None:
        """Stand behind `count` transactions that were closed elsewhere; `asked`: some were requests to be answered."""
        if past is None:
            self._past = None
        else:
            control = parse(past.frame.octets).control
            self._past = _Asked(self._tx + count, past.no, past.frame, past.header, control)
            self._past.is_answered, self._past.answer = True, past.answer
        self._tx += count
        self._is_clear = self._is_clear or asked

    def _ask(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        if self._open is not None and self._is_echo(frame, self._open.frame):
            return self._echo(no, frame, header, self._open, before)
        before += self._give_up()
        control = parse(meant(frame)).control
        asked = _Asked(self._next(), no, frame, header, control)
        earlier = self._past
        if earlier is not None and frame.ok and earlier.frame.ok and self._repeats(asked, earlier):
            asked.attempt, asked.of = earlier.attempt + 1, earlier.of or earlier.id
        self._is_clear = frame.ok
        self._open = asked
        return Tracked(_placed(no, asked.id, header), before)

    def _is_echo(self, frame: Frame, asked: Frame) -> bool:
        return frame.octets == asked.octets and frame.ok and frame.start - asked.end + asked.slack < self._syn

    def _echo(self, no: int, frame: Frame, header: Header, of: _Asked, before: tuple[Transaction, ...]) -> Tracked:
        """What the line gives back; the request stays open."""
        tx, to = self._next(), header.destination
        echo = Transaction(tx, to, header.kind, no, None, Verdict.ECHO, frame.start, frame.end, of=of.id)
        return Tracked(_placed(no, tx, header), (*before, echo))

    def _repeats(self, asked: _Asked, earlier: _Asked) -> bool:
        """Whether a request is the one directly before once more: a master repeats at once, or not at all."""
        if asked.frame.octets != earlier.frame.octets or asked.header.role is Role.POLL:
            return False
        if not earlier.is_answered:
            return True
        counts = asked.control is not None and asked.control.fcv
        return counts and self._is_clear

    def _answer(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        asked = self._open
        if not frame.ok:
            self._is_clear = False
        if asked is None or (frame.ok and not _is_of(header, asked)):
            return self._unasked(no, frame, header, before)
        self._open, self._past = None, asked
        asked.is_answered, asked.answer = frame.ok, frame.octets
        if not asked.frame.ok and header.source is not None:  # what it asked whom was not heard: who answers knows
            asked.header = replace(asked.header, destination=header.source)
        if not frame.ok:
            verdict = Verdict.DAMAGED_ANSWER
        elif header.error is not None:
            verdict = Verdict.EXCEPTION
        else:
            verdict = Verdict.ANSWERED if asked.attempt == 1 else Verdict.RETRY
        role = Role.RESPONSE
        closed = closed_exchange(asked, verdict, no, frame, header.error)
        source = asked.header.destination if frame.ok else header.source
        destination = asked.header.source
        return Tracked(Placement(no, asked.id, role, source, destination), (*before, closed))

    def _unasked(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        """An answer that nobody waits for: late, a second one, or of a request that was not heard here."""
        past, verdict, of = self._past, Verdict.UNSOLICITED, None
        if not frame.ok:
            verdict = Verdict.DATA
        elif past is not None and self._open is None and _is_of(header, past):
            of = past.id if self._is_clear or not past.is_answered else None
            if not past.is_answered:
                verdict = Verdict.LATE
            elif of is not None:  # else it may answer a request that was lost among damaged octets
                verdict = Verdict.ECHO if frame.octets == past.answer else Verdict.ANSWERED_TWICE
        elif past is not None and not past.is_answered and header.source is not None and _is_of(header, past):
            verdict, of = Verdict.LATE, past.id
        tx = self._next()
        station = header.source if of is None or past is None else past.header.destination
        closed = Transaction(tx, station, header.kind, None, no, verdict, frame.start, frame.end, of=of)
        return Tracked(Placement(no, tx, header.role, station, header.destination), (*before, closed))

    def _send(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        """What nobody answers: tokens, SDN, broadcasts; and what is too damaged to tell."""
        before += self._give_up()
        self._past = None if frame.ok else self._past
        self._is_clear &= frame.ok
        verdict = Verdict.BROADCAST if header.role is Role.BROADCAST else Verdict.DATA
        if not frame.ok and header.role in _ASKS:
            verdict = Verdict.DAMAGED_REQUEST
        tx = self._next()
        station = header.destination if header.role is not Role.BROADCAST else None
        closed = Transaction(tx, station, header.kind, no, None, verdict, frame.start, frame.end)
        return Tracked(_placed(no, tx, header), (*before, closed))

    def _give_up(self) -> tuple[Transaction, ...]:
        """The open request is not answered any more. One that was damaged need not be."""
        asked, self._open = self._open, None
        if asked is None:
            return ()
        self._past = asked
        if not asked.frame.ok:
            verdict = Verdict.DAMAGED_REQUEST
        elif asked.header.role is Role.POLL:
            verdict = Verdict.DATA  # nobody need be there
        else:
            verdict = Verdict.DAMAGED_ANSWER if asked.disturbed else Verdict.NO_RESPONSE
        return (closed_exchange(asked, verdict),)

    def _next(self) -> int:
        self._tx += 1
        return self._tx


def _is_of(answer: Header, asked: _Asked) -> bool:
    """Whether an answer fits a request: a short acknowledgement names nobody; others name both."""
    if answer.source is None:
        return True
    if not asked.frame.ok and asked.frame.repair is None:
        return answer.destination == asked.header.source
    return answer.source == asked.header.destination and answer.destination == asked.header.source


def _placed(no: int, tx: int, header: Header) -> Placement:
    return Placement(no, tx, header.role, header.source, header.destination)
