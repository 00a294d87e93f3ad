"""The notation of the layout: what a field is, and what follows from a row of fields.

[unit][function][field][field] … [check]
  0       1       2                          places count from the unit
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, NamedTuple

HEAD: Final = 2
"""Octets before a message's first field: unit and function."""

CHECK: Final = 2
"""Octets behind its last: the CRC."""


class Means(Enum):
    """What a field is to a reader who does not know the function. The second half fills what is left of a message."""

    ADDRESS = auto()  # of the first of what is meant
    QUANTITY = auto()  # how many of them
    BYTES = auto()  # octets that follow it, up to the check; in a group: up to the end of the group
    VALUE = auto()  # of one coil or register
    NUMBER = auto()  # anything else
    SELECTOR = auto()  # a number that says how the rest is to be read

    BITS = auto()  # eight an octet, the first in bit 0
    REGISTERS = auto()  # two octets each
    OCTETS = auto()  # one by one
    TEXT = auto()  # what a vendor wrote there
    WORD = auto()  # as the selector says; two octets, or, of loop-back data, any number
    GROUPS = auto()  # `group` again and again


@dataclass(frozen=True, slots=True)
class Field:
    """One field. `size`: octets; of a list, those of one item.

    `among`: values that a healthy device sends; else the frame is implausible. `least` (BYTES): below it there is no
    such message. `only`: the rest is as declared for this value alone; for others nobody knows it. `names`: of values.
    `default`: of crafted packets. `group`: the fields of each group; `group_name`: what a packet calls it.
    """

    means: Means
    size: int
    wireshark: str = ""
    scapy: str = ""
    among: Collection[int] | None = None
    least: int = 0
    only: int | None = None
    names: Mapping[int, str] | None = None
    default: int = 0
    group: tuple[Field, ...] = ()
    group_name: str = ""

    @property
    def is_list(self) -> bool:
        """Whether it fills what is left."""
        return self.means in _LISTS

    @property
    def bits(self) -> int:
        """Bits of one item of a list."""
        return 1 if self.means is Means.BITS else 8 * self.size


_LISTS: Final = frozenset((Means.BITS, Means.REGISTERS, Means.OCTETS, Means.TEXT, Means.WORD, Means.GROUPS))

Message = tuple[Field, ...]
"""The fields behind the function code, in order."""


class SubFunction(NamedTuple):
    """A sub-function of diagnostics. `data`: what request and answer hold; `counter`: what only the answer holds, and
    the request as 0000 (else the answer repeats the request); without either nothing is known of its word."""

    name: str
    data: Field | None = None
    counter: Field | None = None


@dataclass(frozen=True, slots=True)
class Messages:
    """A public function code and its two messages.

    `name`: stable, lower-case, hyphens. `short`: for one-line texts. `title`: of packets. `space`: whose addresses it
    names ("coil", "discrete", "holding", "input"). `writes`: a write type, the only kind that may be broadcast (Modbus
    over Serial Line V1.02, 2.1). `echoes`: a normal response repeats the request octet for octet. `repeats`: leading
    fields of the request that a normal response repeats.
    """

    code: int
    name: str
    short: str
    title: str
    request: Message
    response: Message
    space: str = ""
    writes: bool = False
    echoes: bool = False
    repeats: int = 0


class FieldPlace(NamedTuple):
    """A field and where it stands: `at` octets from the unit."""

    at: int
    field: Field


@dataclass(frozen=True, slots=True)
class Counted:
    """What a byte count counts. `beside`: octets of single fields between it and the list `items`. `quantity`: the
    field that tells the number of items, where one does."""

    count: FieldPlace
    beside: int
    items: Field
    quantity: FieldPlace | None

    @property
    def start(self) -> int:
        """Where the items begin."""
        return self.count.at + self.count.field.size + self.beside


class Group(NamedTuple):
    """One of many alike. `size`: octets of its single fields. `type_at`, `type`: where an octet stands that is the same
    in all. `count_at`: where an octet counts what follows it; `many_at`: where a word tells the registers behind."""

    size: int
    type_at: int = 0
    type: int | None = None
    count_at: int | None = None
    many_at: int | None = None

    @classmethod
    def of(cls, fields: Message) -> Group:
        """What a group of these fields is."""
        at, type_at, known, count_at, many_at = 0, 0, None, None, None
        for each in fields:
            if each.is_list:
                continue
            if each.only is not None:
                type_at, known = at, each.only
            elif each.means is Means.BYTES:
                count_at = at
            elif each.means is Means.QUANTITY and fields[-1].is_list:
                many_at = at
            at += each.size
        return cls(at, type_at, known, count_at, many_at)

    def is_begin(self, octets: bytes | bytearray, at: int) -> bool:
        """Whether one begins at `at`, where its single fields are wholly there."""
        return (self.type is None or octets[at + self.type_at] == self.type) and self.whole(octets, at) >= self.size

    def whole(self, octets: bytes | bytearray, at: int) -> int:
        """Octets of the one that begins at `at`, as it says itself."""
        if self.count_at is not None:
            return self.count_at + 1 + octets[at + self.count_at]
        if self.many_at is not None:
            return self.size + 2 * (octets[at + self.many_at] << 8 | octets[at + self.many_at + 1])
        return self.size


def places(message: Message) -> tuple[FieldPlace, ...]:
    """The fields that always stand at the same place; the list that fills the rest is the last of them."""
    found, at = [], HEAD
    for each in message:
        found.append(FieldPlace(at, each))
        at += each.size
    return tuple(found)


def first(message: Message, means: Means) -> FieldPlace | None:
    """The first field that means that."""
    return next((place for place in places(message) if place.field.means is means), None)


def last(message: Message, means: Means) -> FieldPlace | None:
    """The last field that means that: of a message that reads and writes, what is written."""
    return next((place for place in reversed(places(message)) if place.field.means is means), None)


def fixed_length(message: Message) -> int | None:
    """Octets of the RTU frame; None where a count tells."""
    if any(each.means in _COUNTED for each in message):
        return None
    return HEAD + sum(each.size for each in message) + CHECK


def counted(message: Message) -> Counted | None:
    """What the byte count of a message counts; None where there is none."""
    count = first(message, Means.BYTES)
    if count is None:
        return None
    after = [place.field for place in places(message) if place.at > count.at]
    beside = sum(each.size for each in after if not each.is_list)
    return Counted(count, beside, message[-1], last(message, Means.QUANTITY))


def has_text(message: Message) -> bool:
    """Whether a vendor's text stands in it, by itself or in its groups."""
    return any(each.means is Means.TEXT or has_text(each.group) for each in message)


def octets_of(items: Field, quantity: int) -> int:
    """Octets that so many items take."""
    return quantity * items.bits + 7 >> 3


_COUNTED: Final = frozenset((Means.BYTES, Means.GROUPS))
