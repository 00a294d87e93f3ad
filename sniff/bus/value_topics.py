"""Samples as messages of a recording: `/values/<bus>/<device>/<point>`, flat JSON, unit and words in the metadata."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

from dissectors.profiles import Devices
from dissectors.profiles.model import Entry
from sniff.analysis.point_reader import Sample
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.topics import topic_part

MOST_CHANNELS = 4096
"""Points that get a channel; the rest is only in the octets, from which it can be computed."""

NUMBERS, TEXTS = "sniff485.Value", "sniff485.TextValue"
"""Schema records, of `sniff.recording.topics`."""


class ValueChannels:
    """Makes messages of the samples of one bus. A single bit is written when it changes, and at first."""

    def __init__(self, bus: str, devices: Devices) -> None:
        self._prefix = f"/values/{topic_part(bus) or 'bus'}"
        self._devices = devices
        self._schemas: dict[str, str] = {}
        self._metadata: dict[str, dict[str, str]] = {}
        self._bits: dict[str, object] = {}
        self._topics: dict[tuple[str, str], str] = {}

    def topic(self, sample: Sample) -> str:
        """Where samples of its point go."""
        key = sample.station, sample.name
        topic = self._topics.get(key)
        if topic is None:
            topic = f"{self._prefix}/{sample.station}/{_safe(sample.name)}"
            if len(self._topics) < MOST_CHANNELS:
                self._topics[key] = topic
        return topic

    def has_room(self, topic: str) -> bool:
        """Whether a point has a channel, or may still get one."""
        return topic in self._schemas or len(self._schemas) < MOST_CHANNELS

    def message(self, sample: Sample, wanted: Callable[[str, int], bool] = lambda *_: True) -> DerivedMessage | None:
        """The message of a sample; None when there is nothing to write. `wanted`: whether a topic has its turn then."""
        value = sample.value
        text = isinstance(value.value, str)
        if not text and not sample.finite:
            return None  # JSON has no word for it
        topic = self.topic(sample)
        if value.bit and self._bits.get(topic) == value.value:
            return None
        schema = TEXTS if text else NUMBERS
        known = self._schemas.get(topic)
        if known not in (None, schema) or not self.has_room(topic):
            return None  # a channel has one schema
        if not wanted(topic, sample.time):
            return None
        if known is None:
            self._schemas[topic] = schema
            self._metadata[topic] = self._describe(sample)
        if value.bit:
            self._bits[topic] = value.value
        content: dict[str, object] = {"value": value.value, "raw": value.raw}
        if value.raw is None:
            del content["raw"]
        content |= {"quality": int(value.quality), "frame": sample.frame}
        time, data = sample.time, json.dumps(content).encode()
        return DerivedMessage(topic, schema, time, time, data, self._metadata[topic])

    def _describe(self, sample: Sample) -> dict[str, str]:
        value, entry = sample.value, sample.value.entry
        place = f"{value.reading.space} {value.reading.address}"
        metadata = {"unit": value.unit, "place": place}
        profile = self._devices.at(sample.device)
        if profile is not None:
            metadata["profile"] = profile.name
        if entry is not None:
            metadata |= {"title": entry.title, "access": entry.access.value}
            states = _states(sample, entry)
            if states:
                metadata["states"] = states
        return metadata


def _states(sample: Sample, entry: Entry) -> str:
    """ "0=stopped; 1=running" of the point itself."""
    name = sample.name.removeprefix(f"{entry.name}.")
    for bit in entry.bits if sample.value.bit else ():
        if bit.name == name:
            return f"0={bit.off or 'off'}; 1={bit.on}"
    for part in entry.parts if sample.value.bit else ():
        if part.name == name:
            return "; ".join(f"{code}={words}" for code, words in part.states.items())
    return "" if sample.value.bit else "; ".join(f"{code}={words}" for code, words in entry.states.items())


def _safe(text: str) -> str:
    """A topic without what a reader could stumble over."""
    return re.sub(r"[^A-Za-z0-9_./+-]+", "-", text)
