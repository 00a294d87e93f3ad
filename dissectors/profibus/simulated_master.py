"""A simulated DP master of class 1 in a ring of masters: a pure station of a virtual bus (dissectors/simulated.py).

    token heard ──► a request to each of its slaves, one GAP poll now and then ──► token to the next master

Each slave is brought up by Slave_Diag, Set_Prm, Chk_Cfg, Slave_Diag, and then exchanges data; a request that is not
answered within the slot time is repeated once, and after that the slave begins anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto

from dissectors.line import MS, LineSettings
from dissectors.profibus.diagnosis import parse_diagnosis
from dissectors.profibus.simulated_wire import telegrams_of
from dissectors.profibus.telegram import BROADCAST, Telegram, telegram, token
from dissectors.simulated import Send

MASTER_SAP = 62
_SRD_HIGH, _SDN_HIGH, _STATUS = 0x4D, 0x46, 0x49
_FCB, _FCV = 0x20, 0x10


class _Step(Enum):
    """What a slave is asked next."""

    DIAGNOSIS = auto()
    PARAMETERS = auto()
    CONFIGURATION = auto()
    READY = auto()  # the diagnosis after the configuration
    EXCHANGE = auto()
    FETCH = auto()  # the diagnosis that was announced


@dataclass(slots=True)
class Job:
    """A slave of a master: what it is given.

    `outputs(now)`: ns → its outputs. `watchdog`: factor of 10 ms, 0 for none. `user`: the last octets of Set_Prm.
    """

    address: int
    ident: int = 0xF510
    configuration: bytes = b"\x7f"
    outputs: Callable[[int], bytes] = lambda now: bytes(32)
    watchdog: int = 100
    user: bytes = bytes(5)
    step: _Step = _Step.DIAGNOSIS
    is_first: bool = True
    fcb: bool = True
    due: int = 0

    def request(self, master: int, now: int, is_clear: bool = False) -> bytes:
        """The next telegram to it; in Clear all outputs are zero."""
        control = _SRD_HIGH | (_FCB if self.fcb else 0) | (0 if self.is_first else _FCV)
        if self.step is _Step.EXCHANGE:
            outputs = self.outputs(now)
            return telegram(self.address, master, control, bytes(len(outputs)) if is_clear else outputs)
        point, data = 60, b""
        if self.step is _Step.PARAMETERS:
            head = (0x88 if self.watchdog else 0x80, self.watchdog, 1 if self.watchdog else 0, 11)
            point, data = 61, bytes((*head, self.ident >> 8, self.ident & 0xFF, 0)) + self.user
        elif self.step is _Step.CONFIGURATION:
            point, data = 62, self.configuration
        return telegram(self.address, master, control, data, point, MASTER_SAP)

    def answered(self) -> None:
        """The frame count bit goes on."""
        self.is_first, self.fcb = False, not self.fcb

    def lost(self, now: int, pause: int) -> None:
        """Begin anew, after a pause."""
        self.step, self.is_first, self.fcb, self.due = _Step.DIAGNOSIS, True, True, now + pause


@dataclass(slots=True)
class _Waiting:
    """A request on its way: until when (ns) it may be answered, and how often it was sent."""

    octets: bytes
    job: Job | None
    until: int
    tries: int = 1


@dataclass(frozen=True, slots=True)
class RingBehaviour:
    """How a master behaves in its ring.

    `slot`: bit times that it waits for an answer. `highest`: address up to which GAP is polled. `gap_every`: rounds
    from one GAP poll to the next. `cycle`: ns from one round of requests to the next. `hold`: bit times that it keeps a
    token for which it has no use, less than `slot`. `is_clear`: whether it stays in Clear. `retries`: how often it
    repeats a request. `pause`: ns until it looks again for a slave that it lost. `commands`: of Global_Control, one in
    each round by turns, with the groups. `is_class_1`: whether it tells slaves of its own Clear and Operate.
    """

    slot: int = 1000
    highest: int = 20
    gap_every: int = 10
    cycle: int = 20 * MS
    hold: int = 500
    is_clear: bool = False
    retries: int = 1
    pause: int = 500 * MS
    commands: tuple[tuple[int, int], ...] = ()
    is_class_1: bool = True


@dataclass(slots=True)
class _Life:
    """What a master has to remember of the ring."""

    following: int
    rounds: int = 0
    polled: int = 0
    tokens_sent: int = 0
    heard: int = 0
    last_round: int = -(10**18)
    told: bool | None = None
    todo: deque[Job] = field(default_factory=deque)


class Master:
    """A master. `others`: the masters that it passes the token to, in the order of their addresses. `start`: ns."""

    def __init__(
        self,
        address: int,
        line: LineSettings,
        jobs: Sequence[Job],
        others: Sequence[int] = (),
        ring: RingBehaviour | None = None,
    ) -> None:
        self.address = address
        self._line = line
        self._jobs = list(jobs)
        self._ring = ring or RingBehaviour()
        self._others = sorted(others)
        above = [one for one in self._others if one > address]
        self._life = _Life((above or self._others or [address])[0])
        self._life.polled = address
        self._slot = line.bits(self._ring.slot)
        self._idle = line.bits(37)
        self._has_token = False
        self._holds = False
        self._waiting: _Waiting | None = None
        self._passed: int | None = None  # until when the next master must show itself
        self._due: int | None = line.bits((6 + 2 * address) * self._ring.slot)

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Take an answer, a token, a poll for masters."""
        self._passed = None
        if not self._has_token:
            self._due = now + self._line.bits((6 + 2 * self.address) * self._ring.slot)
        sends: tuple[Send, ...] = ()
        for _, heard in telegrams_of(octets):
            if heard.is_token:
                if heard.destination == self.address:
                    self._take(now)
            elif heard.is_request:
                if heard.destination == self.address and heard.control is not None and heard.control.octet == _STATUS:
                    sends = (Send(now + self._line.bits(20), telegram(heard.source or 0, self.address, 0x30)),)
            elif self._waiting is not None and (heard.is_short or heard.destination == self.address):
                self._answered(self._waiting, heard, now)
        return sends

    def wake(self, now: int) -> tuple[Send, ...]:
        """Send what is due: a repeat, the next request, the token; claim the token when the bus is silent."""
        if self._passed is not None:
            return self._pass_again(now) if now >= self._passed else ()
        if self._due is None or now < self._due:
            return ()
        if not self._has_token:
            self._has_token, self._life.tokens_sent = True, 0
            claim = token(self.address, self.address)
            self._due = now + 2 * len(claim) * self._line.char + 2 * self._idle
            return (Send(now, claim), Send(now + len(claim) * self._line.char + self._idle, claim))
        if self._waiting is not None:
            return self._repeat(self._waiting, now)
        return self._next(now)

    def next_wake(self) -> int | None:
        """When it acts next, ns."""
        return self._passed if self._passed is not None else self._due

    def _take(self, now: int) -> None:
        self._has_token, self._passed, self._waiting = True, None, None
        self._due = now + self._idle

    def _next(self, now: int) -> tuple[Send, ...]:
        life = self._life
        if life.todo:
            return self._ask(life.todo.popleft(), now)
        if now - life.last_round >= self._ring.cycle:
            self._holds = False
            life.last_round = now
            life.rounds += 1
            life.todo = deque(job for job in self._jobs if job.due <= now)
            command = self._command()
            if command is not None:
                self._due = now + len(command) * self._line.char + self._idle
                return (Send(now, command),)
            if life.rounds % self._ring.gap_every == 0:
                return self._poll(now)
            if life.todo:
                return self._ask(life.todo.popleft(), now)
            return self._pass(now)
        if not self._holds:
            self._holds = True
            round_due = life.last_round + self._ring.cycle
            self._due = (
                round_due if life.following == self.address else min(round_due, now + self._line.bits(self._ring.hold))
            )
            return ()
        self._holds = False
        return self._pass(now)

    def _command(self) -> bytes | None:
        """Global_Control, where what it says has changed."""
        if not self._ring.is_class_1:
            return None
        is_clear = self._ring.is_clear or not any(job.step is _Step.EXCHANGE for job in self._jobs)
        if self._life.told is None or (self._life.told and not is_clear):
            self._life.told = is_clear
            return self._control(2 if is_clear else 0, 0)
        commands = self._ring.commands
        return self._control(*commands[self._life.rounds % len(commands)]) if commands and not is_clear else None

    def _control(self, command: int, groups: int) -> bytes:
        return telegram(BROADCAST, self.address, _SDN_HIGH, bytes((command, groups)), 58, MASTER_SAP)

    def _poll(self, now: int) -> tuple[Send, ...]:
        """Look for a master between this and the next one."""
        life = self._life
        for _ in range(self._ring.highest + 1):
            life.polled = (life.polled + 1) % (self._ring.highest + 1)
            if life.polled == life.following or life.polled == self.address:
                life.polled = self.address
                continue
            break
        octets = telegram(life.polled, self.address, _STATUS)
        return self._send(_Waiting(octets, None, 0), now)

    def _ask(self, job: Job, now: int) -> tuple[Send, ...]:
        return self._send(_Waiting(job.request(self.address, now, bool(self._life.told)), job, 0), now)

    def _send(self, waiting: _Waiting, now: int) -> tuple[Send, ...]:
        waiting.until = now + len(waiting.octets) * self._line.char + self._slot + 260 * self._line.char
        self._waiting, self._due = waiting, now + len(waiting.octets) * self._line.char + self._slot
        return (Send(now, waiting.octets),)

    def _repeat(self, waiting: _Waiting, now: int) -> tuple[Send, ...]:
        if waiting.job is not None and waiting.tries <= self._ring.retries:
            waiting.tries += 1
            return self._send(waiting, now)
        if waiting.job is not None:
            waiting.job.lost(now, self._ring.pause)
        self._waiting = None
        return self._next(now)

    def _pass(self, now: int) -> tuple[Send, ...]:
        life = self._life
        octets = token(life.following, self.address)
        end = now + len(octets) * self._line.char
        if life.following == self.address:
            self._due = max(end + self._idle, life.last_round + self._ring.cycle)
            return (Send(now, octets),)
        self._has_token, life.tokens_sent = False, 1
        self._passed = end + self._slot
        return (Send(now, octets),)

    def _pass_again(self, now: int) -> tuple[Send, ...]:
        """The next master does not show itself: twice more, then it is left out."""
        life = self._life
        if life.tokens_sent < 3:
            octets = token(life.following, self.address)
            life.tokens_sent += 1
            self._passed = now + len(octets) * self._line.char + self._slot
            return (Send(now, octets),)
        later = [one for one in self._others if one != life.following]
        life.following = (later or [self.address])[0]
        self._passed, self._has_token = None, True
        return self._pass(now)

    def _answered(self, waiting: _Waiting, heard: Telegram, now: int) -> None:
        self._waiting, self._due = None, now + self._idle
        job = waiting.job
        if job is None:
            if heard.control is not None and heard.control.octet in (0x20, 0x30) and heard.source is not None:
                self._life.following = heard.source
                self._others = sorted({*self._others, heard.source})
            return
        job.answered()
        status = None if heard.control is None else heard.control.status
        if status is not None and status.refuses:
            job.step = _Step.DIAGNOSIS
        elif job.step is _Step.EXCHANGE:
            job.step = _Step.FETCH if status is not None and status.is_urgent else _Step.EXCHANGE
        elif job.step is _Step.PARAMETERS:
            job.step = _Step.CONFIGURATION
        elif job.step is _Step.CONFIGURATION:
            job.step = _Step.READY
        else:
            self._diagnosed(job, heard, now)

    def _diagnosed(self, job: Job, heard: Telegram, now: int) -> None:
        told = parse_diagnosis(heard.data)
        if told is None:
            return
        is_mine = told.master == self.address
        if told.is_ready and is_mine and job.step is not _Step.DIAGNOSIS:
            job.step = _Step.EXCHANGE
        elif job.step is _Step.READY:
            job.lost(now, self._ring.pause)
        else:
            job.step = _Step.PARAMETERS
