"""The PDUs of Modbus as scapy packets: the full layout of every message, to look at one and to craft one.

    bytes(ReadHoldingRegistersRequest(startAddr=0x2520, quantity=2))  ==  bytes.fromhex("0325200002")

The classes are made of `layout.py` and have the names that `scapy.contrib.modbus` gives fields. Its own classes are not
used: they take 130 ms to import, and several lose octets (scapy 2.8): lists of over 100 coils or registers (it raises),
a write-file request (cannot be built again), the server id (cannot be read), the event log (fixed count), the exception
status (named startAddr), diagnostics with an odd octet, exceptions (no vendor codes, two names for the code).

A class is named like its message: `PACKETS` has all of them, and each can be imported by its name. A message cut short
has the fields that are there and the rest as `Cut`; octets too many are `Raw`. Nothing is lost: `bytes(packet)` gives
back what was dissected.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, ClassVar

from scapy.fields import (
    BitFieldLenField,
    ByteEnumField,
    ByteField,
    FieldListField,
    ShortField,
    StrField,
    StrLenField,
    XByteField,
    XShortEnumField,
    XShortField,
)
from scapy.packet import Packet, Raw

from dissectors.modbus.functions import EXCEPTION_BIT, EXCEPTIONS
from dissectors.modbus.header import kind_of
from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.notation import Field as Declared
from dissectors.modbus.notation import Group, Means, Message


class Cut(Raw):
    """What remains of a message that ends in the middle of a field."""

    name = "Cut short"


class Pdu(Packet):
    """Dissects as far as the octets go, and keeps those that follow."""

    def do_dissect(self, s: bytes) -> bytes:
        read = []
        for field in self.fields_desc:
            try:
                s, self.fields[field.name] = field.getfield(self, s)
            except (struct.error, IndexError):
                break
            read.append(field)
        if len(read) < len(self.fields_desc):
            object.__setattr__(self, "fields_desc", read)  # a field that is not there has no value to show
        self.explicit = 1
        return s

    def extract_padding(self, s: bytes) -> tuple[bytes, None]:
        return s, None

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return Cut if len(self.fields_desc) < len(type(self).fields_desc) else Raw


class _WholeItems(FieldListField):
    """A list of any length that leaves half an item, at the end of a cut message, to what follows."""

    def getfield(self, pkt: Packet, s: bytes) -> tuple[bytes, list[int]]:
        size = struct.calcsize(self.field.fmt)
        there = len(s) // size
        wanted = there if self.count_from is None else min(there, self.count_from(pkt))
        values = [self.field.getfield(pkt, s[i * size : (i + 1) * size])[1] for i in range(wanted)]
        return s[wanted * size :], values


# --- fields of the layout --------------------------------------------------------------------------------------------

_SINGLE: dict[tuple[int, bool], Any] = {
    (1, False): XByteField,
    (1, True): ByteField,
    (2, False): XShortField,
    (2, True): ShortField,
}
"""By octets, and whether people count in it: in groups are numbers of files and objects, else addresses and values."""


def _fields(message: Message, *, grouped: bool = False) -> list[Any]:
    """The fields of a message, or of a group. A count whose list follows is computed where it is None."""
    items = message[-1] if message and message[-1].is_list else None
    counts = [each for each in message if items is not None and _counts(each, items)]
    return [
        _list(each, message, counts) if each.is_list else _single(each, message, each in counts, grouped)
        for each in message
        if each.means is not Means.GROUPS
    ]


def _counts(each: Declared, items: Declared) -> bool:
    """Whether a field tells how long the list is, in whole items."""
    if each.means is Means.BYTES:
        return True
    return each.means is Means.QUANTITY and items.means is Means.REGISTERS


def _single(each: Declared, message: Message, computed: bool, grouped: bool) -> Any:
    items = message[-1]
    if computed and items.means is Means.GROUPS:
        return ByteField(each.scapy, None)
    if computed and items.means is Means.TEXT:
        return BitFieldLenField(each.scapy, None, 8 * each.size, length_of=items.scapy)
    if computed and (each.means is Means.BYTES or each is _last_quantity(message)):
        octets, more = (items.size, _beside(each, message)) if each.means is Means.BYTES else (1, 0)
        return BitFieldLenField(
            each.scapy, None, 8 * each.size, count_of=items.scapy, adjust=lambda pkt, n: n * octets + more
        )
    if each.names is not None:
        return (ByteEnumField if each.size == 1 else XShortEnumField)(each.scapy, each.default, dict(each.names))
    return _SINGLE[each.size, grouped](each.scapy, each.default)


def _last_quantity(message: Message) -> Declared | None:
    return next((each for each in reversed(message) if each.means is Means.QUANTITY), None)


def _beside(count: Declared, message: Message) -> int:
    """Octets of single fields behind a byte count."""
    behind = message[message.index(count) + 1 :]
    return sum(each.size for each in behind if not each.is_list)


def _list(each: Declared, message: Message, counts: list[Declared]) -> Any:
    count = next((one for one in counts if one.means is Means.BYTES), counts[-1] if counts else None)
    if each.means is Means.TEXT and count is not None:
        name = count.scapy
        return StrLenField(each.scapy, b"", length_from=lambda pkt: pkt.getfieldval(name))
    item = XShortField("", 0) if each.size == 2 else XByteField("", 0)
    return _WholeItems(each.scapy, [], item, count_from=_count_from(each, count, message))


def _count_from(each: Declared, count: Declared | None, message: Message) -> Callable[[Packet], int] | None:
    if count is None:
        return None
    name, size, more = count.scapy, 1, 0
    if count.means is Means.BYTES:
        size, more = each.size, _beside(count, message)

    def items(pkt: Packet) -> int:
        there: int = pkt.getfieldval(name)
        return max(0, there - more) // size

    return items


# --- messages of the layout ------------------------------------------------------------------------------------------


def _class(name: str, base: type[Pdu], **members: Any) -> Any:
    """A class named like it, without the blanks."""
    class_name = name.replace(" ", "").replace("/", "").replace("ID", "Id").replace("FIFO", "Fifo")
    PACKETS[class_name] = made = type(class_name, (base,), {"name": name, **members, "__module__": __name__})
    return made


class _Group(Pdu):
    """One group of many; they follow each other as payloads. `least`: octets of its single fields."""

    least = 0

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        return type(self) if len(payload) >= self.least else super().guess_payload_class(payload)


class _Grouped(Pdu):
    """What stands before the groups; a byte count is computed where it is None. `count`: the field that counts."""

    group: type[Packet] = Raw
    count = ""

    def guess_payload_class(self, payload: bytes) -> type[Packet]:
        whole = len(self.fields_desc) == len(type(self).fields_desc)
        counted = self.count == "byteCount" or (whole and self.getfieldval(self.count))
        return self.group if counted else super().guess_payload_class(payload)

    def post_build(self, pkt: bytes, pay: bytes) -> bytes:
        if len(self.fields_desc) > 1 and self.count == "byteCount" and self.byteCount is None:
            pkt = pkt[:1] + bytes((len(pay) & 0xFF,))
        return pkt + pay


def _message(code: int, name: str, message: Message) -> Any:
    fields = [XByteField("funcCode", code), *_fields(message)]
    if not message or message[-1].means is not Means.GROUPS:
        return _class(name, Pdu, fields_desc=fields)
    groups = message[-1]
    return _class(name, _Grouped, fields_desc=fields, count=message[-2].scapy, group=_group(groups))


def _group(groups: Declared) -> Any:
    made = _GROUPS.get(groups.group_name)
    if made is None:
        least, fields = Group.of(groups.group).size, _fields(groups.group, grouped=True)
        made = _GROUPS[groups.group_name] = _class(groups.group_name, _Group, fields_desc=fields, least=least)
    return made


PACKETS: dict[str, Any] = {}
"""The classes by name."""

_GROUPS: dict[str, Any] = {}

REQUESTS = {code: _message(code, f"{each.title} Request", each.request) for code, each in MESSAGES.items()}
RESPONSES = {code: _message(code, f"{each.title} Response", each.response) for code, each in MESSAGES.items()}


def __getattr__(name: str) -> Any:
    try:
        return PACKETS[name]
    except KeyError:
        raise AttributeError(f"module {__name__} has no packet {name}") from None


# --- what no layout tells --------------------------------------------------------------------------------------------


class EncapsulatedInterface(Pdu):
    """Function 43 with another MEI type than 14, either direction."""

    name = "Encapsulated Interface"
    fields_desc: ClassVar = [XByteField("funcCode", 43), XByteField("MEIType", 13), StrField("data", b"")]


class ExceptionResponse(Pdu):
    """Function code with bit 7 set, and why. Codes that the standard does not name are a vendor's."""

    name = "Exception Response"
    fields_desc: ClassVar = [
        ByteEnumField("funcCode", 0x83, {c | EXCEPTION_BIT: f"exception of {kind_of(c)}" for c in range(128)}),
        ByteEnumField("exceptCode", 1, {c: EXCEPTIONS.get(c) or f"vendor 0x{c:02X}" for c in range(256)}),
    ]


class OtherFunction(Pdu):
    """A function code that no table knows, or a message whose length fits neither direction."""

    name = "Other Function"
    fields_desc: ClassVar = [XByteField("funcCode", 0x41), StrField("data", b"")]


def pdu_class(octets: bytes, response: bool) -> Any:
    """The class of the PDU that begins with these octets, in one direction. Total."""
    if not octets:
        return Raw
    code = octets[0]
    if code & EXCEPTION_BIT:
        return ExceptionResponse
    if code == 43 and octets[1:2] not in (b"\x0e", b""):
        return EncapsulatedInterface
    return (RESPONSES if response else REQUESTS).get(code, OtherFunction)
