"""Pairing on an MS/TP bus (ANSI/ASHRAE 135, 9.5.6): one frame holds the bus at a time, answers come at once or later.

The rules:

1. A Data Expecting Reply, a Test Request and a Poll For Master hold the bus: the next frame answers or it is given up.
   A Poll For Master that nobody answers is no fault (the address is free): verdict DATA.
2. An answer belongs to its request by the addresses, those behind routers too, and the invoke id. After Reply Postponed
   the exchange stays open; its answer comes when the other node has the token.
3. An answer after that is LATE, or ANSWERED_TWICE; an answer to nothing is UNSOLICITED. A request sent again with the
   same invoke id is a further attempt.
4. A token is an exchange of its own: DATA when the new holder then sends, with the time it took; NO_RESPONSE when the
   token is sent again or the bus falls silent.
5. Segments and their acknowledgements belong to the exchange of the request, which ends with the last segment.
6. Who sent a frame with a damaged header, the frames before it tell (turn.py). A damaged frame of the one who was asked
   closes what waits for it as DAMAGED_ANSWER; any other is a DAMAGED_REQUEST, unless its header is whole and an answer
   follows: then only the listener got it damaged.
7. A Test Request to the own address asks whether that address is taken (zero configuration); silence is no fault.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace

from dissectors.bacnet.apdu import PduType
from dissectors.bacnet.exchange import Exchange, Key, read
from dissectors.bacnet.frame_types import EXPECTING, FrameType, total
from dissectors.bacnet.header import is_whole_header
from dissectors.bacnet.limits import BROADCAST, MAX_ENCODED, MS, T_NO_TOKEN, T_USAGE_DELAY, TURNAROUND_BITS
from dissectors.bacnet.message import Message
from dissectors.bacnet.turn import Turn
from dissectors.frame import Event, Frame, Header, Noise, Role
from dissectors.line import Timing
from dissectors.tracker import Placement, Tracked, Transaction, Verdict

POSTPONED_FOR = 10_000 * MS
"""How long a postponed answer may come (APDU timeouts are 3 s and more)."""

REMEMBERED = 256
"""Exchanges of the past that late and double answers are known by."""

TWICE_WITHIN = 2_000 * MS
LATE_WITHIN = 60_000 * MS

_REPLY: dict[int, int] = {
    FrameType.POLL_FOR_MASTER: FrameType.REPLY_TO_POLL_FOR_MASTER,
    FrameType.TEST_REQUEST: FrameType.TEST_RESPONSE,
}


class MstpTracker:
    """The tracker of one MS/TP bus; `dissectors.tracker` has the contract."""

    def __init__(self, timing: Timing) -> None:
        self._latency = timing.latency
        self._under_way = 2 * timing.latency + total(MAX_ENCODED) * timing.char
        self._turnaround = timing.line.bits(TURNAROUND_BITS)
        self._next = 1
        self._waiting: Exchange | None = None  # holds the bus: an answer must come now
        self._postponed: OrderedDict[Key, Exchange] = OrderedDict()
        self._past: OrderedDict[Key, tuple[Exchange, Verdict, int]] = OrderedDict()
        self._previous: tuple[Frame, int] | None = None  # the frame before, and its transaction
        self._turn = Turn(timing)
        self._clock: int | None = None

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        if isinstance(event, Noise) or header is None:
            if isinstance(event, Noise):
                self._turn.see_noise(event)
            return Tracked(None, ())
        closed = self._expire(event.start)
        self._clock = event.end if self._clock is None else max(self._clock, event.end)
        placement = self._place(no, event, header, closed)
        self._previous = (event, placement.tx)
        return Tracked(placement, tuple(closed))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now`; a frame may be under way that began its own length earlier."""
        return tuple(self._expire(now - self._under_way))

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: what is open could still have been answered."""
        closed = []
        if self._waiting is not None:
            closed.append(self._waiting.close(Verdict.OPEN))
        closed += [exchange.close(Verdict.OPEN) for exchange in self._postponed.values()]
        self._waiting = None
        self._postponed.clear()
        return tuple(sorted(closed, key=lambda transaction: transaction.id))

    # What time alone ends

    def _expire(self, now: int) -> list[Transaction]:
        closed = []
        waiting = self._waiting
        if waiting is not None and now - waiting.last >= T_NO_TOKEN:
            closed.append(self._give_up(waiting))
        if not self._postponed:
            return closed
        for key in [key for key, exchange in self._postponed.items() if now - exchange.last >= POSTPONED_FOR]:
            closed.append(self._end(self._postponed.pop(key), Verdict.NO_RESPONSE))
        return closed

    def _give_up(self, waiting: Exchange) -> Transaction:
        """Nobody answered what held the bus."""
        self._waiting = None
        if waiting.damaged:
            return self._end(waiting, Verdict.DAMAGED_REQUEST)
        return self._end(waiting, Verdict.DATA if waiting.may_be_silent else Verdict.NO_RESPONSE)

    def _end(self, exchange: Exchange, verdict: Verdict) -> Transaction:
        self._remember(exchange, verdict)
        return exchange.close(verdict)

    def _remember(self, exchange: Exchange, verdict: Verdict) -> None:
        if exchange.key is not None:
            self._past[exchange.key] = (exchange, verdict, exchange.last)
            self._past.move_to_end(exchange.key)
            while len(self._past) > REMEMBERED:
                self._past.popitem(last=False)

    # Where a frame belongs

    def _place(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        if self._is_echo(frame):
            return self._echo(no, frame, header, closed)
        if not frame.ok:
            return self._damaged(no, frame, header, closed)
        frame_type = frame.octets[2]
        self._turn.see(frame, frame_type, frame.octets[4], frame.octets[3])
        waiting = self._waiting
        if waiting is not None:
            answered = self._answer_now(waiting, no, frame, header, closed)
            if answered is not None:
                return answered
        if frame_type in (FrameType.TOKEN, FrameType.POLL_FOR_MASTER):
            self._waiting = exchange = self._open(no, frame, header)
            if waiting is not None and frame_type == FrameType.TOKEN and waiting.octets == exchange.octets:
                exchange.attempt, exchange.of = waiting.attempt + 1, waiting.id
            return self._at(no, exchange.id, header)
        if frame_type == FrameType.TEST_REQUEST:
            self._waiting = exchange = self._open(no, frame, header)
            return self._at(no, exchange.id, header)
        if frame_type in (FrameType.REPLY_TO_POLL_FOR_MASTER, FrameType.TEST_RESPONSE, FrameType.REPLY_POSTPONED):
            return self._single(no, frame, header, Verdict.UNSOLICITED, closed, station=header.source)
        return self._data(no, frame, header, closed)

    def _answer_now(
        self, waiting: Exchange, no: int, frame: Frame, header: Header, closed: list[Transaction]
    ) -> Placement | None:
        """Whether the frame answers what holds the bus; else that is over, and the frame is looked at by itself."""
        frame_type, asked = frame.octets[2], waiting.octets[2]
        back = header.source == waiting.destination and header.destination == waiting.source
        if asked == FrameType.TOKEN:
            self._waiting = None
            if header.source == waiting.destination:
                closed.append(waiting.close(Verdict.DATA, latency=waiting.interval(frame)))
            else:
                closed.append(waiting.close(Verdict.NO_RESPONSE))
            return None
        expected = _REPLY.get(asked)
        if expected is not None:
            if back and frame_type == expected:
                self._waiting = None
                closed.append(
                    waiting.close(Verdict.ANSWERED, response=no, end=frame.end, latency=waiting.interval(frame))
                )
                return self._at(no, waiting.id, header, Role.RESPONSE)
            closed.append(self._give_up(waiting))
            return None
        if back and frame_type == FrameType.REPLY_POSTPONED:
            self._waiting = None
            waiting.postponed, waiting.last = True, frame.end
            if waiting.key is None:
                closed.append(waiting.close(Verdict.OPEN, response=no, latency=waiting.interval(frame)))
            else:
                self._keep(waiting, closed)
            return self._at(no, waiting.id, header, Role.RESPONSE)
        if back and frame_type not in (FrameType.TOKEN, FrameType.POLL_FOR_MASTER):
            message, key = read(frame)
            fits = waiting.damaged or key == waiting.key
            if fits and (message is None or message.apdu is None or message.apdu.type != 0):
                return self._answered(waiting, no, frame, header, message, closed)
            if waiting.key is not None:  # another answer went first: this one can only come later
                self._waiting = None
                self._keep(waiting, closed)
                return None
        closed.append(self._give_up(waiting))
        return None

    def _keep(self, exchange: Exchange, closed: list[Transaction]) -> None:
        assert exchange.key is not None
        older = self._postponed.pop(exchange.key, None)
        if older is not None and older is not exchange:
            closed.append(older.close(Verdict.NO_RESPONSE))
        self._postponed[exchange.key] = exchange
        while len(self._postponed) > REMEMBERED:
            _, oldest = self._postponed.popitem(last=False)
            closed.append(self._end(oldest, Verdict.NO_RESPONSE))

    def _data(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        """Data that answer nothing that holds the bus."""
        if header.destination == BROADCAST:
            return self._single(no, frame, header, Verdict.BROADCAST, closed)
        expecting = frame.octets[2] in EXPECTING
        message, key = read(frame)
        apdu = message.apdu if message is not None else None
        if key is not None and apdu is not None and (apdu.is_answer or apdu.type != PduType.CONFIRMED_REQUEST):
            return self._answer_later(key, no, frame, header, message, closed)
        if not expecting and key is None:
            return self._single(no, frame, header, Verdict.DATA, closed)
        if key is not None and apdu is not None and apdu.segmented and apdu.sequence:
            begun = self._postponed.pop(key, None)
            if begun is not None:
                return self._next_segment(begun, no, frame, header, expecting, closed)
        exchange = self._open(no, frame, header, key)
        if key is not None:
            self._count_attempt(exchange, key, closed)
        if expecting:
            self._waiting = exchange
        else:
            self._keep(exchange, closed)
        return self._at(no, exchange.id, header, Role.REQUEST)

    def _next_segment(
        self, begun: Exchange, no: int, frame: Frame, header: Header, expecting: bool, closed: list[Transaction]
    ) -> Placement:
        """One more segment of a request: the time to the answer counts from the last one."""
        begun.end = begun.last = frame.end
        begun.slack = frame.slack
        if expecting:
            self._waiting = begun
        else:
            self._keep(begun, closed)
        return self._at(no, begun.id, header, Role.REQUEST)

    def _count_attempt(self, exchange: Exchange, key: Key, closed: list[Transaction]) -> None:
        """A request seen before without an answer is tried again."""
        older = self._postponed.pop(key, None)
        if older is not None:
            closed.append(self._end(older, Verdict.NO_RESPONSE))
        past = self._past.get(key)
        if past is None:
            return
        before, verdict, ended = past
        same = before.octets[8:] == exchange.octets[8:]
        if same and verdict in (Verdict.NO_RESPONSE, Verdict.DAMAGED_ANSWER) and exchange.start - ended < LATE_WITHIN:
            exchange.attempt, exchange.of = before.attempt + 1, before.id

    def _answer_later(
        self, key: Key, no: int, frame: Frame, header: Header, message: Message | None, closed: list[Transaction]
    ) -> Placement:
        open_one = self._postponed.get(key)
        if open_one is not None:
            return self._answered(open_one, no, frame, header, message, closed)
        past = self._past.get(key)
        age = None if past is None else frame.start - past[2]
        if past is not None and age is not None:
            before, verdict, _ = past
            if verdict is Verdict.NO_RESPONSE and age < LATE_WITHIN:
                return self._afterwards(before, Verdict.LATE, no, frame, header, closed)
            if verdict is not Verdict.NO_RESPONSE and age < TWICE_WITHIN:
                return self._afterwards(before, Verdict.ANSWERED_TWICE, no, frame, header, closed)
        return self._single(no, frame, header, Verdict.UNSOLICITED, closed, station=header.source)

    def _answered(
        self,
        exchange: Exchange,
        no: int,
        frame: Frame,
        header: Header,
        message: Message | None,
        closed: list[Transaction],
    ) -> Placement:
        apdu = message.apdu if message is not None else None
        exchange.last = frame.end
        acknowledges = apdu is not None and apdu.type == PduType.SEGMENT_ACK
        if exchange.response is None and not acknowledges and (apdu is None or apdu.is_answer):
            exchange.response, exchange.latency = no, exchange.interval(frame)
        role = Role.RESPONSE if apdu is None or apdu.is_answer else Role.REQUEST
        unfinished = apdu is not None and (apdu.more_follows or acknowledges)
        if self._waiting is exchange:
            self._waiting = None
        if unfinished:
            self._keep(exchange, closed)
            return self._at(no, exchange.id, header, role)
        if exchange.key is not None:
            self._postponed.pop(exchange.key, None)
        verdict, error = Verdict.ANSWERED, None
        if apdu is not None and apdu.type in (PduType.ERROR, PduType.REJECT, PduType.ABORT):
            verdict, error = Verdict.EXCEPTION, header.error
        elif exchange.attempt > 1:
            verdict = Verdict.RETRY
        self._remember(exchange, verdict)
        closed.append(exchange.close(verdict, end=frame.end, error=error))
        return self._at(no, exchange.id, header, role)

    def _afterwards(
        self, before: Exchange, verdict: Verdict, no: int, frame: Frame, header: Header, closed: list[Transaction]
    ) -> Placement:
        """A late or second answer: a transaction of its own that names the one it belongs to."""
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
            self._remember(before, Verdict.LATE)
        return self._at(no, exchange.id, header, Role.RESPONSE)

    # Damage, echoes, single frames

    def _damaged(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        header = self._named(frame, header)
        source, waiting = header.source, self._waiting
        if waiting is not None and waiting.is_token:
            self._waiting = None
            used = source == waiting.destination
            latency = waiting.interval(frame) if used else None
            closed.append(waiting.close(Verdict.DATA if used else Verdict.NO_RESPONSE, latency=latency))
        elif waiting is not None:
            if source == waiting.destination and header.destination in (None, waiting.source):
                return self._damaged_answer(waiting, no, frame, header, closed)
            closed.append(self._give_up(waiting))
        if is_whole_header(frame) and header.role is Role.REQUEST:
            self._waiting = exchange = self._open(no, frame, header)
            exchange.damaged = True
            return self._at(no, exchange.id, header)
        return self._single(no, frame, header, Verdict.DAMAGED_REQUEST, closed)

    def _named(self, frame: Frame, header: Header) -> Header:
        """The header of a damaged frame with the source and destination that it most likely had."""
        if is_whole_header(frame):
            if header.source is not None and header.destination is not None and header.function is not None:
                self._turn.see(frame, header.function, header.source, header.destination)
            return header
        speaker = self._turn.speaker(frame)
        if speaker is None:
            return header
        destination = header.destination if speaker.destination is None else speaker.destination
        if speaker.frame_type is not None and destination is not None:
            self._turn.see_likely(frame, speaker.frame_type, speaker.source, destination)
        return replace(header, source=speaker.source, destination=destination)

    def _damaged_answer(
        self, waiting: Exchange, no: int, frame: Frame, header: Header, closed: list[Transaction]
    ) -> Placement:
        self._waiting = None
        self._remember(waiting, Verdict.DAMAGED_ANSWER)
        closed.append(
            waiting.close(
                Verdict.DAMAGED_ANSWER,
                response=no,
                end=frame.end,
                latency=waiting.interval(frame),
                error=header.error,
            )
        )
        return self._at(no, waiting.id, header, Role.RESPONSE)

    def _is_echo(self, frame: Frame) -> bool:
        """An exact copy sooner than any node may send; not to be told where the adapter hides such times."""
        if self._previous is None or self._latency >= T_USAGE_DELAY:
            return False
        before = self._previous[0]
        gap = frame.start - before.end
        return frame.ok and before.octets == frame.octets and gap < self._turnaround and before.end < frame.end

    def _echo(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        of = self._previous[1] if self._previous is not None else None
        exchange = self._open(no, frame, header)
        exchange.of = of
        closed.append(exchange.close(Verdict.ECHO))
        return self._at(no, exchange.id, header)

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

    def _open(self, no: int, frame: Frame, header: Header, key: Key | None = None) -> Exchange:
        source = -1 if header.source is None else header.source
        destination = -1 if header.destination is None else header.destination
        exchange = Exchange(
            self._next,
            no,
            header.kind,
            source,
            destination,
            frame.start,
            frame.end,
            frame.slack,
            frame.octets,
            key,
            last=frame.end,
        )
        self._next += 1
        return exchange

    def _at(self, no: int, tx: int, header: Header, role: Role | None = None) -> Placement:
        return Placement(no, tx, header.role if role is None else role, header.source, header.destination)
