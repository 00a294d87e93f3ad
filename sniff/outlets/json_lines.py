"""JSON Lines of what outlets are told: one object each, its type in the key `record`. Pure.

Keys and their order are a promise. Characters that a terminal obeys are escaped, as JSON may.
"""

from __future__ import annotations

from typing import Any

from sniff.analysis.json_text import dumps, iso
from sniff.analysis.point_reader import Sample
from sniff.outlets.told import FindingTold, NumbersTold, StateTold, Told, ToldBus, ValueTold


def line(told: Told) -> str | None:
    """The object on one line, without its end; None for what is told otherwise, too."""
    value = record(told)
    return None if value is None else dumps(value)


def record(told: Told) -> dict[str, Any] | None:
    """The object."""
    if isinstance(told, ValueTold):
        return value_record(told.bus, told.sample)
    if isinstance(told, NumbersTold):
        head = {"record": "health", "t": iso(told.time), "bus": told.bus.name}
        return head | ({} if told.station is None else {"device": told.station}) | dict(told.numbers)
    if isinstance(told, FindingTold):
        return finding_record(told)
    if isinstance(told, StateTold):
        head = {"record": "state", "t": iso(told.time), "bus": told.bus.name, "port": told.bus.port}
        return {**head, "listening": told.listening, "text": told.text}
    return None  # findings have a record of their own


def value_record(bus: ToldBus, sample: Sample) -> dict[str, Any]:
    """A value. A number that JSON has no word for is a text."""
    value = sample.value
    return {
        "record": "value",
        "t": iso(sample.time),
        "bus": bus.name,
        "device": sample.station,
        "point": sample.name,
        "value": value.value,
        "raw": value.raw,
        "unit": value.unit,
        "quality": int(value.quality),
        "how": value.how.value,
        "frame": sample.frame,
        "means": value.words,
    }


def finding_record(told: FindingTold) -> dict[str, Any]:
    """What became of a finding."""
    one = told.news.finding
    return {
        "record": "finding",
        "t": iso(told.time),
        "bus": told.bus.name,
        "what": told.news.what.value,
        "code": one.code,
        "severity": one.severity.label,
        "subject": one.subject,
        "count": one.count,
        "first": iso(one.first),
        "last": iso(one.last),
        "seen": one.seen,
        "means": one.means,
        "next": one.next,
    }
