"""Watches the frames of a bus and keeps the model of who has the token (ANSI/ASHRAE 135, 9.5.6, seen from outside).

The token is held by one station, or on its way to one that has not used it yet. A station may send when it holds it,
when the token is on its way to it, when it passed the token on and nobody used it, or when it was asked. Whoever sends
otherwise has a second token, unless the bus was silent for 500 ms before: then the token was lost and made anew.
After damage, noise or the begin of a capture nothing is concluded: a token may have passed unseen.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from dissectors.bacnet import message as messages
from dissectors.bacnet.frame_types import CARRIES_NPDU, EXPECTING, HEADER, PROPRIETARY, FrameType, is_encoded
from dissectors.bacnet.limits import (
    BROADCAST,
    MAX_DATA,
    MAX_MASTER,
    N_MIN_OCTETS,
    T_NO_TOKEN,
    T_REPLY_DELAY,
    T_USAGE_DELAY,
    T_USAGE_TIMEOUT,
    TURNAROUND_BITS,
)
from dissectors.bacnet.ring import EVENTS_MAX, Ring, What
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.bacnet.values import ObjectId
from dissectors.frame import Damage, Frame, Header, Noise, Role
from dissectors.frame import Event as FramerEvent
from dissectors.line import Timing

_HOLD_MAX = 64  # longest run of data frames that is counted by itself
_POSTPONED_MAX = 64
T_LATE_ANSWER = 2 * T_NO_TOKEN
"""An answer that comes after its asker gave up is still one within this time."""

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


@dataclass(slots=True)
class _Asked:
    """The frame that waits for its answer."""

    frame_type: int
    source: int
    destination: int
    frame: Frame
    no: int


class RingObserver:
    """Fed every event of a bus in order; gives the `Ring` at any time. Total."""

    def __init__(self, timing: Timing) -> None:
        self._tally = RingTally(timing)
        self._least_gap = timing.line.bits(TURNAROUND_BITS) // 2
        self._judges_use = 2 * timing.latency <= T_USAGE_DELAY  # whether the adapter's times can judge such limits
        self._judges_replies = 2 * timing.latency <= T_REPLY_DELAY
        self._holder: int | None = None  # None: not known
        self._passed_by: int | None = None  # who passed the token to the holder, while the holder has not used it
        self._token: Frame | None = None  # that token, while unused
        self._asked: _Asked | None = None
        self._hold = 0  # data frames sent on this token
        self._doubt = True  # something may have been missed since the last good frame
        self._before: Frame | None = None  # the last good frame
        self._quiet_since: int | None = None  # end of the last event of any kind
        self._missed: int | None = None  # where octets may be lost, until an event comes after it
        self._unanswered: _Asked | None = None  # the newest request that nobody answered in time
        self._postponed: deque[tuple[int, int, int]] = deque(maxlen=_POSTPONED_MAX)  # server, client, end of request

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
                if len(event.octets) >= N_MIN_OCTETS:  # fewer prove nothing: who was asked may still answer
                    self._see_collision(no, event)
                self._doubt = True
            else:
                self._see_hole(event.start)
        else:
            tally.frames += 1
            tally.octets += len(event.octets)
            if not event.ok and event.damage is not Damage.LONG:
                self._see_damage(no, event, header)
            elif header.source is not None and header.destination is not None and header.function is not None:
                self._see_good(no, event, header.function, header.source, header.destination, header)
                self._before = event
                self._doubt = False
        self._quiet_since = event.end

    def miss(self, time: int) -> None:
        """Say that octets may be lost about `time` (ns), before the next event that ends there or later."""
        self._missed = time

    def ring(self) -> Ring:
        """All that was seen so far."""
        return self._tally.value()

    # Holes, noise and damage

    def _see_hole(self, end: int) -> None:
        """No wait that began before it is measured to its end."""
        self._forget()
        self._missed, self._quiet_since = None, end
        self._unanswered = None
        self._postponed.clear()
        self._doubt = True
        for node in self._tally.nodes.values():
            node.got = None

    def _see_damage(self, no: int, frame: Frame, header: Header) -> None:
        if frame.damage is Damage.HEADER:
            self._tally.header_errors += 1
        elif frame.damage is Damage.CHECK:
            self._tally.data_errors += 1
        else:
            self._tally.cut += 1
        if frame.damage is Damage.CHECK and header.source is not None:
            node = self._tally.node(header.source)
            node.first = node.first or frame.start
            node.last = frame.end
            node.damaged += 1
        self._see_collision(no, frame)
        self._asked = None
        self._doubt = True

    def _see_collision(self, no: int, event: FramerEvent) -> None:
        """Damaged octets where a station was to answer a request or poll, or to use its token."""
        asked, token = self._asked, self._token
        if asked is not None:
            since, mac, other = asked.frame.end, asked.destination, asked.source
        elif token is not None and self._holder is not None:
            since, mac, other = token.end, self._holder, token.octets[4]
        else:
            return
        if event.start - since < T_REPLY_DELAY:
            self._tally.node(mac)
            self._tally.note(What.COLLIDED_REPLY, event.start, no, mac, other)
        self._asked = None

    # Good frames

    def _see_good(self, no: int, frame: Frame, frame_type: int, source: int, destination: int, header: Header) -> None:
        tally, before = self._tally, self._before
        node = tally.nodes.get(source) or tally.node(source)
        node.first = node.first or frame.start
        node.last = frame.end
        node.octets += len(frame.octets)
        if before is not None:
            if not self._doubt and max(0, frame.start - before.end) + before.slack < self._least_gap:
                tally.impossible += 1
            if self._silence(frame) - frame.slack >= T_NO_TOKEN:  # lost even by the smallest reading of the silence
                self._lose_token(no, frame, source)
        answers = self._asked is not None and self._is_answer(no, frame, frame_type, source, destination, node)
        self._check_addresses(no, frame, frame_type, source, destination)
        if not answers and self._unanswered is not None:
            answers = self._is_late_answer(no, frame, source, destination)
        if frame_type == _TOKEN:
            if not answers:
                self._take_turn(no, frame, source, node)
            self._pass_token(no, frame, source, destination, node)
        elif frame_type == _POLL:
            if not answers:
                self._take_turn(no, frame, source, node)
            self._poll(no, frame, source, destination, node)
        elif frame_type == _POLL_REPLY:
            node.poll_replies_sent += 1
            if node.gone:
                tally.note(What.REJOINED, frame.start, no, source, destination)
                node.gone = False
        elif frame_type == _POSTPONED:
            node.postponed += 1
        elif frame_type != _TEST_REPLY:
            if not answers:
                self._take_turn(no, frame, source, node)
            if frame_type == _TEST:
                self._asked = _Asked(frame_type, source, destination, frame, no)
            elif frame_type in CARRIES_NPDU or frame_type >= PROPRIETARY:
                self._see_data(no, frame, frame_type, source, destination, node, answers, header)

    def _poll(self, no: int, frame: Frame, source: int, destination: int, node: NodeTally) -> None:
        node.polls_sent += 1
        if node.searches or not node.tokens_sent:
            node.polls_of_search += 1
        if node.highest_polled < destination <= MAX_MASTER:
            node.highest_polled = destination
        self._asked = _Asked(_POLL, source, destination, frame, no)
        polled = self._tally.nodes.get(destination)
        if polled is not None:
            polled.polls_received += 1

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
        if not answers:
            self._hold += 1
            self._end_postponed(frame, source, destination, node)
        if frame_type in EXPECTING and not answers:
            if destination == BROADCAST:
                self._tally.note(What.BROADCAST_REQUEST, frame.start, no, source)
            elif header.role is Role.REQUEST:  # answers and what is unconfirmed ask for nothing, whatever the type says
                node.requests_sent += 1
                self._tally.node(destination).requests_received += 1
                self._asked = _Asked(frame_type, source, destination, frame, no)
        if header.kind == "i-am":
            self._see_i_am(no, frame, source, node)

    def _see_i_am(self, no: int, frame: Frame, source: int, node: NodeTally) -> None:
        """Two devices that say I-Am from one address share it; those behind a router do not count."""
        message = messages.read(frame)
        if message is None or message.npdu is None or message.apdu is None or message.npdu.snet is not None:
            return
        if message.parameters[:1] != b"\xc4" or len(message.parameters) < 5:
            return
        instance = ObjectId.unpack(message.parameters[1:5]).instance
        if instance in node.devices or len(node.devices) >= EVENTS_MAX:
            return
        node.devices.append(instance)
        if len(node.devices) > 1:
            self._tally.note(What.SECOND_DEVICE, frame.start, no, source, None, instance)

    # Who may send

    def _is_answer(
        self, no: int, frame: Frame, frame_type: int, source: int, destination: int, node: NodeTally
    ) -> bool:
        """Close what waits for an answer; say whether this is it."""
        asked, self._asked = self._asked, None
        if asked is None:
            return False
        back = source == asked.destination and destination == asked.source
        if asked.frame_type == _POLL:
            if back and frame_type == _POLL_REPLY:
                node.poll_reply.add(frame.start - asked.frame.end)
                if self._judges_use and self._surely_over(frame, asked.frame, T_USAGE_DELAY):
                    self._tally.note(
                        What.LATE_POLL_REPLY, frame.start, no, source, destination, frame.start - asked.frame.end
                    )
                return True
            self._unanswered_poll(frame, asked)
            soon = frame.start - asked.frame.end + asked.frame.slack < T_USAGE_DELAY // 2
            if soon and source == asked.source and not self._doubt and self._judges_use:
                self._tally.note(
                    What.TOO_SOON, frame.start, no, source, asked.destination, frame.start - asked.frame.end
                )
            return False
        if asked.frame_type == _TEST:
            return back and frame_type == _TEST_REPLY
        answered = back and frame_type not in (_TOKEN, _POLL, _POLL_REPLY, _TEST)
        if not answered:
            self._unanswered_request(asked)
            return False
        node.replies += 1
        node.reply.add(frame.start - asked.frame.end)
        if self._judges_replies and self._surely_over(frame, asked.frame, T_REPLY_DELAY):
            self._tally.note(What.LATE_REPLY, frame.start, no, source, destination, frame.start - asked.frame.end)
        if frame_type == _POSTPONED:
            self._postponed.append((source, destination, asked.frame.end))
        return True

    def _unanswered_request(self, asked: _Asked) -> None:
        self._unanswered = asked
        if not self._doubt and not messages.more_follows(asked.frame):
            self._tally.note(What.NO_REPLY, asked.frame.end, asked.no, asked.destination, asked.source)

    def _is_late_answer(self, no: int, frame: Frame, source: int, destination: int) -> bool:
        """Data to the one that asked and has given up: late, but no second token."""
        asked = self._unanswered
        if asked is None or (source, destination) != (asked.destination, asked.source) or source == self._holder:
            return False
        if frame.octets[2] not in CARRIES_NPDU or frame.start - asked.frame.end > T_LATE_ANSWER:
            return False
        self._unanswered = None
        self._tally.note(What.LATE_REPLY, frame.start, no, source, destination, frame.start - asked.frame.end)
        return True

    def _lose_token(self, no: int, frame: Frame, source: int) -> None:
        asked = self._asked
        if asked is not None and asked.frame_type == _POLL:
            self._unanswered_poll(frame, asked)
        elif asked is not None and asked.frame_type != _TEST:
            self._unanswered_request(asked)
        self._tally.note(What.LOST_TOKEN, frame.start, no, self._holder, source, self._silence(frame))
        self._forget()

    def _unanswered_poll(self, frame: Frame, asked: _Asked) -> None:
        self._tally.poll_waste += max(0, min(frame.start - asked.frame.start, T_NO_TOKEN))
        self._tally.node(asked.source).polls_unanswered += 1

    def _end_postponed(self, frame: Frame, source: int, destination: int, node: NodeTally) -> None:
        for waiting in self._postponed:
            server, client, asked_at = waiting
            if server == source and client == destination:
                node.service.add(frame.start - asked_at)
                self._postponed.remove(waiting)
                return

    def _take_turn(self, no: int, frame: Frame, source: int, node: NodeTally) -> None:
        """A frame that only the holder of the token may send."""
        if source == self._holder:
            if self._token is not None:  # its first frame with this token, or the first that was not damaged
                gap = frame.start - self._token.end
                if not self._doubt:
                    node.use.add(gap)
                    if self._judges_use and self._surely_over(frame, self._token, T_USAGE_DELAY):
                        self._tally.note(What.LATE_USE, frame.start, no, source, self._passed_by, gap)
                self._token = self._passed_by = None
            return
        if source == self._passed_by:  # nobody used it: it is repeated, or somebody else is looked for
            if self._holder is not None and frame.octets[2] == _POLL:
                self._tally.note(What.LEFT, frame.start, no, self._holder, source)
                self._tally.node(self._holder).gone = True
                node.searches = True
            self._holder = source
            self._passed_by = None
            return
        if self._holder is not None and not self._doubt:
            self._tally.note(What.TWO_TOKENS, frame.start, no, source, self._holder)
        self._forget()
        self._holder = source

    def _pass_token(self, no: int, frame: Frame, source: int, destination: int, node: NodeTally) -> None:
        tally, before = self._tally, self._before
        edge = tally.edges.get((source, destination)) or tally.edge(source, destination)
        target = tally.nodes.get(destination) or tally.node(destination)
        edge.tokens += 1
        edge.last = target.last_token = frame.end
        node.tokens_sent += 1
        node.searches = False
        if (
            before is not None
            and not self._doubt
            and before.octets[:HEADER] == frame.octets[:HEADER]
            and self._gap(frame) + before.slack >= T_USAGE_TIMEOUT // 2
        ):
            edge.retries += 1
            tally.note(What.RETRY, frame.start, no, destination, source, self._gap(frame))
        else:
            hold = min(self._hold, _HOLD_MAX)
            node.holds[hold] = node.holds.get(hold, 0) + 1
            target.tokens_received += 1
            if target.got is not None:
                target.loop.add(frame.end - target.got)
            target.got = frame.end
        self._hold = 0
        if source == destination:
            tally.note(What.SELF_TOKEN, frame.start, no, source)
        self._holder, self._passed_by, self._token = destination, source, frame

    def _check_addresses(self, no: int, frame: Frame, frame_type: int, source: int, destination: int) -> None:
        length = frame.octets[5] << 8 | frame.octets[6]
        illegal = source == BROADCAST
        if frame_type <= _POLL and (source > MAX_MASTER or destination > MAX_MASTER):
            illegal = True
        if illegal or (length > MAX_DATA and not is_encoded(frame_type)):
            self._tally.note(What.ILLEGAL, frame.start, no, source, destination, length)

    # Times

    def _gap(self, frame: Frame) -> int:
        return 0 if self._before is None else max(0, frame.start - self._before.end)

    def _silence(self, event: FramerEvent) -> int:
        return 0 if self._quiet_since is None else max(0, event.start - self._quiet_since)

    def _surely_over(self, frame: Frame, before: Frame, limit: int) -> bool:
        """Whether the time between two frames is over a limit by its smallest reading."""
        return frame.start - frame.slack - before.end > limit

    def _forget(self) -> None:
        self._holder = self._passed_by = self._token = self._asked = None
        self._hold = 0
