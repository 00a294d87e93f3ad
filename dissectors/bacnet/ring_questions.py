"""Polls, tests and requests that wait for an answer on a ring: whether it comes, too late, or never."""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass

from dissectors.bacnet import message as messages
from dissectors.bacnet.foreign_answers import is_astray
from dissectors.bacnet.frame_types import CARRIES_NPDU, EXPECTING, PROPRIETARY, FrameType
from dissectors.bacnet.held_reads import HeldReads, surely_over
from dissectors.bacnet.limits import MAX_MASTER, MS, T_NO_TOKEN, T_REPLY_DELAY, T_USAGE_DELAY, T_USAGE_TIMEOUT
from dissectors.bacnet.message import data_of, more_follows
from dissectors.bacnet.open_exchanges import POSTPONED_FOR
from dissectors.bacnet.ring_events import RingEvent, RingEventKind
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.bacnet.ring_window import Happening
from dissectors.bacnet.unheard import UnheardFrames
from dissectors.frame import Frame

_POSTPONED_MAX = 64
_UNANSWERED_MAX = 32
T_LATE_ANSWER = 2 * T_NO_TOKEN
"""An answer that comes after its asker gave up is still one within this time."""

T_OVERDUE = T_NO_TOKEN
"""Until when damage may come of an answer that is late: most are so by little, and later all else strikes as well."""

T_GO_ON = 100 * MS
"""The longest time that any text lets a station wait for the answer to a poll (Tusage_timeout)."""

_POLL, _TEST = int(FrameType.POLL_FOR_MASTER), int(FrameType.TEST_REQUEST)
_ASKS = frozenset(map(int, EXPECTING))
_NO_ANSWERS = frozenset(
    (FrameType.TOKEN, FrameType.POLL_FOR_MASTER, FrameType.REPLY_TO_POLL_FOR_MASTER, FrameType.TEST_REQUEST)
)


@dataclass(slots=True)
class AskedInRing:
    """The frame that waits for its answer.

    `missed`: it was counted as one that nobody answered. `overtaken`: ns after which who asked went on, so soon that it
    must have had the answer, though that was not heard; None elsewhere.
    `free`: it asks by its frame type alone, as segments of an answer do; who is asked may answer now, later or not.
    `usurped`: another station has answered in place of the one that was asked, so that who asked may go on with that.
    """

    frame_type: int
    source: int
    destination: int
    frame: Frame
    no: int
    missed: bool = False
    overtaken: int | None = None
    free: bool = False
    usurped: bool = False

    def waits_for(self, source: int, destination: int | None) -> bool:
        """Whether an answer from `source` to `destination` is what it waits for."""
        return source == self.destination and destination == self.source


class RingQuestions:
    """`asked` is what must be answered now; those given up, and those postponed, are remembered, bounded.

    `doubt`: something may have been missed since the last good frame. `holder`: who has the token, as far as known.
    `late`: who sent the newest good frame, where that was an answer for which nobody waited any more.
    `found`: who has just answered a poll in time, and whose.
    `alone_since`: the earliest that the frame before may have begun, None where it has no time of its own.
    """

    def __init__(self, tally: RingTally, reads: HeldReads, unheard: UnheardFrames) -> None:
        self.asked: AskedInRing | None = None
        self.doubt = True
        self.holder: int | None = None
        self.late: int | None = None
        self.alone_since: int | None = None
        self.found: tuple[int, int] | None = None
        self._tally = tally
        self._reads = reads
        self._unheard = unheard
        self._unanswered: OrderedDict[tuple[int, int], AskedInRing] = OrderedDict()  # by server and client
        self._postponed: deque[tuple[int, int, int]] = deque(maxlen=_POSTPONED_MAX)  # server, client, end of request

    @property
    def postponed(self) -> set[tuple[int, int]]:
        """Server and client of each answer that was postponed."""
        return {(server, client) for server, client, _ in self._postponed}

    def forget(self) -> None:
        """Octets were missed: nobody is measured against what was asked before."""
        self.asked = self.late = self.found = None
        self._unanswered.clear()
        self._postponed.clear()

    def is_answer(self, no: int, frame: Frame, frame_type: int, source: int, destination: int, node: NodeTally) -> bool:
        """Close what waits for an answer; say whether this frame of `node` is it, now or late."""
        asked, self.asked, self.late = self.asked, None, None
        if self.found is not None:
            self._see_found(self.found, no, frame, frame_type, source, destination)
        if asked is not None and self._answers(asked, no, frame, frame_type, source, destination, node):
            return True
        if not self._unanswered or source == self.holder or frame_type not in CARRIES_NPDU:
            return False
        return self._is_late(no, frame, source, destination)

    def _see_found(
        self, found: tuple[int, int], no: int, frame: Frame, frame_type: int, source: int, destination: int
    ) -> None:
        """Whoever answered a poll in time gets the token at once, if the one that polled heard it."""
        replier, poller = found
        self.found = None
        if source == poller and not self.doubt and (frame_type != FrameType.TOKEN or destination != replier):
            self._tally.note(RingEventKind.NOT_TAKEN, frame.start, no, poller, replier)

    def awaits(self, source: int) -> bool:
        """Whether it is the turn of `source`, which was asked."""
        return self.asked is not None and self.asked.destination == source

    def owes(self, server: int, client: int) -> bool:
        """Whether a station may still answer what it was asked: it postponed its answer, or has given none."""
        return (server, client) in self._unanswered or (server, client) in self.postponed

    def overdue(self, start: int) -> list[tuple[int, int]]:
        """Whose answer, and to whom, is overdue at that time: it may fall on what is sent then."""
        waiting = [one for one in self._unanswered.values() if one.missed]
        if self.asked is not None and self.asked.frame_type in _ASKS and not self.asked.free:
            waiting.append(self.asked)
        return [
            (one.destination, one.source)
            for one in waiting
            if T_REPLY_DELAY < start - one.frame.end <= T_OVERDUE and one.frame.ok
        ]

    def is_searching(self, frame: Frame) -> bool:
        """Whether a frame goes on with the search of the newest poll, to the next address: no station that has lost the
        token begins there."""
        asked, octets = self.asked, frame.octets
        if asked is None or asked.frame_type != _POLL or octets[2] != _POLL or octets[4] != asked.source:
            return False
        ways = {(asked.destination + 1) % (MAX_MASTER + 1), 0}  # Max_Master may be less
        following = {at + 1 if at == asked.source else at for at in ways}
        return octets[3] in following and octets[3] != asked.source + 1

    def give_up(self, no: int, frame: Frame, source: int) -> None:
        """Nobody answered, and after a long silence `source` begins anew."""
        asked, self.asked = self.asked, None
        if asked is None or asked.frame_type == _TEST:
            return
        if asked.frame_type == _POLL:
            self._unanswered_poll(asked, no, frame, source)
        else:
            self._unanswered_request(asked, frame)

    def end_postponed(self, frame: Frame, source: int, destination: int, node: NodeTally) -> None:
        """Data that may be the answer which was postponed."""
        for waiting in tuple(self._postponed):
            server, client, asked_at = waiting
            if server == source and client == destination:
                self._postponed.remove(waiting)
                if frame.start - asked_at < POSTPONED_FOR:  # else its answer was not heard, and this is something else
                    node.service.add(frame.start - asked_at)
                    return

    def _answers(
        self, asked: AskedInRing, no: int, frame: Frame, frame_type: int, source: int, destination: int, node: NodeTally
    ) -> bool:
        back = asked.waits_for(source, destination)
        took = frame.start - asked.frame.end
        if asked.frame_type == _POLL:
            if not back or frame_type != FrameType.REPLY_TO_POLL_FOR_MASTER:
                self._unanswered_poll(asked, no, frame, source)
                return False
            node.poll_reply.add(took)
            if took + asked.frame.slack <= T_USAGE_TIMEOUT:
                self.found = source, destination
            if self._reads.is_late(frame, asked.frame, T_USAGE_DELAY):
                self._reads.add(RingEvent(RingEventKind.LATE_POLL_REPLY, frame.start, no, source, destination, took))
            return True
        if asked.frame_type == _TEST:
            answered = back and frame_type == FrameType.TEST_RESPONSE
            to_itself = answered and asked.frame.ok and source == destination
            if to_itself and data_of(frame.octets) != data_of(asked.frame.octets):
                self._tally.note(RingEventKind.OTHER_ECHO, frame.start, no, source)
            return answered
        if frame_type in CARRIES_NPDU and not self.doubt and is_astray(frame, asked.frame):
            self._tally.note(RingEventKind.ASTRAY, frame.start, no, source, destination)
            return True
        if not back or frame_type in _NO_ANSWERS:
            self._unanswered_request(asked, frame)
            return False
        node.replies += 1
        node.reply.add(took)
        if self._reads.is_late(frame, asked.frame, T_REPLY_DELAY):
            self._reads.add(RingEvent(RingEventKind.LATE_REPLY, frame.start, no, source, destination, took))
        if frame_type == FrameType.REPLY_POSTPONED and not asked.free:
            self._postponed.append((source, destination, asked.frame.end))
        return True

    def _unanswered_poll(self, asked: AskedInRing, no: int, frame: Frame, source: int) -> None:
        if not self.doubt and self._unheard.poll_answered(asked.no, asked.frame, frame):
            return
        node = self._tally.node(asked.source)
        wasted = max(0, min(frame.start - asked.frame.start, T_NO_TOKEN))
        self._tally.poll_waste += wasted
        node.polls_unanswered += 1
        self._tally.enter(Happening.UNANSWERED, no, asked.source)
        self._tally.enter(Happening.WASTED, no, asked.source, wasted)
        if source == asked.source:
            self._go_on(asked, no, frame, node)

    def _go_on(self, asked: AskedInRing, no: int, frame: Frame, node: NodeTally) -> None:
        """The station that polled has given the poll up: too soon, in time or late."""
        took = frame.start - asked.frame.end
        node.poll_wait.add(took)
        if surely_over(frame, asked.frame, T_USAGE_DELAY):
            node.polls_waited += 1
        if surely_over(
            frame, asked.frame, T_GO_ON
        ):  # told where half of all are so: no computer reads that late so often
            self._tally.note(RingEventKind.SLOW_SEARCH, frame.start, no, asked.source, asked.destination, took)
        since, same = self.alone_since, frame.octets == asked.frame.octets
        if since is None or took < self._reads.least_gap or self.doubt or same:
            return
        # the poll may have come in a late read too, and begun directly after what was before it
        longest = frame.start - since - (asked.frame.end - asked.frame.start)
        if longest < T_USAGE_DELAY // 2:
            self._tally.note(RingEventKind.TOO_SOON, frame.start, no, asked.source, asked.destination, took)

    def _unanswered_request(self, asked: AskedInRing, frame: Frame) -> None:
        if asked.free:
            return
        key = asked.destination, asked.source
        self._unanswered[key] = asked
        self._unanswered.move_to_end(key)
        if len(self._unanswered) > _UNANSWERED_MAX:
            self._unanswered.popitem(last=False)
        if self.doubt or not asked.frame.ok or more_follows(asked.frame) or self._is_owed(frame):
            return  # one that was damaged may have been so for everybody
        if asked.usurped and not surely_over(frame, asked.frame, T_REPLY_DELAY):
            return  # who asked went on with the other one's answer
        if self._unheard.answered(asked.no, asked.frame, frame):
            asked.overtaken = frame.start - asked.frame.end if frame.octets[4] == asked.source else None
        else:
            asked.missed = True
            self._tally.note(RingEventKind.NO_REPLY, asked.frame.end, asked.no, asked.destination, asked.source)

    def _is_owed(self, frame: Frame) -> bool:
        """Whether a frame may be the late answer to another question: it says nothing of the one that waits now."""
        asked = self._unanswered.get((frame.octets[4], frame.octets[3]))
        return asked is not None and frame.octets[2] in CARRIES_NPDU and frame.start - asked.frame.end <= T_LATE_ANSWER

    def _is_late(self, no: int, frame: Frame, source: int, destination: int) -> bool:
        """Whether it is for the one that asked and has given up: late, but neither lost nor a second token."""
        asked = self._unanswered.pop((source, destination), None)
        if asked is None:
            return False
        took = frame.start - asked.frame.end
        if took > T_LATE_ANSWER:
            return False
        if asked.missed:
            self._tally.take_back(RingEventKind.NO_REPLY, asked.no, source, destination)
        if asked.overtaken is not None:
            self._unheard.overtaken(asked.no, asked.frame, asked.overtaken)
        if took > T_REPLY_DELAY:  # sooner is in time, however soon the other one went on
            self.late = source
            self._tally.note(RingEventKind.LATE_REPLY, frame.start, no, source, destination, took)
        return True


def is_second_answer(frame: Frame, before: Frame) -> bool:
    """Whether a frame answers the same question as the one before it, of the same station."""
    if frame.octets[3:5] != before.octets[3:5]:
        return False
    first, second = messages.read(before), messages.read(frame)
    if first is None or second is None or first.apdu is None or second.apdu is None:
        return False
    return first.apdu.is_answer and first.apdu.invoke_id == second.apdu.invoke_id


def is_proprietary_answer(frame: Frame, before: Frame) -> bool:
    """Whether a proprietary frame comes back for the one before it: whether that asks for one, only its maker knows."""
    both = frame.octets[2] >= PROPRIETARY <= before.octets[2]
    return both and frame.octets[3] == before.octets[4] and frame.octets[4] == before.octets[3]
