"""A scapy packet as a tree of fields, each with the octets of the frame that it was read from.

scapy keeps no positions. They are found by building the packet again field by field, as scapy itself does, and
comparing with the frame: where both agree the span is right; from the first difference in a layer on nothing is
claimed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from dissectors.frame import Frame, Role
from dissectors.manifest import Dissector
from dissectors.meaning import Node
from sniff.analysis.sanitizing import sanitized

DEEPEST = 20
"""Layers and nested packets deeper than this are not shown; no honest frame has them."""

CHECK = re.compile("crc|lrc|checksum|preamble")
"""Fields that nobody reads as a number."""
CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
HEX_PAIRS = re.compile(rb"(?:[0-9A-Fa-f]{2}){2,}")


@dataclass(frozen=True, slots=True)
class Field:
    """One line of the tree. `begin`, `end`: octets of the frame, end exclusive; None where nobody can tell. `brief`:
    its name where there is no room for all of it, empty where there is no other. `folded`: whether what it holds is
    hidden at first, for it says the most itself."""

    name: str
    value: str = ""
    begin: int | None = None
    end: int | None = None
    children: tuple[Field, ...] = ()
    brief: str = ""
    folded: bool = False

    def __contains__(self, offset: object) -> bool:
        return (
            self.begin is not None
            and self.end is not None
            and isinstance(offset, int)
            and self.begin <= offset < self.end
        )


def moved(field: Field, by: int) -> Field:
    """A field of octets that begin so many octets later; where that is negative, nobody can tell where."""
    begin, end = field.begin, field.end
    if begin is not None and end is not None:
        begin, end = (None, None) if by < 0 else (begin + by, end + by)
    return replace(field, begin=begin, end=end, children=tuple(moved(child, by) for child in field.children))


def fields_of(dissector: Dissector, frame: Frame, role: Role) -> tuple[Field, ...]:
    """The layers of a frame; the dissector's flat fields, without spans, where its packet fails. Never raises."""
    try:
        packet = dissector.packet(frame, role)
        found = tuple(_layers(packet, frame.octets, 0, len(frame.octets), 0))
        pairs = HEX_PAIRS.search(frame.octets)
        if pairs is None or any(_placed(field) for field in found):
            return found
        octets = bytes.fromhex(pairs[0].decode("ascii"))
        return _spelled(tuple(_layers(packet, octets, 0, len(octets), 0)), pairs.start())
    except Exception as error:  # a dissector from anywhere meets octets from anywhere
        return (Field("packet", sanitized(f"not readable as a packet: {error}")), *_flat(dissector, frame, role))


def _placed(field: Field) -> bool:
    return field.begin is not None or any(_placed(child) for child in field.children)


def _spelled(fields: tuple[Field, ...], shift: int) -> tuple[Field, ...]:
    """The same for a packet that was read from octets written as pairs of hex digits."""
    return tuple(
        replace(
            field,
            begin=None if field.begin is None else shift + 2 * field.begin,
            end=None if field.end is None else shift + 2 * field.end,
            children=_spelled(field.children, shift),
        )
        for field in fields
    )


def _flat(dissector: Dissector, frame: Frame, role: Role) -> tuple[Field, ...]:
    try:
        return tuple(Field(sanitized(name), sanitized(value)) for name, value in dissector.fields(frame, role).items())
    except Exception as error:  # the same
        return (Field("fields", sanitized(f"not readable: {error}")),)


def _layers(packet: Any, octets: bytes, begin: int, end: int, depth: int) -> Iterator[Field]:
    """Every layer of a packet, the outermost first; each holds only its own fields."""
    layer = packet
    while getattr(layer, "fields_desc", None) and depth < DEEPEST:
        walk = _Walk(layer, octets, begin, end, depth)
        fields = tuple(walk.fields())
        own = getattr(type(layer), "tree", None)
        nodes = own(layer) if own is not None else None
        if nodes is not None:  # the protocol has a better one than field by field
            fields = tuple(_of_node(node, None if walk.lost else begin) for node in nodes)
        yield Field(sanitized(layer.name), "", *_cover(fields), fields)
        begin, end = walk.begin, walk.end
        layer = layer.payload
        depth += 1


def _of_node(node: Node, shift: int | None) -> Field:
    known = shift is not None and node.begin is not None and node.end is not None
    begin, end = (shift + node.begin, shift + node.end) if known else (None, None)  # type: ignore[operator]  # known
    children = tuple(_of_node(child, shift) for child in node.children)
    return Field(sanitized(node.name), sanitized(node.text), begin, end, children)


def _cover(fields: tuple[Field, ...]) -> tuple[int | None, int | None]:
    begins = [field.begin for field in fields if field.begin is not None]
    ends = [field.end for field in fields if field.end is not None]
    return min(begins, default=None), max(ends, default=None)


class _Walk:
    """Goes through the fields of one layer; `begin`, `end` close in on what is left for its payload."""

    def __init__(self, layer: Any, octets: bytes, begin: int, end: int, depth: int) -> None:
        self.layer = layer
        self.octets = octets
        self.begin = begin
        self.end = end
        self.depth = depth
        self.lost = False  # a field was built that is not what the frame has there

    def fields(self) -> Iterator[Field]:
        start = self.begin
        built: Any = b""  # bytes, or (bytes, bits, value) inside a run of bit fields
        for description in self.layer.fields_desc:
            description = _present(description, self.layer)
            if description is None:
                continue
            value = self.layer.getfieldval(description.name)
            if hasattr(description, "fld") and "Trailer" in "".join(
                base.__name__ for base in type(description).__mro__
            ):
                if value is not None:  # absent in this frame
                    yield self._trailer(description, value)
                continue
            before = built
            built = description.addfield(self.layer, built, value)
            first = start + len(_whole(before))
            last = start + len(_whole(built)) + isinstance(built, tuple)
            if isinstance(before, bytes) and isinstance(built, bytes):
                self._compare(built[len(before) :], first, last)
            self.begin = start + len(_whole(built))
            yield self._field(description, value, first, last)

    def _compare(self, built: bytes, first: int, last: int) -> None:
        if self.octets[first:last] != built or last > self.end:
            self.lost = True

    def _trailer(self, description: Any, value: Any) -> Field:
        built = description.fld.addfield(self.layer, b"", value)
        first, last = self.end - len(built), self.end
        self.end = first
        known = self.octets[first:last] == built
        span = (first, last) if known else (None, None)
        return Field(field_name(description.name), _text(description, self.layer, value), *span)

    def _field(self, description: Any, value: Any, first: int, last: int) -> Field:
        span = (None, None) if self.lost or first == last else (first, last)
        name = field_name(description.name)
        packets = [item for item in (value if isinstance(value, list) else [value]) if hasattr(item, "fields_desc")]
        if packets:
            aside = self.lost or first == last  # what is not in the octets of this frame has no place there
            children: list[Field] = []
            for packet in packets:
                size = len(bytes(packet))
                inner = tuple(_layers(packet, self.octets, first, first + size, self.depth + 1))
                children.extend(_without_spans(inner) if aside else inner)
                first += size
            return Field(name, "", span[0], span[1], tuple(children))
        if isinstance(value, list) and hasattr(description, "field"):
            return Field(name, str(len(value)), span[0], span[1], tuple(self._items(description.field, value, first)))
        return Field(name, _text(description, self.layer, value), *span)

    def _items(self, description: Any, values: list[Any], first: int) -> Iterator[Field]:
        for position, value in enumerate(values):
            size = len(description.addfield(self.layer, b"", value))
            span = (None, None) if self.lost else (first, first + size)
            yield Field(f"[{position}]", _text(description, self.layer, value), *span)
            first += size


def _present(description: Any, layer: Any) -> Any:
    """The field behind a condition, None when the condition says that it is not there."""
    while hasattr(description, "cond"):
        if not description._evalcond(layer):
            return None
        description = description.fld
    return description


def _whole(built: Any) -> bytes:
    return built if isinstance(built, bytes) else built[0]


def _text(description: Any, layer: Any, value: Any) -> str:
    if isinstance(value, bytes) and type(description).i2repr.__module__.startswith("scapy."):
        return octets_text(value)
    try:
        shown = sanitized(description.i2repr(layer, value))
        plain_hex = isinstance(value, int) and shown.startswith("0x") and not CHECK.search(description.name)
        return f"{value} ({shown})" if plain_hex and value > 9 else shown
    except Exception:  # scapy's fields raise at will on values that they did not expect
        return sanitized(repr(value))


def field_name(name: str) -> str:
    """A field of scapy's or ours as words: "startAddr" and "start_addr" both become "start addr"."""
    return sanitized(CAMEL.sub(" ", name).replace("_", " ").lower())


def octets_text(octets: bytes) -> str:
    """Octets for a reader: quoted where all are printable ASCII, else as pairs of hex digits."""
    if octets and all(0x20 <= octet < 0x7F for octet in octets):
        return f'"{octets.decode("ascii")}"'
    return octets.hex(" ").upper()


def _without_spans(fields: tuple[Field, ...]) -> tuple[Field, ...]:
    return tuple(replace(field, begin=None, end=None, children=_without_spans(field.children)) for field in fields)
