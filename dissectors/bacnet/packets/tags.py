"""The parameters of a service as scapy packets: tag by tag, each with what it means."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from scapy.fields import (
    BitEnumField,
    BitField,
    ByteField,
    ConditionalField,
    Field,
    IntField,
    PacketListField,
    ShortField,
    XStrLenField,
)
from scapy.packet import Packet

from dissectors.bacnet import codec, services
from dissectors.bacnet.packets.outlines import outlined
from dissectors.bacnet.values import APPLICATION, escape, primitive, show
from dissectors.meaning import Node

_TAGS_MAX = 3000
"""Tags that are taken apart, more than any single frame holds: of a longer message in segments the rest is octets."""


def _wide(pkt: Any) -> bool:
    """Whether octets of length follow the tag."""
    return bool(pkt.lvt == 5)


def _content(pkt: Any) -> int:
    if pkt.context and pkt.lvt >= 6:
        return 0
    if not pkt.context and (pkt.extended_number if pkt.number == 15 else pkt.number) == 1 and pkt.lvt < 5:
        return 0
    if pkt.lvt < 5:
        return int(pkt.lvt)
    if pkt.lvt > 5:
        return 0
    if pkt.length_8 == 254:
        return int(pkt.length_16)
    return int(pkt.length_32 if pkt.length_8 == 255 else pkt.length_8)


class _Meaning(Field):
    """Words about a tag; not on the wire."""

    def getfield(self, pkt: Any, s: bytes) -> tuple[bytes, Any]:
        return s, _plain_meaning(pkt)

    def addfield(self, pkt: Any, s: bytes, val: Any) -> bytes:
        return s

    def i2repr(self, pkt: Any, x: Any) -> str:
        return str(x or "")


def _plain_meaning(pkt: Any) -> str:
    if pkt.context:
        return {6: "opening", 7: "closing"}.get(pkt.lvt, "")
    number = pkt.extended_number if pkt.number == 15 else pkt.number
    if number >= len(APPLICATION):
        return ""
    content = bytes((pkt.lvt,)) if number == 1 and pkt.lvt < 5 else bytes(pkt.value or b"")
    try:
        return escape(f"{APPLICATION[number]} {show(primitive(APPLICATION[number], content))}")
    except ValueError:
        return f"no valid {APPLICATION[number]}"


class Tag(Packet):
    """One tag: primitive, opening or closing."""

    name = "Tag"
    fields_desc: ClassVar[list[Any]] = [
        BitField("number", 0, 4),
        BitEnumField("context", 0, 1, {0: "application", 1: "context"}),
        BitField("lvt", 0, 3),
        ConditionalField(ByteField("extended_number", 0), lambda pkt: pkt.number == 15),
        ConditionalField(ByteField("length_8", 0), _wide),
        ConditionalField(ShortField("length_16", 0), lambda pkt: _wide(pkt) and pkt.length_8 == 254),
        ConditionalField(IntField("length_32", 0), lambda pkt: _wide(pkt) and pkt.length_8 == 255),
        ConditionalField(XStrLenField("value", b"", length_from=_content), lambda pkt: _content(pkt) > 0),
        _Meaning("meaning", "", "s"),
    ]

    def extract_padding(self, s: bytes) -> tuple[bytes, bytes]:
        return b"", s


def _tags_at_most(pkt: Any) -> int:
    return _TAGS_MAX


class Parameters(Packet):
    """The parameters of a service, tag by tag; what is no tag is Raw at the end."""

    name = "Parameters"
    fields_desc: ClassVar[list[Any]] = [
        PacketListField("tags", [], Tag, count_from=_tags_at_most, max_count=_TAGS_MAX + 1)
    ]

    _nodes: tuple[Node, ...] | None = None

    def tree(self) -> tuple[Node, ...] | None:
        """The parameters as BACnet has them, nested and by name, with their octets in this layer; None where no service
        is known."""
        return self._nodes

    def post_dissection(self, pkt: Packet) -> None:
        under = self.underlayer
        service = under.fields.get("service") if under is not None else None
        if under is None or service is None:
            return
        outline, octets = codec.Outline(), b"".join(bytes(tag) for tag in self.tags)
        codec.decode(services.parameters(under.pdu_type, service), octets, outline)
        meanings = outline.tags
        self._nodes = outlined(octets, outline)
        at = 0
        for tag in self.tags:
            if at in meanings and isinstance(tag, Tag):
                tag.meaning = escape(meanings[at].removeprefix(codec.VALUE_ONLY))
            at += len(bytes(tag))


def parameters(pdu_type: int, service: int, values: Mapping[str, Any]) -> Parameters:
    """Parameters of a service from named values, as `codec.encode` takes them.

    Raises LookupError for a service without a layout.
    """
    layout = services.parameters(pdu_type, service)
    if layout is None:
        raise LookupError(f"{services.service_name(pdu_type, service)}: no layout")
    return Parameters(codec.encode(layout, values))
