"""How each slave came up and fell back, with times: its state machine as the bus shows it."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.line import MS
from dissectors.profibus.control import Status
from dissectors.profibus.diagnosis import EXTENDED, NO_MASTER, Diagnosis, parse_diagnosis
from dissectors.profibus.parameters import UNLOCK, Parameters, parse_parameters
from dissectors.profibus.services import Service
from dissectors.profibus.slave_state import SlaveState
from dissectors.profibus.telegram import Telegram

CHANGES_KEPT = 32
OFFLINE_AFTER = 4
"""Requests in a row without any answer after which a slave counts as offline."""


@dataclass(slots=True)
class SlaveView:
    """What was seen of one slave. `changes`: time (ns) and new state, the last CHANGES_KEPT of `changed`.

    `drops`: times at which it was found to have left data exchange by itself. `given`: the newest parameters.
    `configured`, `has`: identifiers that it was given, and that it says it has. `told`: its newest diagnosis.
    """

    state: SlaveState | None = None
    changes: list[tuple[int, SlaveState]] = field(default_factory=list)
    changed: int = 0
    exchanges: int = 0
    urgent: int = 0  # answers of high priority since the newest diagnosis
    unanswered: int = 0
    drops: int = 0
    given: Parameters | None = None
    configured: bytes = b""
    has: bytes = b""
    told: Diagnosis | None = None
    unlocked: bool = False
    asked: int | None = None  # when it was asked last, ns
    silence: int = 0  # the longest pause between requests since it answered well

    def ask(self, time: int) -> None:
        """It is asked for something."""
        self.silence = max(self.silence, 0 if self.asked is None else time - self.asked)
        self.asked = time

    def heard(self, time: int) -> None:
        """It has answered."""
        self.silence = 0

    @property
    def was_starved(self) -> bool:
        """Whether nobody asked it for longer than its watchdog."""
        watchdog = None if self.given is None else self.given.watchdog_ms
        return watchdog is not None and self.silence >= watchdog * MS

    def become(self, state: SlaveState, time: int) -> None:
        """Take a state."""
        if state is self.state:
            return
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
        if service is Service.DATA_EXCHANGE:
            return self._exchanged(status, time)
        if status is not None and status.refuses:
            return False
        if service is Service.DIAGNOSIS:
            said = parse_diagnosis(answer.data)
            return said is not None and self._diagnosed(said, time)
        if service is Service.SET_PARAMETERS:
            self.given = parse_parameters(asked.data)
            self.unlocked = self.given is not None and bool(self.given.status & UNLOCK)
            self.become(SlaveState.WAIT_CONFIGURATION, time)
        elif service is Service.CHECK_CONFIGURATION:
            self.configured = asked.data
            if self.state is not SlaveState.EXCHANGE:
                self.become(SlaveState.CONFIGURED, time)
        elif service is Service.GET_CONFIGURATION:
            self.has = answer.data
        return False

    def _exchanged(self, status: Status | None, time: int) -> bool:
        if status is Status.NOT_ACTIVATED:
            fell = self.state is SlaveState.EXCHANGE and not self.unlocked
            self.drops += fell
            self.become(SlaveState.WAIT_PARAMETERS, time)
            return fell
        if status is not None and status.refuses:
            return False
        self.exchanges += 1
        self.urgent += status is not None and status.is_urgent
        self.become(SlaveState.EXCHANGE, time)
        return False

    def _diagnosed(self, said: Diagnosis, time: int) -> bool:
        self.told, self.urgent = said, 0
        if not said.wants_parameters:
            return False
        fell = self.state is SlaveState.EXCHANGE and not self.unlocked
        self.drops += fell
        self.become(SlaveState.WAIT_PARAMETERS, time)
        return fell

    @property
    def has_trouble(self) -> bool:
        """Whether its newest diagnosis has something to tell beyond the standard octets."""
        return self.told is not None and bool(self.told.first & EXTENDED)

    @property
    def master(self) -> int | None:
        """Whose it says it is."""
        return None if self.told is None or self.told.master == NO_MASTER else self.told.master
