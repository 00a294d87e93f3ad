"""Follows the token of a ring: who has it, and what it means that somebody else sends (ANSI/ASHRAE 135, 9.5.6).

The token is held by one station, or on its way to one that has not used it yet. A station may send when it holds it,
when the token is on its way to it, when it passed the token on and nobody used it, or when it was asked. Whoever sends
otherwise was passed the token in frames that were not heard (`unheard.py`), has a second token (`second_tokens.py`), is
a slave that speaks unasked, or uses a token that was given up; the one who holds the token is innocent of it. When the
bus was silent for 500 ms before, the token was lost and made anew (`lost_tokens.py`).
"""

from __future__ import annotations

from dissectors.bacnet.frame_types import EXPECTING, HEADER, FrameType
from dissectors.bacnet.held_reads import UNNAMED_TICK, HeldReads
from dissectors.bacnet.limits import BROADCAST, MAX_MASTER, T_NO_TOKEN, T_USAGE_DELAY, T_USAGE_TIMEOUT, TURNAROUND_BITS
from dissectors.bacnet.lost_tokens import longest_wait, makes_token
from dissectors.bacnet.repeated_token import RepeatedToken, is_too_soon
from dissectors.bacnet.ring_events import RingEvent, RingEventKind
from dissectors.bacnet.ring_questions import (
    T_LATE_ANSWER,
    AskedInRing,
    RingQuestions,
    is_proprietary_answer,
    is_second_answer,
)
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.bacnet.ring_window import Happening
from dissectors.bacnet.searches import begin_search, end_search
from dissectors.bacnet.second_tokens import GivenUp, SecondTokens
from dissectors.bacnet.unheard import UnheardFrames
from dissectors.frame import Event, Frame, Header, Role
from dissectors.line import Timing

_HOLD_MAX = 64  # longest run of data frames that is counted by itself

_TOKEN, _POLL, _TEST = map(  # plain numbers compare faster than members
    int, (FrameType.TOKEN, FrameType.POLL_FOR_MASTER, FrameType.TEST_REQUEST)
)
AT_ONCE = frozenset(map(int, (FrameType.REPLY_TO_POLL_FOR_MASTER, FrameType.TEST_RESPONSE, FrameType.REPLY_POSTPONED)))
"""Answers that are sent at once or not at all: to the one that has the token."""


class TokenWatch:
    """What a ring's observer knows of the token; it is told of good frames that only its holder may send, and of tokens
    passed on."""

    def __init__(self, timing: Timing) -> None:
        self._tally = RingTally(timing)
        self._turnaround = timing.line.bits(TURNAROUND_BITS)
        self._least_gap = self._turnaround // 2
        self._holder: int | None = None  # None: not known
        self._passed_by: int | None = None  # who passed the token to the holder, while the holder has not used it
        self._token: Frame | None = None  # that token, while unused
        self._disturbed = False  # since then others spoke, or octets came that may have been its use
        self._second = SecondTokens(self._tally)
        self._instead: int | None = None  # who has the token, if the holder's newest frame was an answer to it
        self._repeated = RepeatedToken()
        self._got: int | None = None  # when the holder got the token
        self._hold = 0  # data frames sent on this token
        self._doubt = True  # something may have been missed since the last good frame
        self._breaks_in = False  # whether the last good frame was unasked, and its sender had no token
        self._damaged: int | None = None  # the end of the newest octets that may have been a frame, and are none
        self._broke_off = False  # that is a frame of the holder that was cut short, and nothing else
        self._before: Frame | None = None  # the last good frame
        self._quiet_since: int | None = None  # end of the last event of any kind
        self._quiet_slack = 0  # of the last event
        self._reads = HeldReads(self._least_gap, 0 if timing.is_told else UNNAMED_TICK)
        self._unheard = UnheardFrames(self._tally, self._least_gap)
        self._questions = RingQuestions(self._tally, self._reads, self._unheard)

    def _is_new_token(self, frame: Frame, source: int) -> bool:
        """Whether the silence before a frame was so long that its sender made the token anew.

        By its smallest reading, whoever sends; by its largest one, where the sender neither had the token nor passed
        it: no other cause of so long a silence leaves a token to anybody, while a second one is not proved by it.
        """
        silence = self._silence(frame)
        if silence + self._quiet_slack >= T_NO_TOKEN and self._goes_on_slowly(frame, source):
            return False
        if silence - frame.slack >= T_NO_TOKEN:
            return True
        if self._holder is None or source in (self._holder, self._passed_by):
            return False
        if self._tally.timing.latency >= T_NO_TOKEN or self._questions.awaits(source):
            return False
        return silence + self._quiet_slack >= T_NO_TOKEN

    def _goes_on_slowly(self, frame: Frame, source: int) -> bool:
        """Whether who has the token goes on with its search, or after a token to itself, however late."""
        if source != self._holder:
            return False
        return self._questions.is_searching(frame) or self._passed_by == source

    def _lose_token(self, no: int, frame: Frame, source: int) -> None:
        tally = self._tally
        self._questions.give_up(no, frame, source)
        if self._unheard.is_mute(self._holder):  # whatever it sends is silence here
            tally.note(RingEventKind.UNHEARD, frame.start, no, self._holder, source)
        elif frame.octets[2] in AT_ONCE:  # somebody had the token and asked
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
                if (late := self._questions.late) is not None and not self._doubt:  # whoever hears it lets go
                    tally.note(RingEventKind.OVERDUE, frame.start, no, late, self._holder)
                begin_search(tally.node(source), frame.start)
        self._forget()

    def _were_all_silent(self, silence: int) -> bool:
        """Whether no other master that the ring has can have been alive all the time."""
        others = (
            mac for mac, node in self._tally.nodes.items() if node.tokens_sent and not node.gone and mac != self._holder
        )
        return silence >= longest_wait(others)

    def _was_interrupted(self) -> bool:
        """Whether the last good frame was none that the holder of the token sent or asked for.

        Whoever hears something else while it polls or passes its token takes it that another one has a token, and lets
        go of its own. Damage in between (`_doubt`) may have been the token, or its use.
        """
        before = self._before
        if self._breaks_in:
            return True
        return before is not None and self._holder is not None and self._holder not in before.octets[3:5]

    def _take_turn(self, no: int, frame: Frame, source: int, node: NodeTally, header: Header) -> None:
        """A frame that only the holder of the token may send."""
        if source == self._holder:
            if self._token is not None:  # its first frame with this token, or the first that was not damaged
                gap = frame.start - self._token.end
                if not self._doubt and not self._disturbed:
                    node.use.add(gap)
                    self._tally.enter(Happening.USE, no, source, gap)
                    if self._reads.is_late(frame, self._token, T_USAGE_DELAY):
                        what = RingEventKind.LATE_ASKING if _waits(frame) else RingEventKind.LATE_USE
                        self._late(what, no, frame, source, self._passed_by, gap)
                self._token = self._passed_by = None
            self._instead = header.destination if self._doubt and self._may_answer(frame, header) else None
            return
        if self._doubt and self._may_answer(frame, header):
            self._forget()
            return
        if source == self._instead:  # the token went that way in the octets before the answer
            self._forget()
            self._holder = source
            return
        if self._may_be_late(frame, header) or self._was_asked(no, frame, source, header):
            return
        if source == self._passed_by:  # nobody used it: it is repeated, or somebody else is looked for
            if not self._came_back(no, frame, source):
                self._take_back(no, frame, source, node)
            return
        if self._is_known_second(no, frame, source):
            return
        if self._holder is not None and not self._doubt and not self._may_begin_anew(frame):
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

    def _may_begin_anew(self, frame: Frame) -> bool:
        """Whether who sends may have made a token that was lost: a log without times does not show the silence."""
        return not self._tally.timing.has_times and makes_token(frame)

    def _came_back(self, no: int, frame: Frame, source: int) -> bool:
        """Whether the token was used unheard, and is back: its sender goes on sooner than it may repeat it."""
        token, holder = self._token, self._holder
        if token is None or holder is None or self._doubt or frame.octets == token.octets:
            return False
        if not self._tally.timing.has_times:
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

    def _may_answer(self, frame: Frame, header: Header) -> bool:
        """Whether it may be the answer to octets that are no good frame: then the one that asked has the token, else
        the one that sends. Nobody is known to have it."""
        alone = header.role is Role.REQUEST or frame.octets[2] in (_TOKEN, _POLL)
        return not alone and header.destination != BROADCAST

    def _may_be_late(self, frame: Frame, header: Header) -> bool:
        """Whether it answers what may have been octets that are no good frame: its asker may have given up since, and
        passed the token on."""
        if header.role is not Role.RESPONSE or self._damaged is None:
            return False
        return frame.start - self._damaged <= T_LATE_ANSWER

    def _answers_damaged(self, asked: AskedInRing, frame_type: int, header: Header) -> None:
        """An answer to a frame that is damaged, but for its header: it shows who has the token, where it is known
        which of both asked. An acknowledge may be for a segment, which is an answer itself."""
        if asked.free:
            self._hold_now(asked.destination)
        elif frame_type in AT_ONCE or header.role is Role.RESPONSE:
            self._hold_now(asked.source)
        else:
            self._forget()

    def _hold_now(self, asker: int) -> None:
        """Who asks, or asked in octets that are no good frame what comes at once or not at all, has the token."""
        if asker != self._holder:
            self._forget()
            self._holder = asker
        else:
            self._passed_by = self._token = None

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
        tally.enter(Happening.PASSED, no, source, destination)
        edge.last = target.last_token = frame.end
        if node.next != destination:
            node.next, edge.since, edge.streak = destination, frame.start, 0
        edge.streak += 1
        node.tokens_sent += 1
        end_search(tally, no, frame, source, node)
        again = (
            before is not None
            and source != destination  # who passes the token to itself uses it by doing so again
            and not self._doubt
            and before.octets[:HEADER] == frame.octets[:HEADER]
            and not is_too_soon(self._gap(frame), before.slack, self._turnaround)
        )
        if again and before is not None:
            self._repeated.repeat(destination, before.end)
            edge.retries += 1
            tally.enter(Happening.RETRY, no, source)
            tally.note(RingEventKind.RETRY, frame.start, no, destination, source, self._gap(frame))
        else:
            hold = min(self._hold, _HOLD_MAX)
            node.holds[hold] = node.holds.get(hold, 0) + 1
            target.tokens_received += 1
            loop = None if target.got is None else frame.end - target.got
            if loop is not None:
                target.loop.add(loop)
                tally.enter(Happening.LOOP, no, destination, loop)
            tally.enter(Happening.RECEIVED, no, destination)
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
        self._disturbed, self._instead = False, None

    def _late(self, what: RingEventKind, no: int, frame: Frame, mac: int, other: int | None, value: int) -> None:
        """Something was late, unless the next frame shows that the read was."""
        self._reads.add(RingEvent(what, frame.start, no, mac, other, value))

    def _gap(self, frame: Frame) -> int:
        return 0 if self._before is None else max(0, frame.start - self._before.end)

    def _silence(self, event: Event) -> int:
        """Before an event, ns; 0 where nobody knows when anything came: there it is only where octets were laid."""
        if self._quiet_since is None or not self._tally.timing.has_times:
            return 0
        return max(0, event.start - self._quiet_since)

    def _forget(self) -> None:
        self._questions.asked = None
        self._holder = self._passed_by = self._token = self._second.of = self._got = None
        self._hold, self._instead = 0, None
        self._unheard.forget()


def _waits(frame: Frame) -> bool:
    """Whether its sender waits for somebody then, so that the time to the next frame tells nothing."""
    return frame.octets[3] != BROADCAST and (frame.octets[2] in EXPECTING or frame.octets[2] in (_POLL, _TEST))
