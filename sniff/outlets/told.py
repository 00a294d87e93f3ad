"""Records that outlets are told: values, numbers of a bus and its stations, findings, events of the line. Pure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from dissectors.profiles import Devices
from sniff.analysis.point_reader import Sample
from sniff.outlets.news import News
from sniff.recording.derived_message import DerivedMessage


@dataclass(frozen=True, slots=True)
class ToldBus:
    """Which bus it is about. `port` may hold no secret: it is told as it is shown."""

    name: str
    port: str
    protocol: str
    devices: Devices = field(default_factory=Devices, compare=False)


@dataclass(frozen=True, slots=True)
class ValueTold:
    """A value of a point."""

    bus: ToldBus
    sample: Sample

    @property
    def time(self) -> int:
        """ns since the epoch."""
        return self.sample.time


@dataclass(frozen=True)
class NumbersTold:
    """What was counted in a second. `message`: as it goes into a recording; `station`: None for the whole bus."""

    bus: ToldBus
    station: str | None
    message: DerivedMessage

    @property
    def time(self) -> int:
        """ns since the epoch: the end of the second."""
        return self.message.log_time

    @cached_property
    def numbers(self) -> Mapping[str, float]:
        """By name, as the schema of the recording has them (`sniff.recording.topics`)."""
        numbers: Mapping[str, float] = json.loads(self.message.data)
        return numbers


@dataclass(frozen=True, slots=True)
class LogTold:
    """A finding as it goes into a recording: for whoever shows a recording's channels live."""

    bus: ToldBus
    message: DerivedMessage

    @property
    def time(self) -> int:
        """ns since the epoch."""
        return self.message.log_time


@dataclass(frozen=True, slots=True)
class FindingTold:
    """A finding is new, graver, or over."""

    bus: ToldBus
    time: int
    news: News


@dataclass(frozen=True, slots=True)
class StateTold:
    """Whether a bus is listened to from now on, and what happened."""

    bus: ToldBus
    time: int
    listening: bool
    text: str = ""


Told = ValueTold | NumbersTold | LogTold | FindingTold | StateTold
