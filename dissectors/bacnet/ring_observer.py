"""Watches the frames of a bus and keeps the model of who has the token (ANSI/ASHRAE 135, 9.5.6, seen from outside).

The token is held by one station, or on its way to one that has not used it yet. A station may send when it holds it,
when the token is on its way to it, when it passed the token on and nobody used it, or when it was asked. Whoever sends
otherwise was passed the token in frames that were not heard (`unheard.py`), has a second token (`second_tokens.py`), is
a slave that speaks unasked, or uses a token that was given up; the one who holds the token is innocent of it. When the
bus was silent for 500 ms before, the token was lost and made anew. After damage, noise or the begin of a capture
nothing is concluded: a token may have passed unseen. Times over a limit are judged by their smallest reading, and only
where the read was not held back (`held_reads.py`).
"""

from __future__ import annotations

from dissectors.bacnet.frame_types import CARRIES_NPDU, EXPECTING, HEADER, PROPRIETARY, FrameType
from dissectors.bacnet.header import is_whole_header
from dissectors.bacnet.held_reads import HeldReads, surely_over
from dissectors.bacnet.limits import (
    BROADCAST,
    MAX_MASTER,
    N_MIN_OCTETS,
    T_NO_TOKEN,
    T_USAGE_DELAY,
    T_USAGE_TIMEOUT,
    TURNAROUND_BITS,
)
from dissectors.bacnet.lost_tokens import breaks_off, longest_wait, makes_token
from dissectors.bacnet.repeated_token import RepeatedToken
from dissectors.bacnet.ring import Ring, RingEvent, RingEventKind
from dissectors.bacnet.ring_addresses import check_addresses, see_i_am
from dissectors.bacnet.ring_damage import count_damage, speaker_of
from dissectors.bacnet.ring_questions import AskedInRing, RingQuestions, is_proprietary_answer, is_second_answer
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.bacnet.searches import begin_search, end_search
from dissectors.bacnet.second_tokens import GivenUp, SecondTokens
from dissectors.bacnet.storms import Storms
from dissectors.bacnet.turn import Turn
from dissectors.bacnet.unheard import UnheardFrames
from dissectors.frame import Damage, Frame, Header, Noise, Role
from dissectors.frame import Event as FramerEvent
from dissectors.line import Timing

_HOLD_MAX = 64  # longest run of data frames that is counted by itself

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

_ANSWERS = frozenset((_POLL_REPLY, _TEST_REPLY, _POSTPONED))


class MstpRingObserver:
    """Fed every event of a bus in order; gives the `Ring` at any time. Total."""

    def __init__(self, timing: Timing) -> None:
        self._tally = RingTally(timing)
        self._least_gap = timing.line.bits(TURNAROUND_BITS) // 2
        self._holder: int | None = None  # None: not known
        self._passed_by: int | None = None  # who passed the token to the holder, while the holder has not used it
        self._token: Frame | None = None  # that token, while unused
        self._second = SecondTokens(self._tally)
        self._repeated = RepeatedToken()
        self._got: int | None = None  # when the holder got the token
        self._hold = 0  # data frames sent on this token
        self._doubt = True  # something may have been missed since the last good frame
        self._broke_off = False  # that is a frame of the holder that was cut short, and nothing else
        self._before: Frame | None = None  # the last good frame
        self._quiet_since: int | None = None  # end of the last event of any kind
        self._quiet_slack = 0  # of the last event
        self._missed: int | None = None  # where octets may be lost, until an event comes after it
        self._turn = Turn(timing)
        self._reads = HeldReads(self._least_gap)
        self._unheard = UnheardFrames(self._tally, self._least_gap)
        self._questions = RingQuestions(self._tally, self._reads, self._unheard)
        self._storms = Storms()

    def see(self, no: int, event: FramerEvent, header: Header | None) -> None:
        """Take the next event; `header` is None for noise.

        Noise without octets is a hole: nobody listened for a while, and nothing is concluded from the silence.
        """
        tally = self._tally
        if self._missed is not None and (event.end >= self._missed or self._silence(event) >= T_NO_TOKEN):
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
                    self._questions.asked = None
                    self._disturb(no, event.start)
                self._doubt, self._broke_off = True, False
            else:
                self._see_hole(event.start)
        else:
            tally.frames += 1
            tally.octets += len(event.octets)
            for late in self._reads.settle(event):
                tally.note(late.what, late.time, late.no, late.mac, late.other, late.value)
            if not event.ok and event.damage is not Damage.LONG:
                self._see_damage(no, event, header)
            elif header.source is not None and header.destination is not None and header.function is not None:
                self._see_good(no, event, header.function, header.source, header.destination, header)
                self._turn.see(event, header.function, header.source, header.destination)
                self._before = event
                self._doubt = False
        self._see_gap(event)
        self._quiet_since = event.end

    def _see_gap(self, event: FramerEvent) -> None:
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

    # Holes and damage

    def _see_hole(self, end: int) -> None:
        """No wait that began before it is measured to its end."""
        self._forget()
        self._missed, self._quiet_since = None, end
        self._second.given_up = None
        self._repeated.forget()
        self._questions.forget()
        self._reads.forget()
        self._doubt, self._broke_off = True, False
        self._tally.hole = max(self._tally.hole, end)
        for node in self._tally.nodes.values():
            node.got = node.searching_since = None

    def _see_damage(self, no: int, frame: Frame, header: Header) -> None:
        tally, asked = self._tally, self._questions.asked
        self._broke_off = not self._doubt and breaks_off(frame, self._holder)
        speaker = speaker_of(frame, header, self._turn)
        count_damage(tally, frame, None if self._disturb(no, frame.start) else speaker)
        self._questions.asked = None
        if asked is None or speaker is None or asked.frame_type == _POLL:
            pass
        elif (speaker.source, speaker.destination) == (asked.destination, asked.source):
            tally.note(RingEventKind.DAMAGED_REPLY, frame.start, no, asked.destination, asked.source)
        if is_whole_header(frame) and header.function in (*EXPECTING, _TEST) and header.destination != BROADCAST:
            assert header.source is not None
            assert header.destination is not None
            self._questions.asked = AskedInRing(header.function, header.source, header.destination, frame, no)
        self._doubt = True

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
        self._questions.holder = self._holder
        answers = self._questions.is_answer(no, frame, frame_type, source, destination, node)
        check_addresses(tally, no, frame, frame_type, source, destination)
        if frame_type == _TOKEN:
            if not answers:
                self._take_turn(no, frame, source, node, header)
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
            node.postponed += 1
        elif frame_type != _TEST_REPLY:
            if not answers:
                self._take_turn(no, frame, source, node, header)
            if frame_type == _TEST:
                self._questions.asked = AskedInRing(frame_type, source, destination, frame, no)
            elif frame_type in CARRIES_NPDU or frame_type >= PROPRIETARY:
                self._see_data(no, frame, frame_type, source, destination, node, answers, header)

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
            if self._storms.see(frame.end):
                self._tally.note(RingEventKind.STORM, frame.start, no, source)
        if not answers:
            self._hold += 1
            self._questions.end_postponed(frame, source, destination, node)
        if frame_type in EXPECTING and not answers:
            if destination == BROADCAST:
                self._tally.note(RingEventKind.BROADCAST_REQUEST, frame.start, no, source)
            elif header.role is Role.REQUEST:  # answers and what is unconfirmed ask for nothing, whatever the type says
                node.requests_sent += 1
                self._tally.node(destination).requests_received += 1
                self._questions.asked = AskedInRing(frame_type, source, destination, frame, no)
        if header.kind == "i-am":
            see_i_am(self._tally, no, frame, source, node)

    # Who may send

    def _is_new_token(self, frame: Frame, source: int) -> bool:
        """Whether the silence before a frame was so long that its sender made the token anew.

        By its smallest reading, whoever sends; by its largest one, where the sender neither had the token nor passed
        it: no other cause of so long a silence leaves a token to anybody, while a second one is not proved by it.
        """
        silence = self._silence(frame)
        if silence - frame.slack >= T_NO_TOKEN:
            return True
        if self._holder is None or source in (self._holder, self._passed_by):
            return False
        return silence + self._quiet_slack >= T_NO_TOKEN

    def _lose_token(self, no: int, frame: Frame, source: int) -> None:
        tally = self._tally
        self._questions.give_up(no, frame, source)
        if self._unheard.is_mute(self._holder):  # whatever it sends is silence here
            tally.note(RingEventKind.UNHEARD, frame.start, no, self._holder, source)
        elif frame.octets[2] in _ANSWERS:  # somebody had the token and asked
            tally.note(RingEventKind.UNHEARD, frame.start, no, frame.octets[3], source)
        elif tally.edges:  # where no token was ever seen, none can be lost
            silence = self._silence(frame)
            if not makes_token(frame):
                tally.note(RingEventKind.ALL_SILENT, frame.start, no, None, source, silence)
            else:
                disturbed = (self._doubt and not self._broke_off) or self._was_interrupted()
                unknown = disturbed or self._were_all_silent(silence - frame.slack)
                holder = None if unknown else self._holder
                tally.note(RingEventKind.LOST_TOKEN, frame.start, no, holder, source, silence)
                begin_search(tally.node(source), frame.start)
        self._forget()

    def _were_all_silent(self, silence: int) -> bool:
        """Whether no other master that the ring has can have been alive all the time."""
        others = (
            mac for mac, node in self._tally.nodes.items() if node.tokens_sent and not node.gone and mac != self._holder
        )
        return silence >= longest_wait(others)

    def _was_interrupted(self) -> bool:
        """Whether the last good frame was neither by nor for the holder of the token, who may have let go of it then.

        Damage in between (`_doubt`) may have been the token, or its use.
        """
        before = self._before
        return before is not None and self._holder is not None and self._holder not in before.octets[3:5]

    def _take_turn(self, no: int, frame: Frame, source: int, node: NodeTally, header: Header) -> None:
        """A frame that only the holder of the token may send."""
        if source == self._holder:
            if self._token is not None:  # its first frame with this token, or the first that was not damaged
                gap = frame.start - self._token.end
                if not self._doubt:
                    node.use.add(gap)
                    if surely_over(frame, self._token, T_USAGE_DELAY):
                        self._late(RingEventKind.LATE_USE, no, frame, source, self._passed_by, gap)
                self._token = self._passed_by = None
            return
        if self._was_asked(no, frame, source, header):
            return
        if source == self._passed_by:  # nobody used it: it is repeated, or somebody else is looked for
            if not self._came_back(no, frame, source):
                self._take_back(no, frame, source, node)
            return
        if self._is_known_second(no, frame, source):
            return
        if self._holder is not None and not self._doubt:
            if self._was_unheard(no, frame, source, node):
                return
            if self._is_slave(frame, source, node):
                self._tally.note(RingEventKind.UNASKED, frame.start, no, source, self._holder)
                self._token = None  # the time to its use is not its own any more
            else:
                self._tally.note(RingEventKind.TWO_TOKENS, frame.start, no, source, self._holder)
                self._second.of = source
            return
        self._forget()
        self._holder = source

    def _came_back(self, no: int, frame: Frame, source: int) -> bool:
        """Whether the token was used unheard, and is back: its sender goes on sooner than it may repeat it."""
        token, holder = self._token, self._holder
        if token is None or holder is None or self._doubt or frame.octets == token.octets:
            return False
        if frame.start - token.end + token.slack >= T_USAGE_TIMEOUT:
            return False
        if not self._unheard.passed_on(no, frame, token, holder, source):
            return False
        self._hold_unseen(source)
        return True

    def _take_back(self, no: int, frame: Frame, source: int, node: NodeTally) -> None:
        """The station that passed the token sends again: the next one has not used it."""
        if self._holder is not None and frame.octets[2] != _TOKEN:
            token_end = frame.start if self._token is None else self._token.end
            self._second.given_up = GivenUp(self._holder, source, token_end)
            if frame.octets[2] == _POLL and not self._doubt:  # damage in between may have been its use
                self._tally.note(RingEventKind.LEFT, frame.start, no, self._holder, source)
                self._tally.node(self._holder).gone = True
            if frame.octets[2] == _POLL:
                begin_search(node, frame.start)
        self._holder = source
        self._passed_by = self._token = None

    def _is_known_second(self, no: int, frame: Frame, source: int) -> bool:
        """Whether another token is known of that this station has: its cause is told once."""
        second = self._second
        if second.uses_given_up(no, frame, source, self._doubt) or source == second.of:
            return True
        if second.are_known(frame.start):
            self._holder, self._passed_by, self._token = source, None, None
            return True
        return False

    def _was_unheard(self, no: int, frame: Frame, source: int, node: NodeTally) -> bool:
        """Whether frames that the tap did not hear explain why this station sends, or it had the token all the time."""
        before, holder = self._before, self._holder
        assert before is not None
        assert holder is not None
        if self._is_slave(frame, source, node) and not self._unheard.is_mute(holder):
            return False
        if self._unheard.passed_on(no, frame, before, holder, source):
            self._hold_unseen(source)
            return True
        if self._unheard.take_back(source):
            self._hold_unseen(source)
            self._second.of = holder
            return True
        return False

    def _was_asked(self, no: int, frame: Frame, source: int, header: Header) -> bool:
        """Whether it answers the holder of the token after all, or a question that was not heard.

        Then who asked has the token, or must have got it.
        """
        before, holder, client = self._before, self._holder, header.destination
        if before is None or holder is None or client is None or self._doubt:
            return False
        if client == holder and is_proprietary_answer(frame, before):
            return True
        if header.role is not Role.RESPONSE:
            return False
        if (source, client) in self._questions.postponed or is_second_answer(frame, before):
            return False
        if not self._unheard.asked(no, frame, before, holder, client, source):
            return False
        if client != holder:
            self._hold_unseen(client)
        return True

    def _hold_unseen(self, holder: int) -> None:
        """A station has the token, and it is not known since when."""
        self._holder, self._passed_by, self._token, self._got = holder, None, None, None
        self._second.of, self._hold = None, 0

    def _is_slave(self, frame: Frame, source: int, node: NodeTally) -> bool:
        """Whether it has never had a token, nor does what only masters do."""
        takes_part = node.tokens_received or node.tokens_sent or node.polls_sent or node.poll_replies_sent
        return source > MAX_MASTER or not (takes_part or frame.octets[2] in (_TOKEN, _POLL))

    def _pass_token(self, no: int, frame: Frame, source: int, destination: int, node: NodeTally) -> None:
        tally, before = self._tally, self._before
        edge = tally.edges.get((source, destination)) or tally.edge(source, destination)
        target = tally.nodes.get(destination) or tally.node(destination)
        edge.tokens += 1
        edge.last = target.last_token = frame.end
        if node.next != destination:
            node.next, edge.since, edge.streak = destination, frame.start, 0
        edge.streak += 1
        node.tokens_sent += 1
        end_search(tally, no, frame, source, node)
        again = (
            before is not None
            and not self._doubt
            and before.octets[:HEADER] == frame.octets[:HEADER]
            and self._gap(frame) + before.slack >= T_USAGE_TIMEOUT // 2
        )
        if again and before is not None:
            self._repeated.repeat(destination, before.end)
            edge.retries += 1
            tally.note(RingEventKind.RETRY, frame.start, no, destination, source, self._gap(frame))
        else:
            hold = min(self._hold, _HOLD_MAX)
            node.holds[hold] = node.holds.get(hold, 0) + 1
            target.tokens_received += 1
            if target.got is not None:
                target.loop.add(frame.end - target.got)
            target.got = frame.end
        self._hold = 0
        if source == destination:
            tally.note(RingEventKind.SELF_TOKEN, frame.start, no, source)
        if source == self._second.of and source != self._holder:
            self._second.of = destination
            return
        if source == self._holder and self._got is not None and not self._doubt:
            node.held += max(0, frame.end - self._got)
        self._got = frame.end
        self._second.passed(destination)
        self._unheard.heard(destination)
        self._holder, self._passed_by, self._token = destination, source, frame

    # Times

    def _late(self, what: RingEventKind, no: int, frame: Frame, mac: int, other: int | None, value: int) -> None:
        """Something was late, unless the next frame shows that the read was."""
        self._reads.add(RingEvent(what, frame.start, no, mac, other, value))

    def _gap(self, frame: Frame) -> int:
        return 0 if self._before is None else max(0, frame.start - self._before.end)

    def _silence(self, event: FramerEvent) -> int:
        return 0 if self._quiet_since is None else max(0, event.start - self._quiet_since)

    def _forget(self) -> None:
        self._questions.asked = None
        self._holder = self._passed_by = self._token = self._second.of = self._got = None
        self._hold = 0
        self._unheard.forget()
