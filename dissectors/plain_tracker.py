"""A ready-made tracker for plain protocols: a master asks a station, the station answers, one exchange at a time.

    request to a station ──► open ──► its answer                     answered; after a repeat: retry
                               │ ───► a damaged frame in its place    damaged answer
                               │ ───► silence, or the next request    no answer
    request to nobody in particular                                   broadcast
    answer that nobody waits for                                      late after no answer, else unasked

`Header.role` tells requests from answers, `destination` whom a request is for (None: everybody), `source` who answers
(None: the frame does not say, and it is taken as of whoever was asked). Frames of other roles stand for themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from dissectors.frame import Event, Frame, Header, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.tracker import NOTHING_TRACKED, Interval, Placement, Tracked, Transaction, Verdict

PATIENCE = NS_PER_S
"""ns that a master waits, where a protocol names no other."""


@dataclass(frozen=True, slots=True)
class OpenRequest:
    """A request that may still be answered, or that was not. `attempt`, `of`: as in `Transaction`."""

    id: int
    no: int
    frame: Frame
    header: Header
    attempt: int = 1
    of: int | None = None


class Polling:
    """The tracker of one bus. `patience`: ns that a master waits for an answer."""

    def __init__(self, timing: Timing, patience: int = PATIENCE) -> None:
        self._patience = patience + timing.latency
        self._tx = 0
        self._open: OpenRequest | None = None
        self._failed: OpenRequest | None = None  # the last request, when it went unanswered

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        if header is None or not isinstance(event, Frame):
            return NOTHING_TRACKED
        before = self.advance(event.start)
        if header.role is Role.REQUEST:
            return self._ask(no, event, header, before)
        in_its_place = header.role is Role.UNKNOWN and not event.ok and self._open is not None  # may well be the answer
        if header.role is Role.RESPONSE or in_its_place:
            return self._answer(no, event, header, before)
        closed = self._alone(no, event, header, Verdict.DATA, None)
        return Tracked(self._place(no, closed.id, header), (*before, closed))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns)."""
        if self._open is None or now - self._open.frame.end <= self._patience:
            return ()
        return self._give_up()

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: an answer could still have come."""
        asked, self._open = self._open, None
        return () if asked is None else (closed_exchange(asked, Verdict.OPEN),)

    def _ask(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        before += self._give_up()
        last, self._failed = self._failed, None
        if header.destination is None:
            closed = self._alone(no, frame, header, Verdict.BROADCAST, None)
            return Tracked(self._place(no, closed.id, header), (*before, closed))
        repeats = last if last is not None and last.frame.octets == frame.octets else None
        self._tx += 1
        attempt, of = (1, None) if repeats is None else (repeats.attempt + 1, repeats.of or repeats.id)
        self._open = OpenRequest(self._tx, no, frame, header, attempt, of)
        return Tracked(self._place(no, self._tx, header), before)

    def _answer(self, no: int, frame: Frame, header: Header, before: tuple[Transaction, ...]) -> Tracked:
        asked = self._open
        if asked is not None and _is_of(header, asked):
            self._open = None
            if not frame.ok:
                verdict = Verdict.DAMAGED_ANSWER
            else:
                verdict = Verdict.ANSWERED if asked.attempt == 1 else Verdict.RETRY
            closed = closed_exchange(asked, verdict, no, frame)
            return Tracked(self._place(no, asked.id, header, asked), (*before, closed))
        late, self._failed = self._failed, None
        if late is not None and self._open is None and _is_of(header, late):
            closed = self._alone(no, frame, header, Verdict.LATE, late.id)
        else:
            closed = self._alone(no, frame, header, Verdict.UNSOLICITED, None)
        return Tracked(self._place(no, closed.id, header), (*before, closed))

    def _give_up(self) -> tuple[Transaction, ...]:
        """The open request is not answered any more. One that was damaged need not be."""
        asked, self._open = self._open, None
        if asked is None:
            return ()
        self._failed = asked
        return (closed_exchange(asked, Verdict.NO_RESPONSE if asked.frame.ok else Verdict.DAMAGED_REQUEST),)

    def _alone(self, no: int, frame: Frame, header: Header, verdict: Verdict, of: int | None) -> Transaction:
        self._tx += 1
        is_answer = header.role is Role.RESPONSE
        station = header.source if is_answer else header.destination
        request, response = (None, no) if is_answer else (no, None)
        return Transaction(self._tx, station, header.kind, request, response, verdict, frame.start, frame.end, of=of)

    @staticmethod
    def _place(no: int, tx: int, header: Header, asked: OpenRequest | None = None) -> Placement:
        source = header.source if header.source is not None or asked is None else asked.header.destination
        return Placement(no, tx, header.role, source, header.destination)


def _is_of(answer: Header, asked: OpenRequest) -> bool:
    return answer.source is None or answer.source == asked.header.destination


class Request(Protocol):
    """A request as a tracker keeps it while it is open. `attempt`, `of`: as in `Transaction`."""

    @property
    def id(self) -> int: ...
    @property
    def no(self) -> int: ...
    @property
    def frame(self) -> Frame: ...
    @property
    def header(self) -> Header: ...
    @property
    def attempt(self) -> int: ...
    @property
    def of(self) -> int | None: ...


def closed_exchange(
    asked: Request, verdict: Verdict, no: int | None = None, answer: Frame | None = None, error: str | None = None
) -> Transaction:
    """The exchange of a request that is over; with its answer, which is row `no`, where one came."""
    latency = None
    end = asked.frame.end
    if answer is not None:
        gap = max(0, answer.start - asked.frame.end)
        latency = Interval(gap, max(0, gap - answer.slack), gap + asked.frame.slack)
        end = answer.end
    return Transaction(
        asked.id,
        asked.header.destination,
        asked.header.kind,
        asked.no,
        no,
        verdict,
        asked.frame.start,
        end,
        latency,
        asked.attempt,
        asked.of,
        error,
    )
