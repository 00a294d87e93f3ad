"""Limits of what a request may ask for, compiled from the layout: how many, which values, up to which address.

    01 03 00 00 00 C8     200 registers, where 1 … 125 may be asked for
    01 05 00 03 00 01     a coil is set with FF00 and cleared with 0000
    01 03 FF FF 00 02     the second register would be 0x10000

Some devices allow more, so that such a request is a fault only where the device refuses it (Modbus Application
Protocol V1.1b3, clause 6: exception 3 of a quantity or a value, 2 of an address).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import Means, Message, places

ILLEGAL: Final = frozenset((2, 3))
"""Exceptions that refuse such a request: illegal data address, illegal data value."""

_ADDRESSES: Final = 0x10000


class _Limit(NamedTuple):
    """A number of a request: its first octet, counted from the unit; which may stand there, and in words; whether it
    tells how many there are from the address before it on."""

    at: int
    among: Collection[int]
    words: str
    from_address: int | None


def beyond_limits(octets: bytes) -> str | None:
    """What a request asks for that no request may, in words; unit and PDU. None where it may. Total."""
    for limit in _LIMITS.get(octets[1], ()) if len(octets) > 1 else ():
        if len(octets) < limit.at + 2:
            return None
        number = _word(octets, limit.at)
        if number not in limit.among:
            return limit.words.format(number)
        if limit.from_address is not None and _word(octets, limit.from_address) + number > _ADDRESSES:
            return f"{number} from address 0x{_word(octets, limit.from_address):04X} on, beyond the last one 0xFFFF"
    return None


def _word(octets: bytes, at: int) -> int:
    return octets[at] << 8 | octets[at + 1]


def _limits(message: Message, space: str) -> tuple[_Limit, ...]:
    made: list[_Limit] = []
    address: int | None = None
    for at, field in places(message):
        if field.means is Means.ADDRESS:
            address = at
        elif field.among is not None and field.size == 2 and field.means in (Means.QUANTITY, Means.VALUE):
            counted = address if field.means is Means.QUANTITY else None
            made.append(_Limit(at, field.among, _in_words(field.among, field.means, space), counted))
            address = None
    return tuple(made)


def _in_words(among: Collection[int], means: Means, space: str) -> str:
    if means is Means.QUANTITY:
        thing = "registers" if space in ("holding", "input") else "coils" if space == "coil" else "inputs"
        return f"{{}} {thing} at once, where 1 … {max(among)} are allowed"
    return "value 0x{:04X} for a " + space + ", where " + " and ".join(f"{one:04X}" for one in among) + " are allowed"


_LIMITS: Final[Mapping[int, tuple[_Limit, ...]]] = {
    code: limits
    for code, messages in MESSAGES.items()
    if messages.space and (limits := _limits(messages.request, messages.space))
}
