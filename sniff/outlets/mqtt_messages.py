"""Messages to a broker: topics and payloads of values, numbers, findings and availability, and what Home Assistant
wants to know to show them. Pure.

    PREFIX/status                         online, offline (also by the broker, when we are gone)   retained
    PREFIX/BUS/status                     online, offline: whether the bus is listened to           retained
    PREFIX/BUS/health                     load, errors, health of the last second                   retained
    PREFIX/BUS/nodes/STATION              the same of a station                                     retained
    PREFIX/BUS/values/STATION/POINT       {"value": 60.0, "unit": "Hz", ...}                        retained
    PREFIX/BUS/findings                   each thing that is new, worse or gone
    PREFIX/BUS/findings/CODE/SUBJECT      what stands; empty when it is over                        retained
    PREFIX/BUS/problem                    ON while an error or a warning stands, else OFF           retained

A finding stands while somebody listens: at the end of a run its topic is emptied, and what a run that did not end so
left is taken away by the next one on the same bus (`Messages.leftovers`).

A name is part of a topic: what MQTT takes for a separator or a wildcard is written otherwise, and two names never share
a topic.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass

from dissectors.findings import Severity
from sniff.analysis.json_text import dumps, iso
from sniff.analysis.sanitizing import sanitized
from sniff.outlets.json_lines import finding_record
from sniff.outlets.news import NewsKind
from sniff.outlets.told import FindingTold, NumbersTold, StateTold, Told, ToldBus, ValueTold
from sniff.version import __version__

ONLINE, OFFLINE = "online", "offline"
MOST_TOPICS = 20_000
"""Topics of values; points beyond have none, and are dropped."""

MOST_DISCOVERED = 2_000
"""Points that Home Assistant is told of."""

MOST_LEVEL = 128
"""Characters of a name in a topic."""

DEVICE_CLASSES = {
    "°C": "temperature",
    "°F": "temperature",
    "Hz": "frequency",
    "V": "voltage",
    "mV": "voltage",
    "A": "current",
    "mA": "current",
    "W": "power",
    "kW": "power",
    "Wh": "energy",
    "kWh": "energy",
    "MWh": "energy",
    "Pa": "pressure",
    "kPa": "pressure",
    "hPa": "pressure",
    "bar": "pressure",
    "mbar": "pressure",
    "psi": "pressure",
    "s": "duration",
    "min": "duration",
    "h": "duration",
    "m³/h": "volume_flow_rate",
    "L/min": "volume_flow_rate",
}
"""Units that Home Assistant knows as one of a class. Not ppm: of what gas, only a person knows."""


@dataclass(frozen=True, slots=True)
class Publication:
    """One message."""

    topic: str
    payload: bytes
    retain: bool = True


class Topics:
    """Names to levels of topics, one to one."""

    def __init__(self) -> None:
        self._levels: dict[tuple[str, ...], str] = {}
        self._taken: dict[str, tuple[str, ...]] = {}

    def __len__(self) -> int:
        return len(self._levels)

    def of(self, *names: str) -> str | None:
        """The topic of names, "boiler/values/3/output-frequency"; None where there are too many already."""
        known = self._levels.get(names)
        if known is not None:
            return known
        if len(self._levels) >= MOST_TOPICS:
            return None
        topic = wanted = "/".join(level(name) for name in names)
        number = 2
        while topic in self._taken:
            topic, number = f"{wanted}-{number}", number + 1
        self._levels[names] = topic
        self._taken[topic] = names
        return topic


def level(name: str) -> str:
    """A name as part of a topic; slashes in it stay, as levels."""
    text = re.sub(r"[^\w./()%°²³-]+", "-", sanitized(name))[:MOST_LEVEL]
    return "/".join(part for part in text.split("/") if part) or "-"


class Messages:
    """What is published, thing by thing. `discovery`: prefix of Home Assistant's topics, "": it is told nothing."""

    def __init__(self, prefix: str, discovery: str) -> None:
        self._prefix = prefix
        self._discovery = discovery
        self._topics = Topics()
        self._discovered: set[str] = set()
        self._standing: dict[str, dict[tuple[str, str], tuple[Severity, str]]] = {}  # by bus; how grave, and its topic
        self._buses: dict[str, ToldBus] = {}
        self.dropped = 0

    @property
    def status_topic(self) -> str:
        """Where it is said whether we are there."""
        return f"{self._prefix}/status"

    def of(self, told: Told) -> Iterator[Publication]:
        """The messages of one thing."""
        if isinstance(told, ValueTold):
            yield from self._value(told)
        elif isinstance(told, NumbersTold):
            yield from self._numbers(told)
        elif isinstance(told, FindingTold):
            yield from self._finding(told)
        elif isinstance(told, StateTold):
            yield from self._state(told)

    def _topic(self, *names: str) -> str | None:
        topic = self._topics.of(*names)
        return None if topic is None else f"{self._prefix}/{topic}"

    def _value(self, told: ValueTold) -> Iterator[Publication]:
        sample, value = told.sample, told.sample.value
        topic = self._topic(told.bus.name, "values", sample.station, sample.name)
        if topic is None:
            self.dropped += 1
            return
        number = not isinstance(value.value, str)
        measured = not value.bit and not value.words and DEVICE_CLASSES.get(value.unit) != "energy"
        yield from self._announce(
            told.bus,
            sample.station,
            topic,
            sample.name,
            {
                "value_template": "{{ value_json.value }}",
                "json_attributes_topic": topic,
                **({"unit_of_measurement": value.unit} if value.unit and number else {}),
                **({"device_class": DEVICE_CLASSES[value.unit]} if number and value.unit in DEVICE_CLASSES else {}),
                **({"state_class": "measurement"} if number and measured else {}),
                **({"enabled_by_default": False} if value.bit else {}),
            },
        )
        content = {
            "value": value.value,
            "raw": value.raw,
            "unit": value.unit,
            "quality": int(value.quality),
            "how": value.how.value,
            "means": value.words,
            "t": iso(sample.time),
        }
        yield Publication(topic, dumps(content).encode())

    def _numbers(self, told: NumbersTold) -> Iterator[Publication]:
        names = ("health",) if told.station is None else ("nodes", told.station)
        topic = self._topic(told.bus.name, *names)
        if topic is None:
            return
        if told.station is None:
            for key, words, unit in (("health", "health", "%"), ("load", "load", "%"), ("error_rate", "errors", "%")):
                factor = "" if key == "health" else " * 100"
                template = f"{{{{ (value_json.{key}{factor}) | round(1) }}}}"
                shown: dict[str, object] = {
                    "value_template": template,
                    "unit_of_measurement": unit,
                    "state_class": "measurement",
                }
                yield from self._announce(told.bus, None, topic, words, shown, key)
        yield Publication(topic, dumps({**told.numbers, "t": iso(told.time)}).encode())

    def _finding(self, told: FindingTold) -> Iterator[Publication]:
        one, bus = told.news.finding, told.bus.name
        self._buses[bus] = told.bus
        events, stands = self._topic(bus, "findings"), self._topic(bus, "findings", one.code, one.subject)
        if events is None or stands is None:
            self.dropped += 1
            return
        payload = dumps(finding_record(told)).encode()
        yield Publication(events, payload, retain=False)
        over = told.news.what is NewsKind.GONE
        yield Publication(stands, b"" if over else payload)
        standing = self._standing.setdefault(bus, {})
        standing.pop(one.key, None)
        if not over:
            standing[one.key] = one.severity, stands
        yield from self._problem(told.bus)

    def at_the_end(self) -> Iterator[Publication]:
        """What makes findings stand no more, since nobody will say when they are over."""
        for name, standing in self._standing.items():
            for _, topic in standing.values():
                yield Publication(topic, b"")
            standing.clear()
            yield from self._problem(self._buses[name])

    @property
    def leftovers(self) -> frozenset[str]:
        """Patterns of the topics in which a run before may have left findings of the buses that were told."""
        topics = (self._topic(name, "findings") for name in self._buses)
        return frozenset(f"{topic}/#" for topic in topics if topic is not None)

    def _state(self, told: StateTold) -> Iterator[Publication]:
        self._buses[told.bus.name] = told.bus
        topic = self._topic(told.bus.name, "status")
        if topic is not None:
            yield Publication(topic, (ONLINE if told.listening else OFFLINE).encode())
        yield from self._problem(told.bus)

    def _problem(self, bus: ToldBus) -> Iterator[Publication]:
        topic = self._topic(bus.name, "problem")
        if topic is None:
            return
        yield from self._announce(bus, None, topic, "problem", {"device_class": "problem"}, kind="binary_sensor")
        bad = any(severity >= Severity.WARNING for severity, _ in self._standing.get(bus.name, {}).values())
        yield Publication(topic, b"ON" if bad else b"OFF")

    def _announce(
        self,
        bus: ToldBus,
        station: str | None,
        topic: str,
        title: str,
        shown: dict[str, object],
        key: str = "",
        kind: str = "sensor",
    ) -> Iterator[Publication]:
        """Tell Home Assistant of a topic, once."""
        name = f"{topic}/{key}" if key else topic
        if not self._discovery or name in self._discovered or len(self._discovered) >= MOST_DISCOVERED:
            return
        self._discovered.add(name)
        status = self._topic(bus.name, "status")
        whole = re.sub(r"[^A-Za-z0-9_-]+", "_", f"{self._prefix}_{bus.name}")
        unique = f"{whole}_{_number_of(name)}"
        device: dict[str, object] = {
            "identifiers": [whole],
            "name": f"bus {sanitized(bus.name)}",
            "model": bus.protocol,
        }
        if station is not None:
            profile = bus.devices.at(int(station)) if station.isdecimal() else None
            device = {
                "identifiers": [f"{whole}_{station}"],
                "name": f"{sanitized(bus.name)} {sanitized(station)}",
                "via_device": whole,
                **({"model": profile.title} if profile is not None else {}),
            }
        content = {
            "name": sanitized(title),
            "unique_id": unique,
            "state_topic": topic,
            "availability": [{"topic": self.status_topic}, {"topic": status}],
            "availability_mode": "all",
            **shown,
            "device": device,
            "origin": {"name": "sniff485", "sw_version": __version__},
        }
        yield Publication(f"{self._discovery}/{kind}/{whole}/{unique}/config", dumps(content).encode())


def _number_of(name: str) -> str:
    """A name as an identifier: readable, and another one for every name."""
    short = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[-40:]
    return f"{short}_{hashlib.blake2s(name.encode(), digest_size=4).hexdigest()}"
