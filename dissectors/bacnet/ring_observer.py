"""Watches the frames of a bus and keeps the model of its ring (ANSI/ASHRAE 135, 9.5.6, seen from outside).

Who has the token, and who may send, is followed by `token_watch.py`. After damage, noise or the begin of a capture
nothing is concluded: a token may have passed unseen. Times over a limit are judged by their smallest reading, and only
where the read was not held back (`held_reads.py`).
"""

from __future__ import annotations

from collections.abc import Sequence

from dissectors.bacnet.foreign_answers import answered_for
from dissectors.bacnet.frame_types import CARRIES_NPDU, EXPECTING, PROPRIETARY, FrameType
from dissectors.bacnet.header import is_whole_header
from dissectors.bacnet.limits import BROADCAST, MAX_MASTER, N_MIN_OCTETS, T_NO_TOKEN
from dissectors.bacnet.lost_tokens import breaks_off
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_addresses import check_addresses, see_i_am
from dissectors.bacnet.ring_damage import count_damage, speaker_of
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_questions import AskedInRing
from dissectors.bacnet.ring_tally import NodeTally
from dissectors.bacnet.ring_window import Happening, MstpRingWindow, RingJournal
from dissectors.bacnet.searches import PollSeries
from dissectors.bacnet.storms import Storms
from dissectors.bacnet.token_watch import AT_ONCE, TokenWatch
from dissectors.bacnet.turn import Turn
from dissectors.frame import Check, Damage, Event, Frame, Header, Noise, Role
from dissectors.line import Timing

_TOKEN, _POLL, _POLL_REPLY, _TEST, _TEST_REPLY, _POSTPONED = map(
    int,  # plain numbers compare faster than members
    (
        FrameType.TOKEN,
        FrameType.POLL_FOR_MASTER,
        FrameType.REPLY_TO_POLL_FOR_MASTER,
        FrameType.TEST_REQUEST,
        FrameType.TEST_RESPONSE,
        FrameType.REPLY_POSTPONED,
    ),
)


FAR = 1 << 62
"""Behind every row."""


class MstpRingObserver(TokenWatch):
    """Fed every event of a bus in order; gives the `Ring` at any time. Total."""

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing)
        self._missed: int | None = None  # where octets may be lost, until an event comes after it
        self._turn = Turn(timing)
        self._storms = Storms()
        self._series = PollSeries()

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next event; `header` is None for noise.

        Noise without octets is a hole: nobody listened for a while, and nothing is concluded from the silence.
        """
        tally = self._tally
        is_missed = self._missed is not None and (event.end >= self._missed or self._silence(event) >= T_NO_TOKEN)
        if tally.first is not None and (is_missed or not event.octets):
            tally.unheard += max(0, event.start - tally.last)
        if is_missed:
            self._see_hole(event.start)
        if tally.first is None:
            tally.first, tally.last = event.start, event.end
        elif event.end > tally.last:
            tally.last = event.end
        if isinstance(event, Noise) or header is None:
            if event.octets:
                tally.noise += len(event.octets)
                if isinstance(event, Noise):
                    self._turn.see_noise(event)
                if len(event.octets) >= N_MIN_OCTETS:  # fewer prove nothing: who was asked may still answer
                    self._note_overdue(no, event.start)
                    self._questions.asked = None
                    self._disturb(no, event.start)
                    self._damaged = event.end
                self._doubt, self._broke_off, self._disturbed = True, False, True
            else:
                self._see_hole(event.start)
        else:
            tally.frames += 1
            tally.octets += len(event.octets)
            for late in self._reads.settle(event):
                tally.note(late.what, late.time, late.no, late.mac, late.other, late.value)
            if not event.ok and not (event.damage is Damage.LONG and event.check is Check.GOOD):
                self._see_damage(no, event, header)
            elif header.source is not None and header.destination is not None and header.function is not None:
                self._see_good(no, event, header.function, header.source, header.destination, header)
                self._turn.see(event, header.function, header.source, header.destination)
                self._before = event
                self._doubt = False
        self._see_gap(event)
        self._quiet_since = event.end

    def _see_gap(self, event: Event) -> None:
        """Frames that stand back to back came in one read, maybe a late one, and have no times of their own."""
        if self._quiet_since is None or event.start - self._quiet_since >= self._least_gap:
            self._questions.alone_since = None if self._quiet_since is None else self._quiet_since - self._quiet_slack
        else:
            self._questions.alone_since = None
        self._quiet_slack = event.slack if isinstance(event, Frame) else self._tally.timing.latency

    def miss(self, time: int) -> None:
        """Say that octets may be lost about `time` (ns), before the next event that ends there or later."""
        self._missed = time

    def ring(self) -> Ring:
        """All that was seen so far."""
        return self._tally.value()

    def window(self) -> MstpRingWindow:
        """What is new since this was called the last time; the first time is not told of."""
        return self.windows([(FAR, self._tally.last)])[0]

    def windows(self, stops: Sequence[tuple[int, int]]) -> list[MstpRingWindow]:
        """See `dissectors.token_ring.WatchesColumns`."""
        if self._tally.journal is None:
            self._tally.journal = RingJournal()
        return self._tally.journal.windows(stops, self._tally.first) if stops else []

    # Holes and damage

    def _see_hole(self, end: int) -> None:
        """No wait that began before it is measured to its end."""
        self._forget()
        self._missed, self._quiet_since = None, end
        self._second.given_up = None
        self._repeated.forget()
        self._questions.forget()
        self._reads.forget()
        self._series.forget()
        self._doubt, self._broke_off = True, False
        self._tally.hole = max(self._tally.hole, end)
        for node in self._tally.nodes.values():
            node.got = node.searching_since = None

    def _see_damage(self, no: int, frame: Frame, header: Header) -> None:
        tally, asked = self._tally, self._questions.asked
        self._broke_off = not self._doubt and breaks_off(frame, self._holder)
        speaker = speaker_of(frame, header, self._turn)
        if self._note_overdue(no, frame.start):
            tally.note(RingEventKind.OVERDUE, frame.start, no, None, None if speaker is None else speaker.source)
        count_damage(tally, no, frame, None if self._disturb(no, frame.start) else speaker)
        self._questions.asked = None
        is_reply = False
        if asked is not None and speaker is not None and asked.frame_type != _POLL:
            is_reply = asked.waits_for(speaker.source, speaker.destination)
        if asked is not None and is_reply:
            tally.note(RingEventKind.DAMAGED_REPLY, frame.start, no, asked.destination, asked.source)
        if is_whole_header(frame) and header.function in (*EXPECTING, _TEST) and header.destination != BROADCAST:
            assert header.source is not None
            assert header.destination is not None
            asked = AskedInRing(header.function, header.source, header.destination, frame, no)
            asked.free = is_reply  # one that wants an answer by its type is a segment
            self._questions.asked = asked
        self._doubt = self._disturbed = True
        self._damaged = frame.end

    def _note_overdue(self, no: int, start: int) -> bool:
        """Whether answers are overdue where something is damaged; note whose."""
        overdue = self._questions.overdue(start)
        for server, client in overdue:
            self._tally.note(RingEventKind.OVERDUE, start, no, server, client)
        return bool(overdue)

    def _disturb(self, no: int, start: int) -> bool:
        """Whether octets that are no good frame may be of two: of the next one, and of one that has a second token."""
        mac = self._repeated.of
        took = None if mac is None else self._repeated.disturbed(start)
        if took is not None:
            self._tally.note(RingEventKind.USED_BOTH, start, no, mac, None, took)
        return took is not None

    # Good frames

    def _see_good(self, no: int, frame: Frame, frame_type: int, source: int, destination: int, header: Header) -> None:
        tally, before = self._tally, self._before
        self._questions.doubt = self._doubt
        node = tally.nodes.get(source) or tally.node(source)
        node.first = node.first or frame.start
        node.last = frame.end
        node.octets += len(frame.octets)
        if before is not None:
            if not self._doubt and max(0, frame.start - before.end) + before.slack < self._least_gap:
                tally.impossible += 1
            if self._is_new_token(frame, source):
                self._lose_token(no, frame, source)
        if (slow := self._repeated.of) is not None:
            took = self._repeated.see(frame, frame_type, source, destination)
            if took is not None:
                tally.note(RingEventKind.USED_BOTH, frame.start, no, slow, None, took)
        self._series.see(tally, no, frame, frame_type, source)
        self._questions.holder, asked = self._holder, self._questions.asked
        if self._answers_for_another(no, frame, frame_type, source, destination):
            node.data_sent += 1
            self._disturbed = True
            return
        answers = self._questions.is_answer(no, frame, frame_type, source, destination, node)
        check_addresses(tally, no, frame, frame_type, source, destination)
        if source != self._holder:
            self._disturbed = True
        self._breaks_in = source != self._holder and (not answers or self._questions.late is not None)
        if self._doubt and not answers and frame_type in AT_ONCE:
            self._hold_now(destination)
        elif answers and asked is not None and not asked.frame.ok and asked.waits_for(source, destination):
            self._answers_damaged(asked, frame_type, header)
        if frame_type == _TOKEN:
            if not answers:
                self._take_turn(no, frame, source, node, header)
            if destination <= MAX_MASTER:  # else nobody can take it: its sender still has it
                self._pass_token(no, frame, source, destination, node)
        elif frame_type == _POLL:
            if not answers:
                self._take_turn(no, frame, source, node, header)
            self._poll(no, frame, source, destination, node)
        elif frame_type == _POLL_REPLY:
            node.poll_replies_sent += 1
            if node.gone:
                tally.note(RingEventKind.REJOINED, frame.start, no, source, destination)
                node.gone = False
        elif frame_type == _POSTPONED:
            if asked is None or not asked.free:
                node.postponed += 1
                tally.enter(Happening.POSTPONED, no, source)
        elif frame_type != _TEST_REPLY:
            if not answers:
                self._take_turn(no, frame, source, node, header)
            if frame_type == _TEST:
                self._questions.asked = AskedInRing(frame_type, source, destination, frame, no)
            elif frame_type in CARRIES_NPDU or frame_type >= PROPRIETARY:
                self._see_data(no, frame, frame_type, source, destination, node, answers, header)

    def _answers_for_another(self, no: int, frame: Frame, frame_type: int, source: int, destination: int) -> bool:
        """Whether it answers what the holder of the token asked of another station. Notes it."""
        if source == self._holder or destination != self._holder or self._doubt:
            return False
        if frame_type not in CARRIES_NPDU or frame_type in EXPECTING:
            return False
        asked = self._questions.asked
        if self._before is None or self._questions.owes(source, destination):
            return False
        if asked is not None and asked.destination == source:
            return False
        other = answered_for(frame, self._before, None if asked is None else asked.frame)
        if other is None:
            return False
        if asked is not None:
            asked.usurped = True
        self._tally.note(RingEventKind.FOR_ANOTHER, frame.start, no, source, other)
        return True

    def _poll(self, no: int, frame: Frame, source: int, destination: int, node: NodeTally) -> None:
        node.polls_sent += 1
        before = self._before
        again = before is not None and before.octets[2] == _POLL and before.octets[4] == source
        if again or node.searches or node.after_search or not node.tokens_sent:  # maintenance polls once in a turn
            node.polls_of_search += 1
        if node.highest_polled < destination <= MAX_MASTER:
            node.highest_polled = destination
        self._questions.asked = AskedInRing(_POLL, source, destination, frame, no)
        if source <= MAX_MASTER and destination <= MAX_MASTER:
            self._tally.polled[source, destination] = frame.end
        polled = self._tally.nodes.get(destination)
        if polled is not None:
            polled.polls_received += 1
            polled.last_polled = frame.end

    def _see_data(
        self,
        no: int,
        frame: Frame,
        frame_type: int,
        source: int,
        destination: int,
        node: NodeTally,
        answers: bool,
        header: Header,
    ) -> None:
        node.data_sent += 1
        if destination == BROADCAST:
            node.broadcasts_sent += 1
            storm = self._storms.see(frame.end)
            if storm is not None:
                self._tally.note(RingEventKind.STORM, frame.start, no, source, None, storm)
        if not answers:
            self._hold += 1
            self._questions.end_postponed(frame, source, destination, node)
        if frame_type in EXPECTING and not answers:
            if destination == BROADCAST:
                self._tally.note(RingEventKind.BROADCAST_REQUEST, frame.start, no, source)
            else:  # answers and what is unconfirmed want nothing, but by their type they may be answered at once
                asks = header.role is Role.REQUEST
                if asks:
                    node.requests_sent += 1
                    self._tally.node(destination).requests_received += 1
                self._questions.asked = AskedInRing(frame_type, source, destination, frame, no, free=not asks)
        if header.kind == "i-am":
            see_i_am(self._tally, no, frame, source, node)
