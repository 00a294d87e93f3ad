"""Literals of a filter: the value of the type that they are compared with. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from decimal import Decimal, InvalidOperation
from typing import Any

from dissectors.field_types import FieldType, Kind, plain_word
from sniff.filter.errors import FilterError, nearest
from sniff.filter.syntax import Quoted, Word

Literal = Word | Quoted
Scalar = int | float | str | bytes

NS = 1_000_000_000
DAY = 86_400 * NS

UNITS = {
    "ns": 1,
    "us": 1_000,
    "µs": 1_000,
    "ms": 1_000_000,
    "s": NS,
    "min": 60 * NS,
    "m": 60 * NS,
    "h": 3600 * NS,
    "d": DAY,
}
_DURATION = re.compile(r"(?P<number>\d+(?:\.\d*)?|\.\d+)\s*(?P<unit>ns|us|µs|ms|min|s|m|h|d)?")
_CLOCK = re.compile(r"(\d{1,2}):(\d\d)(?::(\d\d)(?:\.(\d{1,9}))?)?")
_DATE = re.compile(r"(\d{4})-(\d\d)-(\d\d)(?:[T ](\d{1,2}:\d\d(?::\d\d(?:\.\d{1,9})?)?)\s*(Z|[+-]\d\d:?\d\d)?)?")
_HEX = re.compile(r"(?:0x)?[0-9A-Fa-f]+|[0-9A-Fa-f]{2}(?:[:.-][0-9A-Fa-f]{2})+:?")
_TRUTHS = {"true": 1, "false": 0, "1": 1, "0": 0}
_MOST_NUMBER = 40
"""Characters of a number."""


@dataclass(frozen=True, slots=True)
class Instant:
    """A time as it was written: `time` ns since the epoch, or since midnight where `daily`; anything within `step` ns
    behind it is the same time. `zoned`: a zone stands beside it. `east`: ns by which clocks are ahead of UTC, of a time
    of day."""

    time: int
    step: int
    daily: bool = False
    zoned: bool = False
    east: int = 0

    def local(self, zone: Callable[[int], int], started: int) -> Instant:
        """The same as the clocks of people have it. `zone`: by how many ns they are ahead of UTC at a time; `started`:
        when, for times of day."""
        if self.daily:
            return replace(self, east=zone(started))
        return self if self.zoned else replace(self, time=self.time - zone(self.time - zone(self.time)))

    def of(self, time: Any) -> Any:
        """Times as this one is to be compared with: of every day, where it is one of a day."""
        return (time + self.east) % DAY if self.daily else time

    def one_day(self, least: int, most: int) -> int | None:
        """What is to be taken from all times from one to another; None where they are of several days."""
        if not self.daily:
            return 0
        day = (least + self.east) // DAY
        return day * DAY - self.east if day == (most + self.east) // DAY else None


def value_of(
    written: Literal, type: FieldType, name: str, stations: Mapping[str, tuple[int, ...]], spelled: bool = False
) -> tuple[Scalar | Instant, ...]:
    """What was written, as a value of a type: several where a name stands for several. Raises FilterError."""
    kind = type.kind
    if kind is Kind.STATION:
        return _station(written, name, stations)
    if kind is Kind.DURATION:
        return (_duration(written, type, name),)
    if kind is Kind.TIME:
        return (instant(written, name),)
    if kind is Kind.OCTETS:
        return (_octets(written, name, spelled),)
    if kind is Kind.TEXT:
        return (_text(written, type, name),)
    if kind is Kind.ANY:
        number = None if isinstance(written, Quoted) else number_of(written.text)
        return (written.text if number is None else number,)
    return (_number(written, type, name),)


def number_of(text: str) -> int | float | None:
    """A number as it may be written: 16, 0x10, 010 (ten), 1.5, 2e3; None for anything else."""
    if len(text) > _MOST_NUMBER or not text or not (text[0].isdigit() or text[0] in "-."):
        return None
    for read in (lambda: int(text, 0), lambda: int(text), lambda: float(text)):
        try:
            found: int | float = read()
        except ValueError:
            continue
        if isinstance(found, float) and found.is_integer() and abs(found) < 1 << 53:
            return int(found)
        return found
    return None


def _number(written: Literal, type: FieldType, name: str) -> int | float:
    word = _worded(written.text, type)
    number = None if isinstance(written, Quoted) else number_of(written.text)
    if number is not None:
        if type.kind is Kind.TRUTH and number not in (0, 1):
            raise FilterError(f"{name} is 0 or 1, not {written.text}", written.column)
        return number
    if isinstance(word, int):
        return word
    if type.kind is Kind.TRUTH:
        truth = _TRUTHS.get(written.text.lower())
        if truth is not None and not isinstance(written, Quoted):
            return truth
        raise FilterError(f"{name} is true or false, not {written.text!r}", written.column)
    if type.words:
        raise FilterError(f"unknown {name} {written.text!r} ({nearest(written.text, type.words)})", written.column)
    if number_of(written.text) is not None:
        raise FilterError(f"{name} is a number: write {written.text} without quotes", written.column)
    raise FilterError(f"{name} is a number, {written.text!r} is not", written.column)


def _worded(text: str, type: FieldType) -> int | str | None:
    """The value of a word; None where there is no such word."""
    wanted = plain_word(text)
    lowered = text.lower()
    for word, value in type.words.items():
        if word.lower() == lowered:
            return value
    if not wanted:
        return None
    return next((value for word, value in type.words.items() if plain_word(word) == wanted), None)


def is_word_of(text: str, type: FieldType) -> bool:
    """Whether a type knows a word."""
    return _worded(text, type) is not None


def _station(written: Literal, name: str, stations: Mapping[str, tuple[int, ...]]) -> tuple[int | float, ...]:
    known = stations.get(written.text.lower())
    if known is not None:
        return known
    number = None if isinstance(written, Quoted) else number_of(written.text)
    if number is None:
        hint = f"; by name: {nearest(written.text, stations)}" if stations else "; no station has a name here"
        raise FilterError(f"{name} is a station's address, {written.text!r} is none{hint}", written.column)
    return (number,)


def _duration(written: Literal, type: FieldType, name: str) -> int:
    match = _DURATION.fullmatch(written.text.strip()) if len(written.text) < _MOST_NUMBER else None
    if match is None:
        raise FilterError(
            f"{name} is a duration, {written.text!r} is none (5ms, 1.5s, 250us; alone in {type.unit or 's'})",
            written.column,
        )
    try:
        return int(Decimal(match["number"]) * UNITS[match["unit"] or type.unit or "s"])
    except InvalidOperation:
        raise FilterError(f"{name} is a duration, {written.text!r} is none", written.column) from None


def instant(written: Literal, name: str) -> Instant:
    """A time: "10:02", "10:02:03.5", "2026-03-01", "2026-03-01T10:02:03.5Z"; UTC where no zone is said."""
    text = written.text.strip()
    clock, date = _CLOCK.fullmatch(text), _DATE.fullmatch(text)
    try:
        if clock is not None:
            time, step = _clock(clock)
            return Instant(time, step, daily=True)
        if date is not None:
            day = datetime(int(date[1]), int(date[2]), int(date[3]), tzinfo=UTC)
            begin = int(day.timestamp()) * NS
            if date[4] is None:
                return Instant(begin, DAY)
            inner = _CLOCK.fullmatch(date[4])
            assert inner is not None
            time, step = _clock(inner)
            return Instant(begin + time - _zone(date[5]), step, zoned=date[5] is not None)
    except ValueError:
        pass
    raise FilterError(
        f'{name} is a time, {written.text!r} is none ("10:02", "10:02:03.5", "2026-03-01T10:02:03Z")', written.column
    )


def _clock(match: re.Match[str]) -> tuple[int, int]:
    hours, minutes, seconds = int(match[1]), int(match[2]), int(match[3] or 0)
    if hours > 23 or minutes > 59 or seconds > 59:
        raise ValueError
    fraction = match[4] or ""
    time = (hours * 3600 + minutes * 60 + seconds) * NS + int(fraction.ljust(9, "0"))
    step = 60 * NS if match[3] is None else 10 ** (9 - len(fraction))
    return time, step


def _zone(text: str | None) -> int:
    if text is None or text == "Z":
        return 0
    hours, minutes = int(text[1:3]), int(text[-2:])
    return (1 if text[0] == "+" else -1) * (hours * 60 + minutes) * 60 * NS


def _octets(written: Literal, name: str, spelled: bool) -> bytes:
    text = written.text
    if isinstance(written, Quoted) and not (spelled and _HEX.fullmatch(text.replace(" ", ""))):
        if spelled:
            raise FilterError(f"{name} is compared with hex digits, {text!r} are none", written.column)
        return text.encode("utf-8")
    text = text.replace(" ", "") if isinstance(written, Quoted) else text
    if not _HEX.fullmatch(text):
        raise FilterError(f'{name} is compared with octets such as 03:00 or "text", not {text!r}', written.column)
    digits = re.sub(r"^0x|[:.-]", "", text)
    if len(digits) == 1:
        digits = f"0{digits}"
    if len(digits) % 2:
        raise FilterError(f"{text!r} ends in half an octet", written.column)
    return bytes.fromhex(digits)


def _text(written: Literal, type: FieldType, name: str) -> str:
    text = written.text
    word = _worded(text, type)
    if isinstance(word, str):
        return word
    if type.closed and not (type.also and re.fullmatch(type.also, text, re.IGNORECASE)):
        raise FilterError(f"unknown {name} {text!r} ({nearest(text, type.words)})", written.column)
    if isinstance(written, Word) and not type.digits and number_of(text) is not None:
        raise FilterError(f'{name} is a text: write "{text}" in quotes', written.column)
    return text
