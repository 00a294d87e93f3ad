"""Things to tell, and an outlet that keeps what it is told."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from dissectors.findings import Finding, Severity
from dissectors.profiles.decoding import Quality, Value
from dissectors.readings import Origin, Reading
from sniff.analysis.point_reader import Sample
from sniff.outlets.news import News, NewsKind
from sniff.outlets.outlet import Outlet
from sniff.outlets.told import FindingTold, NumbersTold, StateTold, Told, ToldBus, ValueTold
from sniff.recording.derived_message import DerivedMessage

NOW = 1_795_890_000_000_000_000
BUS = ToldBus("boiler", "/dev/ttyUSB0", "modbus-rtu")
FOUND = Finding("MB001", Severity.ERROR, "station 3", NOW, NOW, 4, (), "no answer", "it is off", "switch it on")


def sample(value: Any = 60.0, name: str = "output-frequency", time: int = NOW, **more: Any) -> Sample:
    reading = Reading("holding", 1, 0, 0, Origin.READ)
    raw = None if isinstance(value, str) else 6000
    return Sample(time, 3, Value(name, value, raw, more.pop("unit", "Hz"), Quality.GOOD, reading, **more), 12)


def value(told: Any = 60.0, name: str = "output-frequency", bus: ToldBus = BUS, **more: Any) -> ValueTold:
    return ValueTold(bus, sample(told, name, **more))


def finding(what: NewsKind = NewsKind.NEW, found: Finding = FOUND, bus: ToldBus = BUS) -> FindingTold:
    return FindingTold(bus, NOW, News(what, found))


def numbers(data: bytes = b'{"load": 0.5, "frames": 20}', station: str | None = None) -> NumbersTold:
    return NumbersTold(BUS, station, DerivedMessage("/bus/boiler", "sniff485.Bus", NOW, NOW, data))


def state(listening: bool = True, text: str = "") -> StateTold:
    return StateTold(BUS, NOW, listening, text)


class KeptOutlet(Outlet):
    """Takes one thing at a time, each when `go` is set."""

    def __init__(self, complain: Callable[[str], None] = lambda text: None, every: int = 0, most: int = 100) -> None:
        super().__init__("kept", complain, every, most)
        self.go = threading.Event()
        self.got: list[Told] = []

    def _run(self) -> None:
        while True:
            told = self._take(1, None)
            if not told and self._closing:
                return
            self.go.wait(60)
            self.got += told
            self.sent += len(told)
