"""Watches the frames of a bus and keeps the model of who has the token (ANSI/ASHRAE 135, 9.5.6, seen from outside).

The token is held by one station, or on its way to one that has not used it yet. A station may send when it holds it,
when the token is on its way to it, when it passed the token on and nobody used it, or when it was asked. Whoever sends
otherwise has a second token, unless the bus was silent for 500 ms before: then the token was lost and made anew.
After damage, noise or the begin of a capture nothing is concluded: a token may have passed unseen.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from types import MappingProxyType

from dissectors.bacnet import message as messages
from dissectors.bacnet.durations import DurationTally
from dissectors.bacnet.frame_types import CARRIES_NPDU, EXPECTING, FrameType, is_encoded
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
from dissectors.bacnet.ring import EVENTS_MAX, Edge, Event, Happened, Node, Ring, What
from dissectors.bacnet.values import ObjectId
from dissectors.frame import Damage, Frame, Header, Noise
from dissectors.frame import Event as FramerEvent
from dissectors.line import Timing

_HOLD_MAX = 64  # longest run of data frames that is counted by itself
_POSTPONED_MAX = 64
T_LATE_ANSWER = 2 * T_NO_TOKEN
"""An answer that comes after its asker gave up is still one within this time."""

_TOKEN, _POLL = FrameType.TOKEN, FrameType.POLL_FOR_MASTER
_POLL_REPLY, _TEST, _TEST_REPLY = FrameType.REPLY_TO_POLL_FOR_MASTER, FrameType.TEST_REQUEST, FrameType.TEST_RESPONSE
_POSTPONED = FrameType.REPLY_POSTPONED


@dataclass(slots=True)
class _Node:
    counts: dict[str, int] = field(default_factory=dict)
    highest_polled: int = -1
    first: int = 0
    last: int = 0
    last_token: int = 0
    got: int | None = None  # when it last got the token
    use: DurationTally = field(default_factory=DurationTally)
    loop: DurationTally = field(default_factory=DurationTally)
    reply: DurationTally = field(default_factory=DurationTally)
    service: DurationTally = field(default_factory=DurationTally)
    poll_reply: DurationTally = field(default_factory=DurationTally)
    holds: dict[int, int] = field(default_factory=dict)
    devices: list[int] = field(default_factory=list)
    gone: bool = False  # it was passed over

    def count(self, name: str) -> None:
        self.counts[name] = self.counts.get(name, 0) + 1

    def value(self) -> Node:
        return Node(
            **self.counts,
            highest_polled=self.highest_polled,
            first=self.first,
            last=self.last,
            last_token=self.last_token,
            use=self.use.value(),
            loop=self.loop.value(),
            reply=self.reply.value(),
            service=self.service.value(),
            poll_reply=self.poll_reply.value(),
            holds=MappingProxyType(dict(self.holds)),
            devices=tuple(self.devices),
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
        self._timing = timing
        self._nodes: dict[int, _Node] = {}
        self._edges: dict[tuple[int, int], Edge] = {}
        self._happened: dict[tuple[What, int | None], Happened] = {}
        self._first: int | None = None
        self._last: int | None = None
        self._frames = self._octets = self._noise = 0
        self._header_errors = self._data_errors = self._cut = 0
        self._poll_waste = self._impossible = 0
        self._least_gap = timing.line.bits(TURNAROUND_BITS) // 2
        self._holder: int | None = None  # None: not known
        self._passed_by: int | None = None  # who passed the token to the holder, while the holder has not used it
        self._token: Frame | None = None  # that token, while unused
        self._asked: _Asked | None = None
        self._hold = 0  # data frames sent on this token
        self._doubt = True  # something may have been missed since the last good frame
        self._before: Frame | None = None  # the last good frame
        self._quiet_since: int | None = None  # end of the last event of any kind
        self._unanswered: _Asked | None = None  # the newest request that nobody answered in time
        self._postponed: deque[tuple[int, int, int]] = deque(maxlen=_POSTPONED_MAX)  # server, client, end of request

    def see(self, no: int, event: FramerEvent, header: Header | None) -> None:
        """Take the next event; `header` is None for noise."""
        if self._first is None:
            self._first = event.start
        self._last = event.end if self._last is None else max(self._last, event.end)
        self._see(no, event, header)
        self._quiet_since = event.end

    def _see(self, no: int, event: FramerEvent, header: Header | None) -> None:
        if isinstance(event, Noise) or header is None:
            self._noise += len(event.octets)
            if len(event.octets) >= N_MIN_OCTETS:  # fewer prove nothing: who was asked may still answer
                self._see_collision(no, event)
            self._doubt = True
            return
        self._frames += 1
        self._octets += len(event.octets)
        if not event.ok and event.damage is not Damage.LONG:
            self._see_damage(no, event, header)
            return
        if header.source is None or header.destination is None or header.function is None:
            return
        self._see_good(no, event, header.function, header.source, header.destination, header)
        self._before = event
        self._doubt = False

    def ring(self) -> Ring:
        """All that was seen so far."""
        return Ring(
            self._timing,
            self._first,
            self._last,
            self._frames,
            self._octets,
            self._noise,
            self._header_errors,
            self._data_errors,
            self._cut,
            self._poll_waste,
            self._impossible,
            MappingProxyType({mac: node.value() for mac, node in sorted(self._nodes.items())}),
            MappingProxyType(dict(self._edges)),
            MappingProxyType(dict(self._happened)),
        )

    # Damage

    def _see_damage(self, no: int, frame: Frame, header: Header) -> None:
        if frame.damage is Damage.HEADER:
            self._header_errors += 1
        elif frame.damage is Damage.CHECK:
            self._data_errors += 1
        else:
            self._cut += 1
        if frame.damage is Damage.CHECK and header.source is not None:
            self._node(header.source, frame).count("damaged")
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
            self._node(mac, None)
            self._note(What.COLLIDED_REPLY, event.start, no, mac, other)
        self._asked = None

    # Good frames

    def _see_good(self, no: int, frame: Frame, frame_type: int, source: int, destination: int, header: Header) -> None:
        node = self._node(source, frame)
        before = self._before
        if before is not None and not self._doubt and self._gap(frame) + before.slack < self._least_gap:
            self._impossible += 1
        node.counts["octets"] = node.counts.get("octets", 0) + len(frame.octets)
        if self._is_silence(frame):
            self._lose_token(no, frame, source)
        answers = self._is_answer(no, frame, frame_type, source, destination, node)
        self._check_addresses(no, frame, frame_type, source, destination)
        if frame_type == _POLL_REPLY:
            node.count("poll_replies_sent")
            if node.gone:
                self._note(What.REJOINED, frame.start, no, source, destination)
                node.gone = False
        elif frame_type == _POSTPONED:
            node.count("postponed")
        if not answers and self._is_late_answer(no, frame, source, destination):
            answers = True
        if not answers and frame_type not in (_POLL_REPLY, _TEST_REPLY, _POSTPONED):
            self._take_turn(no, frame, source, node)
        if frame_type == _TOKEN:
            self._pass_token(no, frame, source, destination, node)
        elif frame_type == _POLL:
            node.count("polls_sent")
            if "tokens_sent" not in node.counts:
                node.count("polls_before_token")
            if destination <= MAX_MASTER:
                node.highest_polled = max(node.highest_polled, destination)
            self._asked = _Asked(frame_type, source, destination, frame, no)
            if destination in self._nodes:
                self._nodes[destination].count("polls_received")
        elif frame_type == _TEST:
            self._asked = _Asked(frame_type, source, destination, frame, no)
        elif frame_type in CARRIES_NPDU or frame_type >= 128:
            self._see_data(no, frame, frame_type, source, destination, node, answers, header)

    def _see_data(
        self,
        no: int,
        frame: Frame,
        frame_type: int,
        source: int,
        destination: int,
        node: _Node,
        answers: bool,
        header: Header,
    ) -> None:
        node.count("data_sent")
        if not answers:
            self._hold += 1
            self._end_postponed(frame, source, destination, node)
        if frame_type in EXPECTING and not answers:
            if destination == BROADCAST:
                self._note(What.BROADCAST_REQUEST, frame.start, no, source)
            else:
                node.count("requests_sent")
                self._node(destination, None).count("requests_received")
                self._asked = _Asked(frame_type, source, destination, frame, no)
        if header.kind == "i-am":
            self._see_i_am(no, frame, source, node)

    def _see_i_am(self, no: int, frame: Frame, source: int, node: _Node) -> None:
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
            self._note(What.SECOND_DEVICE, frame.start, no, source, None, instance)

    # Who may send

    def _is_answer(self, no: int, frame: Frame, frame_type: int, source: int, destination: int, node: _Node) -> bool:
        """Close what waits for an answer; say whether this is it."""
        asked, self._asked = self._asked, None
        if asked is None:
            return False
        back = source == asked.destination and destination == asked.source
        if asked.frame_type == _POLL:
            if back and frame_type == _POLL_REPLY:
                node.poll_reply.add(frame.start - asked.frame.end)
                if self._surely_over(frame, asked.frame, T_USAGE_DELAY):
                    self._note(
                        What.LATE_POLL_REPLY, frame.start, no, source, destination, frame.start - asked.frame.end
                    )
                return True
            self._unanswered_poll(frame, asked)
            soon = frame.start - asked.frame.end + asked.frame.slack < T_USAGE_DELAY // 2
            if soon and source == asked.source and not self._doubt and 2 * self._timing.latency <= T_USAGE_DELAY:
                self._note(What.TOO_SOON, frame.start, no, source, asked.destination, frame.start - asked.frame.end)
            return False
        if asked.frame_type == _TEST:
            return back and frame_type == _TEST_REPLY
        answered = back and frame_type not in (_TOKEN, _POLL, _POLL_REPLY, _TEST)
        if not answered:
            self._unanswered_request(asked)
            return False
        node.count("replies")
        node.reply.add(frame.start - asked.frame.end)
        if self._surely_over(frame, asked.frame, T_REPLY_DELAY):
            self._note(What.LATE_REPLY, frame.start, no, source, destination, frame.start - asked.frame.end)
        if frame_type == _POSTPONED:
            self._postponed.append((source, destination, asked.frame.end))
        return True

    def _unanswered_request(self, asked: _Asked) -> None:
        self._unanswered = asked
        if not self._doubt:
            self._note(What.NO_REPLY, asked.frame.end, asked.no, asked.destination, asked.source)

    def _is_late_answer(self, no: int, frame: Frame, source: int, destination: int) -> bool:
        """Data to the one that asked and has given up: late, but no second token."""
        asked = self._unanswered
        if asked is None or (source, destination) != (asked.destination, asked.source) or source == self._holder:
            return False
        if frame.octets[2] not in CARRIES_NPDU or frame.start - asked.frame.end > T_LATE_ANSWER:
            return False
        self._unanswered = None
        self._note(What.LATE_REPLY, frame.start, no, source, destination, frame.start - asked.frame.end)
        return True

    def _lose_token(self, no: int, frame: Frame, source: int) -> None:
        asked = self._asked
        if asked is not None and asked.frame_type == _POLL:
            self._unanswered_poll(frame, asked)
        elif asked is not None and asked.frame_type != _TEST:
            self._unanswered_request(asked)
        self._note(What.LOST_TOKEN, frame.start, no, self._holder, source, self._silence(frame))
        self._forget()

    def _unanswered_poll(self, frame: Frame, asked: _Asked) -> None:
        self._poll_waste += max(0, min(frame.start - asked.frame.start, T_NO_TOKEN))
        self._node(asked.source, None).count("polls_unanswered")

    def _end_postponed(self, frame: Frame, source: int, destination: int, node: _Node) -> None:
        for waiting in self._postponed:
            server, client, asked_at = waiting
            if server == source and client == destination:
                node.service.add(frame.start - asked_at)
                self._postponed.remove(waiting)
                return

    def _take_turn(self, no: int, frame: Frame, source: int, node: _Node) -> None:
        """A frame that only the holder of the token may send."""
        if source == self._holder:
            if self._token is not None:  # its first frame with this token, or the first that was not damaged
                gap = frame.start - self._token.end
                if not self._doubt:
                    node.use.add(gap)
                if not self._doubt and self._surely_over(frame, self._token, T_USAGE_DELAY):
                    self._note(What.LATE_USE, frame.start, no, source, self._passed_by, gap)
                self._token = self._passed_by = None
            return
        if source == self._passed_by:  # nobody used it: it is repeated, or somebody else is looked for
            if self._holder is not None and frame.octets[2] == _POLL:
                self._note(What.LEFT, frame.start, no, self._holder, source)
                self._node(self._holder, None).gone = True
            self._holder = source
            self._passed_by = None
            return
        if self._holder is not None and not self._doubt:
            self._note(What.TWO_TOKENS, frame.start, no, source, self._holder)
        self._forget()
        self._holder = source

    def _pass_token(self, no: int, frame: Frame, source: int, destination: int, node: _Node) -> None:
        edge = self._edges.get((source, destination), Edge())
        before = self._before
        retry = (
            before is not None
            and not self._doubt
            and before.octets[:8] == frame.octets[:8]
            and self._gap(frame) + before.slack >= T_USAGE_TIMEOUT // 2
        )
        self._edges[source, destination] = Edge(edge.tokens + 1, edge.retries + retry, frame.end)
        node.count("tokens_sent")
        if not retry:
            node.holds[min(self._hold, _HOLD_MAX)] = node.holds.get(min(self._hold, _HOLD_MAX), 0) + 1
        self._hold = 0
        target = self._node(destination, None)
        if retry:
            self._note(What.RETRY, frame.start, no, destination, source, self._gap(frame))
        else:
            target.count("tokens_received")
            if target.got is not None:
                target.loop.add(frame.end - target.got)
            target.got = frame.end
        target.last_token = frame.end
        if source == destination:
            self._note(What.SELF_TOKEN, frame.start, no, source)
        self._holder, self._passed_by, self._token = destination, source, frame

    def _check_addresses(self, no: int, frame: Frame, frame_type: int, source: int, destination: int) -> None:
        illegal = source == BROADCAST or (frame_type in (_TOKEN, _POLL) and max(source, destination) > MAX_MASTER)
        length = frame.octets[5] << 8 | frame.octets[6]
        if illegal or (length > MAX_DATA and not is_encoded(frame_type)):
            self._note(What.ILLEGAL, frame.start, no, source, destination, length)

    # Times

    def _gap(self, frame: Frame) -> int:
        return 0 if self._before is None else max(0, frame.start - self._before.end)

    def _is_silence(self, frame: Frame) -> bool:
        """Whether the token was lost before this frame, even by the smallest reading of the silence."""
        return self._before is not None and self._silence(frame) - frame.slack >= T_NO_TOKEN

    def _silence(self, frame: Frame) -> int:
        return 0 if self._quiet_since is None else max(0, frame.start - self._quiet_since)

    def _surely_over(self, frame: Frame, before: Frame, limit: int) -> bool:
        measurable = 2 * self._timing.latency <= limit
        return measurable and frame.start - frame.slack - before.end > limit

    def _forget(self) -> None:
        self._holder = self._passed_by = self._token = self._asked = None
        self._hold = 0

    def _node(self, mac: int, frame: Frame | None) -> _Node:
        node = self._nodes.get(mac)
        if node is None:
            node = self._nodes[mac] = _Node()
            if frame is not None:
                node.first = frame.start
        if frame is not None:
            node.first = node.first or frame.start
            node.last = frame.end
        return node

    def _note(
        self, what: What, time: int, no: int, mac: int | None, other: int | None = None, value: int | None = None
    ) -> None:
        key = (what, mac)
        self._happened[key] = self._happened.get(key, Happened()).add(Event(what, time, no, mac, other, value))
