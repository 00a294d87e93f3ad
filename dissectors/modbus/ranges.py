"""Ranges of a message: its addresses, how many, and which byte count must agree: compiled from the layout.

request 03    first address in octets 2, 3, how many in 4, 5          answer 03    half of octet 2 is how many
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import Field, FieldPlace, Means, Message, Messages, counted, first


class Number(NamedTuple):
    """A number in a message: its first octet, counted from the unit, how many it has, and by what it is divided."""

    at: int
    size: int
    divisor: int = 1


class Range(NamedTuple):
    """What a message is about. `single`: one thing, without a number that says so."""

    address: Number | None
    quantity: Number | None
    single: bool = False


class Agreement(NamedTuple):
    """A quantity, and the octet behind it that counts what so many items of so many bits take."""

    quantity_at: int
    count_at: int
    bits: int


def _range(message: Message, writes: bool) -> Range | None:
    """What a message is about; None where it names neither an address nor how many."""
    address = _plain(first(message, Means.ADDRESS))
    quantity = _plain(first(message, Means.QUANTITY)) or _shared_out(message)
    single = writes and address is not None and quantity is None
    return Range(address, quantity, single) if address or quantity else None


def _plain(place: FieldPlace | None) -> Number | None:
    return None if place is None else Number(place.at, place.field.size)


def _shared_out(message: Message) -> Number | None:
    """A byte count that counts nothing but items of a fixed size, of more than one octet."""
    count = counted(message)
    if count is None or count.beside:
        return None
    items = count.items
    size = items.size if items.means is Means.REGISTERS else sum(each.size for each in items.group)
    if not size or any(each.is_list for each in items.group):
        return None
    return Number(count.count.at, count.count.field.size, size)


def _shared(messages: Messages) -> Message:
    """The fields that stand at the same places in both directions."""
    same: list[Field] = []
    for asked, answered in zip(messages.request, messages.response, strict=False):
        if asked != answered:
            break
        same.append(asked)
    return tuple(same)


def _ranges(by_code: Mapping[int, Message]) -> dict[int, Range]:
    ranges = {code: _range(message, MESSAGES[code].writes) for code, message in by_code.items()}
    return {code: told for code, told in ranges.items() if told is not None}


ASKED: Final = _ranges({code: messages.request for code, messages in MESSAGES.items()})
ANSWERED: Final = _ranges({code: messages.response for code, messages in MESSAGES.items()})
SHARED: Final = _ranges({code: _shared(messages) for code, messages in MESSAGES.items()})
"""What requests are about, what answers are about, and what both say at the same place."""


def _agreement(message: Message) -> Agreement | None:
    count = counted(message)
    if count is None or count.quantity is None or count.quantity.at > count.count.at:
        return None
    return Agreement(count.quantity.at, count.count.at, count.items.bits)


AGREEMENTS: Final[Mapping[int, Agreement]] = {
    code: agreement for code, messages in MESSAGES.items() if (agreement := _agreement(messages.request)) is not None
}
"""Of requests that write many."""

SINGLE_WRITES: Final = frozenset(
    code for code, messages in MESSAGES.items() if messages.writes and first(messages.request, Means.VALUE) is not None
)
"""Writes of one coil or register."""

RANGES_REPEATED: Final = frozenset(
    code for code, messages in MESSAGES.items() if messages.repeats and AGREEMENTS.get(code) is not None
)
"""Functions whose answer repeats address and quantity of the request."""
