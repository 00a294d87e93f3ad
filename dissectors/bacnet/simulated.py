"""Simulated MS/TP nodes as stations of a virtual bus (dissectors/simulated.py): pure, a clock only in what is told.

`SimulatedNode` is a master: it passes the token, polls for masters, answers, and makes a new token when it was lost
(ANSI/ASHRAE 135, 9.5.6). What it does with data is its application's affair (application.py; f510.py is a drive).
`Faults` make it misbehave on purpose.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum, auto
from functools import lru_cache

from dissectors.bacnet.application import Application, Device, Outgoing, Poller, Quiet
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.f510 import f510
from dissectors.bacnet.frame_types import CARRIES_NPDU, EXPECTING, HEADER, FrameType, data_length, total
from dissectors.bacnet.framing import MstpFramer, body_is_good, header_is_good
from dissectors.bacnet.limits import (
    BROADCAST,
    MAX_MASTER,
    N_MIN_OCTETS,
    N_POLL,
    N_RETRY_TOKEN,
    T_NO_TOKEN,
    T_REPLY_TIMEOUT_MAX,
    T_SLOT,
    T_USAGE_TIMEOUT_MAX,
    TURNAROUND_BITS,
)
from dissectors.bacnet.message import data_of
from dissectors.frame import Chunk, Frame
from dissectors.line import Timing
from dissectors.simulated import Send

__all__ = ["Device", "Faults", "Poller", "SimulatedNode", "f510"]

_QUEUE_MAX = 64


@dataclass(frozen=True, slots=True)
class Faults:
    """What a node does wrong.

    `off`: nothing at all. `deaf`: hears nothing, but sends. `loses_token_every`: begins to use each n-th token and dies
    with it (0: none). `use_delay`, `reply_delay`: ns that it takes before it uses a token or answers. `postpones`:
    answers requests with Reply Postponed and sends the answer with its next token. `silent`: does not answer requests.
    `forges_every`: passes a token that it does not have while another one waits, at each n-th poll heard (0: never).
    `damages_every`: one bit of each n-th frame is wrong.
    """

    off: bool = False
    deaf: bool = False
    loses_token_every: int = 0
    use_delay: int = 0
    reply_delay: int = 0
    postpones: bool = False
    silent: bool = False
    forges_every: int = 0
    damages_every: int = 0


class _State(Enum):
    IDLE = auto()
    PASSED = auto()  # the token is on its way; nobody has used it yet
    POLLING = auto()  # waits for a Reply To Poll For Master
    ASKING = auto()  # waits for an answer


class SimulatedNode:
    """One master on the bus.

    `mac` 0 … 127. `max_info_frames`: data frames a token. `polls_every`: tokens from poll to poll. `begins_at`: ns,
    when it is switched on.
    """

    def __init__(
        self,
        mac: int,
        timing: Timing,
        application: Application | None = None,
        *,
        max_master: int = MAX_MASTER,
        max_info_frames: int = 1,
        polls_every: int = N_POLL,
        begins_at: int = 0,
        faults: Faults | None = None,
    ) -> None:
        self.mac = mac
        self.application: Application = Quiet() if application is None else application
        self.faults = Faults() if faults is None else faults
        self._timing = timing
        self._turnaround = timing.line.bits(TURNAROUND_BITS)
        # A station hears a burst when it has ended: the longest of 20 … 35 ms, and at low speed time for a short frame.
        self._usage_timeout = max(T_USAGE_TIMEOUT_MAX - 1_000_000, 64 * timing.char + self._turnaround)
        self._max_master = max_master
        self._max_info_frames = max_info_frames
        self._queue: deque[Outgoing] = deque(maxlen=_QUEUE_MAX)
        self._state = _State.IDLE
        self._next = mac  # the successor; the own address: not known
        self._polled = mac  # the last address polled
        self._polls_every = max(2, polls_every)
        self._tokens = self._polls_every  # since the last maintenance poll: the first token polls
        self._sole = False
        self._retries = 0
        self._sent = 0  # data frames with this token
        self._asked: int | None = None  # who must answer
        self._held = 0  # tokens ever got
        self._polls_heard = 0  # for others
        self._made = 0  # frames ever sent
        self._wake_at: int | None = begins_at + T_NO_TOKEN + T_SLOT * mac
        self._busy_until = begins_at

    # The station protocol

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Take what another party sent."""
        if self.faults.off:
            self._rest(now)
            return ()
        if self.faults.deaf or now < self._busy_until:
            return ()
        sends: list[Send] = []
        if self._state in (_State.IDLE, _State.PASSED) and len(octets) >= N_MIN_OCTETS:
            self._rest(now)  # somebody uses the token
        for good in _frames(octets, now, self._timing):
            sends += self._receive(now, good)
        if self._state is _State.IDLE and not sends:
            self._rest(now)
        return tuple(sends)

    def wake(self, now: int) -> tuple[Send, ...]:
        """A time that was waited for has come."""
        if self._wake_at is None or now < self._wake_at:
            return ()
        if self.faults.off:
            self._rest(now)
            return ()
        state = self._state
        if state is _State.IDLE:  # nobody has the token
            return tuple(self._make_token(now))
        if state is _State.PASSED:
            if self._retries < N_RETRY_TOKEN:
                self._retries += 1
                return tuple(self._pass_token(now, again=True))
            self._polled, successor = self._next, self._next
            self._next = self.mac
            return tuple(self._poll(now, (successor + 1) % (self._max_master + 1)))
        if state is _State.POLLING:
            return tuple(self._poll_unanswered(now))
        self._sent = self._max_info_frames
        return tuple(self._finish(now))

    def next_wake(self) -> int | None:
        """When to wake it."""
        return self._wake_at

    # Receiving

    def _receive(self, now: int, octets: bytes) -> list[Send]:
        frame_type, destination, source = octets[2], octets[3], octets[4]
        if self._state is _State.ASKING:
            if source == self._asked and destination == self.mac and frame_type in _ANSWERS:
                self._asked = None
                if frame_type in CARRIES_NPDU:
                    self._queue.extend(self.application.hear(source, data_of(octets) or b""))
                return self._work(now + self._turnaround)
            self._rest(now)
        elif self._state is _State.POLLING:
            if frame_type == FrameType.REPLY_TO_POLL_FOR_MASTER and destination == self.mac:
                self._next, self._polled, self._tokens, self._sole = source, self.mac, 1, False
                return self._pass_token(now + self._turnaround)
            self._rest(now)
        if destination not in (self.mac, BROADCAST):
            return self._forge(now) if frame_type == FrameType.POLL_FOR_MASTER else []
        return self._respond(now, frame_type, destination, source, octets)

    def _forge(self, now: int) -> list[Send]:
        self._polls_heard += 1
        every = self.faults.forges_every
        if not every or self._polls_heard % every or self._next == self.mac:
            return []
        return self._pass_token(now + 4 * self._turnaround)

    def _respond(self, now: int, frame_type: int, destination: int, source: int, octets: bytes) -> list[Send]:
        """A frame for this node."""
        at = now + self._turnaround
        data = data_of(octets) or b""
        if frame_type in CARRIES_NPDU and (destination == BROADCAST or frame_type not in EXPECTING):
            self._queue.extend(self.application.hear(source, data))
            return []
        if destination == BROADCAST:
            return []
        if frame_type == FrameType.TOKEN:
            return self._use_token(now)
        if frame_type == FrameType.POLL_FOR_MASTER:
            return [self._send(at, frame(FrameType.REPLY_TO_POLL_FOR_MASTER, source, self.mac))]
        if frame_type == FrameType.TEST_REQUEST:
            return [self._send(at, frame(FrameType.TEST_RESPONSE, source, self.mac, data))]
        if frame_type in EXPECTING:
            return self._answer(at, source, data)
        return []

    def _answer(self, at: int, source: int, data: bytes) -> list[Send]:
        reply = None if self.faults.silent else self.application.answer(source, data)
        if reply is None:
            return []
        at += self.faults.reply_delay
        if self.faults.postpones:
            self._queue.append(Outgoing(source, reply))
            return [self._send(at, frame(FrameType.REPLY_POSTPONED, source, self.mac))]
        return [self._send(at, npdu_frame(source, self.mac, reply, expects_reply=False))]

    # The token

    def _use_token(self, now: int) -> list[Send]:
        self._held += 1
        self._sole = False
        faults = self.faults
        if faults.loses_token_every and self._held % faults.loses_token_every == 0:
            self._rest(now)
            poll = frame(FrameType.POLL_FOR_MASTER, self._after(self.mac), self.mac)
            return [self._send(now + self._turnaround, poll)]
        self._sent = 0
        self._queue.extend(self.application.on_token(now))
        return self._work(now + self._turnaround + faults.use_delay)

    def _work(self, at: int) -> list[Send]:
        """Send what is queued, from `at` on, then pass the token."""
        sends: list[Send] = []
        while self._queue and self._sent < self._max_info_frames:
            item = self._queue.popleft()
            self._sent += 1
            expects = item.expects_reply and item.destination != BROADCAST
            sends.append(self._send(at, npdu_frame(item.destination, self.mac, item.npdu, expects)))
            at = self._busy_until
            if expects:
                self._state, self._asked = _State.ASKING, item.destination
                self._wake_at = at + T_REPLY_TIMEOUT_MAX
                return sends
            at += self._turnaround
        return sends + self._finish(at)

    def _finish(self, at: int) -> list[Send]:
        """Done with the token: poll for a master now and then, else pass it on."""
        if self._next == self.mac:  # no successor known, or none there
            return self._poll(at, self._after(self._polled))
        if self._tokens >= self._polls_every - 1:
            address = self._after(self._polled)
            if address != self._next:
                return self._poll(at, address)
            self._polled, self._tokens = self.mac, 0
        self._tokens += 1
        return self._pass_token(at)

    def _after(self, address: int) -> int:
        return (address + 1) % (self._max_master + 1)

    def _pass_token(self, at: int, again: bool = False) -> list[Send]:
        if not again:
            self._retries = 0
        sent = self._send(at, frame(FrameType.TOKEN, self._next, self.mac))
        self._state, self._wake_at = _State.PASSED, self._busy_until + self._usage_timeout
        return [sent]

    def _poll(self, at: int, address: int) -> list[Send]:
        if address == self.mac:  # everybody else was polled
            self._sole, self._polled = True, self.mac
            address = self._after(self.mac)
        self._polled = address
        sent = self._send(at, frame(FrameType.POLL_FOR_MASTER, address, self.mac))
        self._state, self._wake_at = _State.POLLING, self._busy_until + self._usage_timeout
        return [sent]

    def _poll_unanswered(self, now: int) -> list[Send]:
        if self._next != self.mac:  # one maintenance poll, then on with the token
            self._tokens = 1
            return self._pass_token(now)
        if self._sole:
            self._sent = 0
            self._queue.extend(self.application.on_token(now))
            return self._work(now)
        return self._poll(now, self._after(self._polled))

    def _make_token(self, now: int) -> list[Send]:
        self._next, self._sole, self._tokens = self.mac, False, 0
        return self._poll(now, self._after(self.mac))

    # Sending and resting

    def _send(self, at: int, octets: bytes) -> Send:
        at = max(at, self._busy_until)
        self._made += 1
        every = self.faults.damages_every
        if every and self._made % every == 0:
            octets = octets[:-1] + bytes((octets[-1] ^ 0x10,))
        self._busy_until = at + len(octets) * self._timing.char
        if self._state is _State.IDLE:
            self._wake_at = self._busy_until + T_NO_TOKEN + T_SLOT * self.mac
        return Send(at, octets)

    def _rest(self, now: int) -> None:
        self._state, self._asked = _State.IDLE, None
        self._wake_at = max(now, self._busy_until) + T_NO_TOKEN + T_SLOT * self.mac


def _frames(octets: bytes, now: int, timing: Timing) -> list[bytes]:
    """The good frames in a burst."""
    if _is_one_good(octets):
        return [octets]
    framer = MstpFramer(timing)
    events = framer.feed(Chunk(now, octets)) + framer.close()
    return [event.octets for event in events if isinstance(event, Frame) and event.ok]


@lru_cache(maxsize=1024)  # every node hears every burst, and most of a ring are tokens
def _is_one_good(octets: bytes) -> bool:
    if not header_is_good(octets):
        return False
    length = data_length(octets)
    return len(octets) == total(length) and body_is_good(octets[2], length, octets[HEADER:])


_ANSWERS = frozenset((*CARRIES_NPDU, FrameType.TEST_RESPONSE, FrameType.REPLY_POSTPONED))
