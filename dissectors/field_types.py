"""The fields of a protocol: their types, the words of their numbers, and where a plain frame has them.

Filters, lists of fields and completion ask here. A protocol gives `Dissector.field_types`, a function that makes the
table of all names that `Dissector.fields` may give; it may also say what the columns `kind` and `func` can hold.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum


class Kind(Enum):
    """What a value is."""

    NUMBER = "number"
    TEXT = "text"
    OCTETS = "octets"
    TRUTH = "truth"  # 0 or 1
    STATION = "station"  # an address on the bus
    DURATION = "duration"
    TIME = "time"
    ANY = "anything"  # of a plug-in that does not say


@dataclass(frozen=True, slots=True)
class FieldType:
    """One field.

    `says`: what it holds, for a list of fields. `words`: names of values, as people read them; a value may have
    several. `closed`: a text that is always one of the words, or fits `also`. `unit`: of durations, "ms" or "s": what
    a bare number is. `quoted`: texts of digits may stand without quotes. `octet`: the octet of a good frame that holds
    it, `mask`: which of its bits, where that can be said. `several`: whether a comma parts values. `least`, `most`: of
    a whole number, as wide as it is on the wire; None: it may be any number, also a broken one. `by_request`: answers
    have it too, as far as their request tells it (`Dissector.answer_fields`). `never`: a column that stays empty.
    """

    kind: Kind
    says: str = ""
    words: Mapping[str, int | str] = field(default_factory=dict)
    closed: bool = False
    also: str = ""
    unit: str = ""
    digits: bool = False
    octet: int | None = None
    mask: int = 0xFF
    several: bool = True
    least: int | None = None
    most: int | None = None
    by_request: bool = False
    never: bool = False


FieldTypes = Mapping[str, FieldType]


def plain_word(text: str) -> str:
    """A name as it is compared: "Read Holding Registers", "read-holding-registers" and "readHoldingRegisters" are one.

    >>> plain_word("confirmedCOVNotification")
    'confirmed-cov-notification'
    """
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", text)
    if text[:6] == "BACnet":
        parted = "bacnet" + parted[parted.index("t") + 1 :]
    return re.sub(r"[^a-z0-9]+", "-", parted.lower()).strip("-")


def named(table: Mapping[int, str], *others: Mapping[str, int]) -> dict[str, int | str]:
    """Words of an enumeration, and other names for the same numbers behind them."""
    words: dict[str, int | str] = {}
    for number, name in table.items():
        words.setdefault(name, number)
    for other in others:
        for name, number in other.items():
            words.setdefault(name, number)
    return words


def texts(words: Iterable[str]) -> dict[str, int | str]:
    """Words that stand for themselves."""
    return {word: word for word in words}


def whole(bits: int, says: str = "", words: Mapping[str, int | str] | None = None) -> FieldType:
    """A whole number of so many bits, from 0."""
    return FieldType(Kind.NUMBER, says, words or {}, least=0, most=(1 << bits) - 1)


def station(most: int = 0xFF, says: str = "") -> FieldType:
    """An address on the bus."""
    return FieldType(Kind.STATION, says, least=0, most=most)


def table(prefix: str, text: str) -> dict[str, FieldType]:
    """Fields from lines "name kind what it says"; `prefix` is put before each name. "number16": of 16 bits."""
    found: dict[str, FieldType] = {}
    for line in text.strip().splitlines():
        name, kind, *says = line.split(None, 2)
        sort = kind.rstrip("0123456789")
        type = FieldType(Kind(sort), " ".join(says))
        found[prefix + name] = replace(type, least=0, most=(1 << int(kind[len(sort) :])) - 1) if sort != kind else type
    return found
