"""State machine of each slave as the bus shows it: how it came up and fell back, with times."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.findings import Tally
from dissectors.histogram import Histogram
from dissectors.line import MS
from dissectors.profibus.control import Status
from dissectors.profibus.diagnosis import (
    CONFIGURATION_FAULT,
    EXTENDED,
    LOCKED,
    NO_MASTER,
    NOT_READY,
    PARAMETER_FAULT,
    STATIC,
    Diagnosis,
    parse_diagnosis,
)
from dissectors.profibus.parameters import LOCK, UNLOCK, Parameters, parse_parameters
from dissectors.profibus.ring import SlaveCounts
from dissectors.profibus.services import Service
from dissectors.profibus.slave_state import SlaveState
from dissectors.profibus.telegram import Telegram

CHANGES_KEPT = 32
OFFLINE_AFTER = 4
"""Requests in a row without any answer after which a slave counts as offline."""

_LEAST_WATCHDOG = 10 * MS
"""ns; no slave of DP-V0 has a shorter one."""


@dataclass(slots=True)
class SlaveView:
    """What was seen of one slave. `changes`: time (ns) and new state, the last CHANGES_KEPT of `changed`.

    `drops`: times at which it was found to have left data exchange by itself. `given`: the newest parameters.
    `configured`, `has`: identifiers that it was given, and that it says it has. `told`: its newest diagnosis.
    `failed`: parameters in a row that led to one exchange of data at most until it was given them again, with nothing
    damaged; `unready`: diagnoses since it was configured that say that it has no data yet. `single`: octets
    in its answer to the only exchange of data since it was given any.
    """

    state: SlaveState | None = None
    changes: list[tuple[int, SlaveState]] = field(default_factory=list)
    changed: int = 0
    exchanges: int = 0
    urgent: int = 0  # answers of high priority in a row since the newest diagnosis
    unanswered: int = 0
    drops: int = 0
    given: Parameters | None = None
    configured: bytes = b""
    has: bytes = b""
    told: Diagnosis | None = None
    told_after: int = 0  # parameters and configurations that it was given here before its newest diagnosis
    gifts: int = 0  # the same so far
    unlocked: bool = False
    owner: int | None = None  # the master whose parameters it has, as far as it is known
    wanted_by: set[int] = field(default_factory=set)  # masters that gave it parameters
    asked: int | None = None  # when its master asked it last, ns
    silence: int = 0  # the longest pause between requests of its master since it answered well
    survived: int = 0  # the longest such pause after which it still exchanged data
    cycle: Histogram = field(default_factory=Histogram)
    begun: int | None = None  # when its newest exchange of data began, ns; None after a disturbance
    lost: int = 0
    syncs: int = 0
    repeats: int = 0
    longest: int = 0
    run: int = 0
    illegal: int = 0
    rejects: int = 0
    diagnoses: int = 0
    faults: int = 0
    was_exchanging: bool = False  # when it fell silent
    failed: Tally = field(default_factory=Tally)
    unready: Tally = field(default_factory=Tally)
    started: tuple[int, int] | None = None  # row and time of the parameters that it has; None after a disturbance
    before: int = 0  # exchanges of data until it was given them
    single: int | None = None
    is_blurred: bool = False  # octets were damaged since it last answered: what its master told it may be lost here

    def ask(self, time: int, master: int) -> None:
        """It is asked for something; what others ask does not serve its watchdog."""
        if self.owner not in (None, master):
            return
        self.silence = max(self.silence, 0 if self.asked is None else time - self.asked)
        self.asked = time

    def request(self, asked: Telegram, is_exchange: bool, is_repeat: bool, time: int) -> None:
        """Count a request to it. `is_repeat`: it is the one directly before once more."""
        control = asked.control
        if is_repeat:
            self.repeats, self.run = self.repeats + 1, self.run + 1
            self.longest = max(self.longest, self.run)
            return
        self.run = 0
        if control is not None and control.fcb and not control.fcv:
            self.syncs += 1
            self.lost += self.state is SlaveState.EXCHANGE and self.unanswered > 0
            if self.unanswered and self.state is SlaveState.EXCHANGE:
                self.become(SlaveState.OFFLINE, time)
        if is_exchange:
            if self.begun is not None:
                self.cycle.add(time - self.begun)
            self.begun = time

    @property
    def counts(self) -> SlaveCounts:
        """What went otherwise than smoothly."""
        return SlaveCounts(
            self.lost,
            self.syncs,
            self.repeats,
            self.longest,
            self.illegal,
            self.rejects,
            self.diagnoses,
            self.faults,
        )

    def heard(self, is_exchange: bool) -> None:
        """It has answered."""
        if is_exchange:
            self.survived = max(self.survived, self.silence)
        self.silence, self.is_blurred = 0, False

    @property
    def is_excused(self) -> bool:
        """Whether something else than the slave may be why it left data exchange just now: its master asked nothing for
        longer than its watchdog (than ever before, where the watchdog was not heard), or what its master told it was
        lost among damaged octets."""
        if self.is_blurred:
            return True
        watchdogs = (0, 0) if self.given is None else self.given.watchdogs_ms
        if watchdogs == (0, 0):  # not heard, or none that there can be
            return self.silence > max(2 * self.survived, _LEAST_WATCHDOG)
        return watchdogs is not None and self.silence >= watchdogs[0] * MS

    def is_starved(self, doubt: int) -> bool:
        """Whether nothing but the silence of its master is why it left data exchange just now. `doubt`: ns by which
        times may be off."""
        _, most = (self.given.watchdogs_ms if self.given is not None else None) or (0, 0)
        return not self.is_blurred and most > 0 and self.silence - doubt >= most * MS

    @property
    def is_taken(self) -> bool:
        """Whether its newest parameters make it the master's who gave them."""
        return self.given is not None and self.given.status & (LOCK | UNLOCK) == LOCK

    def blur(self) -> None:
        """Octets were damaged: what it was told meanwhile is not known."""
        self.is_blurred, self.begun, self.started = True, None, None

    def start(self, no: int, time: int) -> None:
        """It took parameters, asked in a row at a time, ns: it is to exchange data next."""
        if self.started is not None:
            self.failed.add(self.started[1], self.started[0])
        self.started, self.before, self.unready = (no, time), self.exchanges, Tally()

    def serve(self) -> None:
        """It exchanged data: its start came to something where its master goes on after the first answer."""
        if self.exchanges - self.before <= 1:
            return
        self.single = None
        if self.started is not None or self.failed.count:
            self.started, self.failed, self.unready = None, Tally(), Tally()

    def wait(self, no: int, time: int) -> None:
        """It told a diagnosis, asked in a row at a time, ns."""
        if self.told is None or self.state is not SlaveState.CONFIGURED:
            return
        if self.told.first & NOT_READY or self.told.second & STATIC:
            self.unready.add(time, no)
        else:
            self.unready = Tally()

    def become(self, state: SlaveState, time: int) -> None:
        """Take a state."""
        if state is self.state:
            return
        self.was_exchanging = state is SlaveState.OFFLINE and self.state is SlaveState.EXCHANGE
        self.state = state
        self.changed += 1
        self.changes.append((time, state))
        del self.changes[:-CHANGES_KEPT]

    def missed(self, time: int) -> None:
        """A request to it was not answered."""
        self.unanswered += 1
        if self.unanswered == OFFLINE_AFTER:
            self.become(SlaveState.OFFLINE, time)

    def answered(self, service: Service, asked: Telegram, answer: Telegram, time: int) -> bool:
        """Take an answer; whether it shows that the slave left data exchange by itself."""
        self.unanswered = 0
        status = None if answer.control is None else answer.control.status
        self.rejects += status is not None and status.refuses
        if service is Service.DATA_EXCHANGE:
            return self._exchanged(status, len(answer.data), time)
        if status is not None and status.refuses:
            return False
        if service is Service.DIAGNOSIS:
            said = parse_diagnosis(answer.data)
            return said is not None and self._diagnosed(said, time)
        self.gifts += service in (Service.SET_PARAMETERS, Service.CHECK_CONFIGURATION)
        if service is Service.SET_PARAMETERS:
            self.given = parse_parameters(asked.data)
            self.unlocked = self.given is not None and bool(self.given.status & UNLOCK)
            if asked.source is not None and not self.unlocked:
                self.wanted_by.add(asked.source)
            self.become(SlaveState.WAIT_CONFIGURATION, time)
        elif service is Service.CHECK_CONFIGURATION:
            self.configured = asked.data
            self.become(SlaveState.CONFIGURED, time)
        elif service is Service.GET_CONFIGURATION:
            self.has = answer.data
        return False

    def _exchanged(self, status: Status | None, octets: int, time: int) -> bool:
        if status is Status.NOT_ACTIVATED:
            fell = self.state is SlaveState.EXCHANGE and not self.unlocked
            self.drops += fell
            self.become(SlaveState.WAIT_PARAMETERS, time)
            return fell
        if status is not None and status.refuses:
            return False
        self.exchanges, self.single = self.exchanges + 1, octets
        self.serve()
        self.urgent = self.urgent + 1 if status is not None and status.is_urgent else 0
        self.become(SlaveState.EXCHANGE, time)
        return False

    def _diagnosed(self, said: Diagnosis, time: int) -> bool:
        self.told, self.told_after, self.urgent = said, self.gifts, 0
        self.diagnoses += 1
        self.faults += bool(said.first & (EXTENDED | CONFIGURATION_FAULT | PARAMETER_FAULT))
        if said.master != NO_MASTER:
            self.owner = said.master
        if not said.wants_parameters:
            return False
        self.owner = None
        fell = (self.state is SlaveState.EXCHANGE or self.was_exchanging) and not self.unlocked
        self.drops += fell
        self.become(SlaveState.WAIT_PARAMETERS, time)
        return fell

    @property
    def is_told_before(self) -> bool:
        """Whether its newest diagnosis is of before its master gave it anything here, which it did then."""
        return self.told is not None and not self.told_after and self.gifts > 0

    @property
    def has_trouble(self) -> bool:
        """Whether its newest diagnosis has something to tell beyond the standard octets."""
        return self.told is not None and bool(self.told.first & EXTENDED)

    def is_of_another(self, master: int) -> bool:
        """Whether its newest diagnosis, which `master` fetched, says that it belongs to another one."""
        return self.told is not None and (self.told.master not in (NO_MASTER, master) or bool(self.told.first & LOCKED))

    @property
    def master(self) -> int | None:
        """Whose it says it is."""
        return None if self.told is None or self.told.master == NO_MASTER else self.told.master
