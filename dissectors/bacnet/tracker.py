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
5. Segments and their acknowledgements belong to the exchange of the request, which ends with the last segment. What
   comes after that of its segments (the last acknowledgement, repeats, an Abort) still belongs there and changes
   nothing.
6. Who sent a frame with a damaged header, the frames before it tell (turn.py). A damaged frame of the one who was asked
   closes what waits for it as DAMAGED_ANSWER; any other is a DAMAGED_REQUEST, unless its header is whole and an answer
   follows: then only the listener got it damaged.
7. A Test Request to the own address asks whether that address is taken (zero configuration); silence is no fault.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace

from dissectors.bacnet.apdu import NEGATIVE_ACK, Apdu, PduType
from dissectors.bacnet.data_exchanges import DataExchanges
from dissectors.bacnet.exchange import Exchange, Key, mirrored, read
from dissectors.bacnet.foreign_answers import answered_for
from dissectors.bacnet.frame_types import EXPECTING, FrameType, total
from dissectors.bacnet.header import is_whole_header
from dissectors.bacnet.limits import MAX_ENCODED, T_REPLY_DELAY, T_USAGE_DELAY, TURNAROUND_BITS
from dissectors.bacnet.reassembly import Reassembler
from dissectors.bacnet.repeated_token import is_too_soon
from dissectors.bacnet.turn import Turn
from dissectors.frame import Event, Frame, Header, Noise, Role
from dissectors.line import Timing
from dissectors.tracker import Placement, Tracked, Transaction, Verdict

_REPLY: dict[int, int] = {
    FrameType.POLL_FOR_MASTER: FrameType.REPLY_TO_POLL_FOR_MASTER,
    FrameType.TEST_REQUEST: FrameType.TEST_RESPONSE,
}

_ACKNOWLEDGED = frozenset((PduType.SIMPLE_ACK, PduType.COMPLEX_ACK))
"""Answers to a request that came whole."""


@dataclass(slots=True)
class Standing:
    """What a tracker knows between two frames.

    `next`: id of the next transaction. `waiting`: what holds the bus. `previous`: the frame before, and its
    transaction. `postponed`, `past`: open exchanges, and those that are over, by key.
    """

    next: int
    waiting: Exchange | None
    previous: tuple[Frame, int] | None
    postponed: OrderedDict[Key, Exchange]
    past: OrderedDict[Key, tuple[Exchange, Verdict, int]]
    turn: Turn
    reassembler: Reassembler


class MstpTracker(DataExchanges):
    """The tracker of one MS/TP bus; `dissectors.tracker` has the contract."""

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing)
        self._latency = timing.latency
        self._under_way = 2 * timing.latency + total(MAX_ENCODED) * timing.char
        self._turnaround = timing.line.bits(TURNAROUND_BITS)
        self._previous: tuple[Frame, int] | None = None  # the frame before, and its transaction
        self._turn = Turn(timing)
        self._clock: int | None = None
        self._reassembler = Reassembler()
        self._usurped: Exchange | None = None  # another station has just answered in place of the one that was asked

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        if isinstance(event, Noise) or header is None:
            if isinstance(event, Noise):
                self._turn.see_noise(event)
            return Tracked(None, tuple(self._expire(event.start)))
        closed = self._expire(event.start)
        self._clock = event.end if self._clock is None else max(self._clock, event.end)
        self._assembly = self._reassembler.add(no, event)
        placement = self._place(no, event, header, closed)
        self._previous = (event, placement.tx)
        return Tracked(placement, tuple(closed), self._assembly)

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now`; a frame may be under way that began its own length earlier."""
        return tuple(self._expire(now - self._under_way))

    # Where a frame belongs

    def _place(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        if self._is_echo(frame):
            return self._echo(no, frame, header, closed)
        if not frame.ok:
            return self._damaged(no, frame, header, closed)
        frame_type = frame.octets[2]
        self._turn.see(frame, frame_type, frame.octets[4], frame.octets[3])
        if self._usurped is not None:
            self._see_wait(self._usurped, frame, closed)
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
        if frame_type == FrameType.REPLY_POSTPONED and self._previous is not None:
            before, tx = self._previous  # a segment or an acknowledgement of an exchange that goes on
            if before.octets[2] in EXPECTING and before.octets[3:5] == bytes((frame.octets[4], frame.octets[3])):
                return self._at(no, tx, header, Role.RESPONSE)
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
            apdu = message.apdu if message is not None else None
            if waiting.damaged:
                if key is not None and apdu is not None and self._is_of_open(waiting, key, apdu, closed):
                    return None
                waiting.key = key
            if apdu is not None and key is not None and apdu.type == PduType.SEGMENT_ACK:
                waiting.damaged = False  # acknowledged: the segment got there whole, the listener alone had it damaged
                if key != waiting.key:
                    key = mirrored(key)
            if key == waiting.key and (apdu is None or apdu.type != PduType.CONFIRMED_REQUEST):
                return self._answered(waiting, no, frame, header, apdu, closed)
            if waiting.key is not None:  # another answer went first: this one can only come later
                self._waiting = None
                self._keep(waiting, closed)
                return None
        if waiting.segmented and header.source == waiting.source:
            message, key = read(frame)
            if key == waiting.key and message is not None and message.apdu is not None and message.apdu.sequence:
                self._waiting = None  # the same segment again
                self._keep(waiting, closed)
                return None
        if self._is_usurped(waiting, frame):
            waiting.usurped, self._waiting, self._usurped = True, None, waiting
            self._keep(waiting, closed)
            return None
        self._let_go(waiting, closed)
        return None

    def _is_usurped(self, waiting: Exchange, frame: Frame) -> bool:
        """Whether another station answers in place of the one that was asked: who asked takes it and goes on."""
        if waiting.key is None or self._previous is None or self._previous[1] != waiting.id:
            return False
        asked = self._previous[0]
        return frame.octets[4] != waiting.destination and answered_for(frame, asked, asked) == waiting.destination

    def _see_wait(self, usurped: Exchange, frame: Frame, closed: list[Transaction]) -> None:
        """Who asked did not take the answer of another station where it waits until it may give up."""
        self._usurped = None
        if frame.octets[4] == usurped.source and usurped.interval(frame).low >= T_REPLY_DELAY:
            assert usurped.key is not None
            self._postponed.pop(usurped.key, None)
            closed.append(self._end(usurped, Verdict.NO_RESPONSE))

    def _is_of_open(self, damaged: Exchange, key: Key, apdu: Apdu, closed: list[Transaction]) -> bool:
        """Whether what follows a damaged request belongs to an exchange that was open before; the request is over then.

        It was the next segment of that exchange, which got there whole, where it is acknowledged or answered.
        """
        begun = self._postponed.get(key)
        if begun is None and apdu.type == PduType.SEGMENT_ACK:
            begun = self._postponed.get(mirrored(key))
        if begun is None:
            return False
        acknowledged = apdu.type == PduType.SEGMENT_ACK and not apdu.flags & NEGATIVE_ACK
        arrived = acknowledged or (begun.more_follows and apdu.type in _ACKNOWLEDGED)
        self._waiting, damaged.of = None, begun.id
        closed.append(damaged.close(Verdict.DATA if arrived else Verdict.DAMAGED_REQUEST))
        return True

    # Damage and echoes

    def _damaged(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        header = self._named(frame, header)
        source, waiting = header.source, self._waiting
        self._note_spoilt(source, header.destination)
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
        """An exact copy sooner than any node may send it, by the largest reading of the time: a token or a poll is only
        repeated after a wait; anything else may be sent twice in a row, where the adapter does not hide such times."""
        if self._previous is None:
            return False
        before = self._previous[0]
        if not frame.ok or before.octets != frame.octets or before.end >= frame.end:
            return False
        gap = frame.start - before.end
        if frame.octets[2] in (FrameType.TOKEN, FrameType.POLL_FOR_MASTER) and frame.octets[3] != frame.octets[4]:
            return is_too_soon(gap, before.slack, self._turnaround)
        return self._latency < T_USAGE_DELAY and gap + before.slack < self._turnaround

    def _echo(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        of = self._previous[1] if self._previous is not None else None
        exchange = self._open(no, frame, header)
        exchange.of = of
        closed.append(exchange.close(Verdict.ECHO))
        return self._at(no, exchange.id, header)

    # At a seam: frames that were paired by columns are not tracked (pairing.py)

    def standing(self) -> Standing:
        """Where it stands after the newest frame; what is mutable in it is its own."""
        return Standing(
            self._next, self._waiting, self._previous, self._postponed, self._past, self._turn, self._reassembler
        )

    def resume(self, standing: Standing) -> None:
        """Go on as if it had tracked what came meanwhile."""
        self._next, self._waiting, self._previous = standing.next, standing.waiting, standing.previous
        self._past = standing.past
        self._assembly = None
