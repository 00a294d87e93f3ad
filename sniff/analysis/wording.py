"""Rows in words, free of control characters. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.frame import Event, Frame, LineError, Noise, Place, Role
from dissectors.line import MS
from dissectors.words import milliseconds

if TYPE_CHECKING:
    from dissectors.manifest import Dissector
    from dissectors.meaning import Meaning
    from dissectors.tracker import Interval
    from sniff.engine.engine import Row


def describe(dissector: Dissector, row: Row, meaning: Meaning | None = None) -> str:
    """One line that says what a row is; before that what it means to its device, where that is known."""
    event = row.event
    if row.searched is not None:
        return f"{_octets(event)} heard while searching for the settings, with {row.searched}"
    if isinstance(event, Noise):
        return describe_noise(event)
    assert row.header is not None  # the engine peeks every frame
    role = row.placement.role if row.placement is not None else row.header.role
    return dissector.line(event, row.header, role if role is not Role.UNKNOWN else row.header.role, meaning)


def describe_briefly(dissector: Dissector, row: Row, meaning: Meaning | None, room: int, *, raw: bool = True) -> str:
    """The same where a line has `room` characters: less of what the row means, so that its numbers are seen. `raw`:
    with what stands behind that; else the raw numbers of values and questions are left out."""
    text, about = describe(dissector, row, meaning), "" if meaning is None else meaning.about
    before, found, behind = text.partition(about) if about else (text, "", "")
    if meaning is None or not found:
        return text
    behind = behind if raw or not (meaning.readings or meaning.asked) else ""
    return before + meaning.briefly(room - len(before) - bool(behind)) + behind  # "…" stands for that


def describe_noise(noise: Noise) -> str:
    """One line about octets that are no frame."""
    where = "between frames" if noise.place is Place.BETWEEN else f"{noise.place.value} a frame"
    return f"{_octets(noise)} of noise {where}: {noise.reason.value}"


def _octets(event: Event) -> str:
    count = len(event.octets)
    return f"{count} octet{'s' if count != 1 else ''}"


def station_word(protocol: str) -> str:
    """What the people of that protocol call a place on the bus; "station" where it is not known here."""
    return registry.get(protocol).noun if registry.is_known(protocol) else "station"


def mark_names(error: LineError) -> str:
    """Line errors of one octet: "parity", "parity or framing" (the driver did not tell), "break"."""
    both = LineError.PARITY | LineError.FRAMING
    names = ["parity or framing"] if both in error else []
    names += [flag.name.lower() for flag in error if flag.name and not (both in error and flag in both)]
    return ", ".join(names)


def duration(interval: Interval) -> str:
    """A duration with what the adapter allows: "38.0 ms (−0/+16 ms)"; "8.2 ms" when the times are exact."""
    low, high = interval.nominal - interval.low, interval.high - interval.nominal
    if not low and not high:
        return milliseconds(interval.nominal)
    return f"{milliseconds(interval.nominal)} (−{_short(low)}/+{_short(high)} ms)"


def _short(value: int) -> str:
    ms = value / MS
    return f"{ms:.0f}" if ms >= 10 or ms == int(ms) else f"{ms:.1f}" if ms >= 0.1 else f"{ms:.2f}"


def is_error(row: Row) -> bool:
    """Whether a row itself is trouble: noise, or a frame that is not good. What a search heard is neither."""
    return row.searched is None and (not isinstance(row.event, Frame) or not row.event.ok)
