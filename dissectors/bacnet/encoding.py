"""Named values → tags → octets, by the parameter tables; codec.py reads them back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from dissectors.bacnet import layout as notation
from dissectors.bacnet import tags as tagging
from dissectors.bacnet.layout import LayoutField
from dissectors.bacnet.tags import Tag
from dissectors.bacnet.values import NUMBER_OF, ConstructedValue, base, pack, type_of


def encode(layout: str, values: Mapping[str, Any] | ConstructedValue) -> bytes:
    """The octets of parameters by a layout.

    Values are what `decode` gives, or plain Python ones: names for enumerations, "device,1" for objects, mappings for
    sequences, a mapping of one for a choice. Raises ValueError, KeyError or TypeError when they do not fit.
    """
    return tagging.write(_encode_sequence(notation.parse(layout), values))


def _encode_sequence(fields: Sequence[LayoutField], values: Mapping[str, Any] | ConstructedValue) -> list[Tag]:
    given = dict(values.entries) if isinstance(values, ConstructedValue) else dict(values)
    tags: list[Tag] = []
    for field in fields:
        if field.name not in given:
            if field.optional:
                continue
            raise KeyError(f"{field.name} is missing")
        tags += _encode_field(field, given.pop(field.name))
    if given:
        raise KeyError(f"no such parameter: {', '.join(sorted(given))}")
    return tags


def _encode_field(field: LayoutField, value: Any) -> list[Tag]:
    if field.tag is None:
        return _encode_in_place(field.type, value)
    if base(field.type) is not None:
        return [Tag(field.tag, True, pack(field.type, value))]
    return [Tag(field.tag, True, b"", tuple(_encode_in_place(field.type, value)))]


def _encode_in_place(type_name: str, value: Any) -> list[Tag]:
    if type_name in notation.ANYTHING:
        return encode_any(value)
    if type_name.startswith("{"):
        return [tag for item in value for tag in _encode_in_place(type_name[1:-1], item)]
    kind = base(type_name)
    if kind is not None:
        return [Tag(NUMBER_OF[kind], False, pack(type_name, value))]
    alternatives = notation.choice(type_name)
    if alternatives is not None:
        ((name, chosen),) = dict(value.entries if isinstance(value, ConstructedValue) else value).items()
        for field in alternatives:
            if field.name == name:
                return _encode_field(field, chosen)
        raise KeyError(f"{type_name} has no alternative {name}")
    fields = notation.sequence(type_name)
    if fields is None:
        raise ValueError(f"{type_name} is not known")
    return _encode_sequence(fields, value)


def encode_any(value: Any) -> list[Tag]:
    """The tags of any value: a plain one, a Record of a known type, tags, or several of them."""
    if isinstance(value, Tag):
        return [value]
    if isinstance(value, ConstructedValue):
        if value.type is None:
            raise ValueError("a record without a type has no layout")
        return _encode_in_place(value.type, value)
    if isinstance(value, (tuple, list)):
        return [tag for item in value for tag in encode_any(item)]
    kind = type_of(value)
    return [Tag(NUMBER_OF[kind], False, pack(kind, value))]
