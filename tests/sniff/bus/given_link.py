"""A link to no capture: it hands out the messages that a test gives it, once, and keeps what is to be recorded."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.line import LineSettings
from sniff.capture.ipc import Batch, Ended
from sniff.engine.session import Session
from sniff.recording.derived_message import DerivedMessage


class GivenLink:
    """`messages`: what comes next. `told`: what went back into the recording, where `paths` says that there is one."""

    def __init__(self, messages: Iterable[Batch] = (), paths: Iterable[str] = (), line: str = "19200,8E1") -> None:
        self.messages, self.paths = list(messages), list(paths)
        self.line = LineSettings.parse(line)
        self.priority, self.closing = "", False
        self.over_since: float | None = None
        self.dropped: dict[int, int] = {}
        self.ended: Ended | None = None
        self.told: list[DerivedMessage] = []

    def session(self, bus: int) -> Session:
        return Session(f"port{bus}", self.line, "modbus-rtu", bus=f"bus{bus}")

    def receive_batches(self, timeout: float = 0.0) -> list[Batch]:
        given, self.messages = self.messages, []
        return given

    def look(self, timeout: float = 0.0) -> bool:
        return True

    def insist(self) -> Ended | None:
        return None

    def ask_to_stop(self) -> None:
        pass

    def let_go(self) -> None:
        pass

    def derived(self, bus: int, derived: DerivedMessage) -> bool:
        self.told.append(derived)
        return True
