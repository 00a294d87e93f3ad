"""Exchanges of data on an MS/TP bus: requests, their segments and attempts, answers that come later or twice.

Here is what a frame of data is to the exchanges that are open or over; what holds the bus, and whether a frame answers
it at once, is the tracker's (tracker.py).
"""

from __future__ import annotations

from dissectors.bacnet.apdu import Apdu, PduType
from dissectors.bacnet.exchange import Exchange, Key, mirrored, read, trails
from dissectors.bacnet.frame_types import EXPECTING
from dissectors.bacnet.limits import BROADCAST, MS
from dissectors.bacnet.open_exchanges import OpenExchanges
from dissectors.frame import Assembly, Frame, Header, Role
from dissectors.line import Timing
from dissectors.tracker import Placement, Transaction, Verdict

TWICE_WITHIN = 2_000 * MS
LATE_WITHIN = 60_000 * MS

_ENDED = frozenset(Verdict) - {Verdict.NO_RESPONSE, Verdict.DAMAGED_ANSWER}
"""How an exchange ended whose segments had come: what trails after it changes nothing."""


class DataExchanges(OpenExchanges):
    """What data do to exchanges."""

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing)
        self._assembly: Assembly | None = None  # what the newest frame ended

    def _data(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        """Data that answer nothing that holds the bus."""
        if header.destination == BROADCAST:
            return self._single(no, frame, header, Verdict.BROADCAST, closed)
        expecting = frame.octets[2] in EXPECTING
        message, key = read(frame)
        apdu = message.apdu if message is not None else None
        if key is not None and apdu is not None and (apdu.is_answer or apdu.type != PduType.CONFIRMED_REQUEST):
            return self._answer_later(key, no, frame, header, apdu, closed)
        if not expecting and key is None:
            return self._single(no, frame, header, Verdict.DATA, closed)
        further = apdu is not None and apdu.segmented and bool(apdu.sequence)
        if key is not None and further:
            begun = self._postponed.pop(key, None)
            if begun is not None:
                begun.more_follows = apdu is not None and apdu.more_follows
                return self._next_segment(begun, no, frame, header, expecting, closed)
            over = self._past.get(key)
            if over is not None and over[0].segmented and over[1] in _ENDED and frame.start - over[2] < LATE_WITHIN:
                return self._at(no, over[0].id, header, Role.REQUEST)
        exchange = self._open(no, frame, header, key)
        exchange.segmented = apdu is not None and apdu.segmented
        exchange.more_follows = apdu is not None and apdu.more_follows
        exchange.unconfirmed = apdu is not None and apdu.type == PduType.UNCONFIRMED_REQUEST
        if key is not None:
            self._count_attempt(exchange, key, closed, further)
        if expecting:
            self._waiting = exchange
        else:
            self._keep(exchange, closed)
        return self._at(no, exchange.id, header, Role.REQUEST)

    def _next_segment(
        self, begun: Exchange, no: int, frame: Frame, header: Header, expecting: bool, closed: list[Transaction]
    ) -> Placement:
        """One more segment of a request: the time to the answer counts from the last one, which holds the whole."""
        begun.no = no
        begun.end = begun.last = frame.end
        begun.slack = frame.slack
        if expecting:
            self._waiting = begun
        else:
            self._keep(begun, closed)
        return self._at(no, begun.id, header, Role.REQUEST)

    def _count_attempt(self, exchange: Exchange, key: Key, closed: list[Transaction], further: bool) -> None:
        """A request seen before without an answer is tried again; `further`: from a later segment on."""
        older = self._postponed.pop(key, None)
        if older is not None:  # its answer may have been under way
            older.postponed = False
            closed.append(self._stop(older))
        past = self._past.get(key)
        if past is None:
            return
        before, verdict, ended = past
        same = before.octets[8:] == exchange.octets[8:] or (further and before.segmented)
        if same and verdict in (Verdict.NO_RESPONSE, Verdict.DAMAGED_ANSWER) and exchange.start - ended < LATE_WITHIN:
            exchange.attempt, exchange.of = before.attempt + 1, before.id

    def _answer_later(
        self, key: Key, no: int, frame: Frame, header: Header, apdu: Apdu, closed: list[Transaction]
    ) -> Placement:
        """An answer, or an acknowledgement or Abort of either side, that answers nothing that holds the bus."""
        if apdu.type in (PduType.SEGMENT_ACK, PduType.ABORT) and key not in self._postponed and key not in self._past:
            key = mirrored(key)
        open_one = self._postponed.get(key)
        if open_one is not None:
            return self._answered(open_one, no, frame, header, apdu, closed)
        past = self._past.get(key)
        age = None if past is None else frame.start - past[2]
        if past is not None and age is not None:
            before, verdict, _ = past
            if before.segmented and verdict in _ENDED and trails(apdu) and age < LATE_WITHIN:
                return self._at(no, before.id, header, _side(apdu))
            if not apdu.is_answer or apdu.type == PduType.SEGMENT_ACK:
                return self._single(no, frame, header, Verdict.DATA, closed)
            if before.response is None and age < LATE_WITHIN:  # a second answer needs a first
                return self._afterwards(before, Verdict.LATE, no, frame, header, apdu, closed)
            if before.response is not None and age < TWICE_WITHIN:
                return self._afterwards(before, Verdict.ANSWERED_TWICE, no, frame, header, apdu, closed)
        if not apdu.is_answer or apdu.type == PduType.SEGMENT_ACK:  # asks for nothing and answers nothing
            return self._single(no, frame, header, Verdict.DATA, closed)
        if apdu.segmented and (apdu.more_follows or apdu.sequence):  # what came before its later segments was not seen
            verdict = Verdict.OPEN if apdu.sequence else Verdict.UNSOLICITED
            return self._segments(None, key, verdict, no, frame, header, apdu, closed)
        return self._single(no, frame, header, Verdict.UNSOLICITED, closed, station=header.source)

    def _segments(
        self,
        before: Exchange | None,
        key: Key,
        verdict: Verdict,
        no: int,
        frame: Frame,
        header: Header,
        apdu: Apdu,
        closed: list[Transaction],
    ) -> Placement:
        """The first seen segment of an answer to what is closed, or to nothing: all of them are one transaction."""
        exchange = self._open(no, frame, header, key)
        exchange.source, exchange.destination = exchange.destination, exchange.source
        exchange.becomes, exchange.response = verdict, no
        if before is not None:
            exchange.kind, exchange.of, exchange.latency = before.kind, before.id, before.interval(frame)
        return self._answered(exchange, no, frame, header, apdu, closed)

    def _answered(
        self, exchange: Exchange, no: int, frame: Frame, header: Header, apdu: Apdu | None, closed: list[Transaction]
    ) -> Placement:
        exchange.last = frame.end
        if self._waiting is exchange:
            self._waiting = None
        if exchange.goes_on(no, frame, apdu, self._assembly is not None and not self._assembly.complete):
            self._keep(exchange, closed)
            return self._at(no, exchange.id, header, _side(apdu))
        if exchange.key is not None:
            self._postponed.pop(exchange.key, None)
        verdict, error = Verdict.ANSWERED, None
        if apdu is not None and apdu.type == PduType.ABORT and not apdu.is_answer:  # the one that asked gives up
            verdict, error = Verdict.OPEN, f"{header.error} by the one that asked"
        elif apdu is not None and apdu.type in (PduType.ERROR, PduType.REJECT, PduType.ABORT):
            verdict, error = Verdict.EXCEPTION, header.error
        elif exchange.attempt > 1:
            verdict = Verdict.RETRY
        verdict = exchange.becomes or verdict
        self._remember(exchange, verdict)
        closed.append(exchange.close(verdict, end=frame.end, error=error))
        return self._at(no, exchange.id, header, _side(apdu))

    def _afterwards(
        self,
        before: Exchange,
        verdict: Verdict,
        no: int,
        frame: Frame,
        header: Header,
        apdu: Apdu,
        closed: list[Transaction],
    ) -> Placement:
        """A late or second answer: a transaction of its own that names the one it belongs to."""
        if apdu.more_follows and before.key is not None:
            return self._segments(before, before.key, verdict, no, frame, header, apdu, closed)
        exchange = self._open(no, frame, header)
        closed.append(
            Transaction(
                exchange.id,
                before.destination,
                before.kind,
                None,
                no,
                verdict,
                frame.start,
                frame.end,
                latency=before.interval(frame),
                of=before.id,
                error=header.error,
            )
        )
        if before.key is not None and verdict is Verdict.LATE:
            before.response = no
            self._remember(before, Verdict.LATE)
        return self._at(no, exchange.id, header, Role.RESPONSE)

    def _single(
        self,
        no: int,
        frame: Frame,
        header: Header,
        verdict: Verdict,
        closed: list[Transaction],
        station: int | None = None,
    ) -> Placement:
        """A frame that is a transaction by itself."""
        exchange = self._open(no, frame, header)
        answer = verdict is Verdict.UNSOLICITED
        closed.append(
            Transaction(
                exchange.id,
                header.destination if station is None else station,
                header.kind,
                None if answer else no,
                no if answer else None,
                verdict,
                frame.start,
                frame.end,
                error=header.error,
            )
        )
        return self._at(no, exchange.id, header)

    def _at(self, no: int, tx: int, header: Header, role: Role | None = None) -> Placement:
        return Placement(no, tx, header.role if role is None else role, header.source, header.destination)


def _side(apdu: Apdu | None) -> Role:
    """The role of a frame in an exchange that was there before it."""
    return Role.RESPONSE if apdu is None or apdu.is_answer else Role.REQUEST
