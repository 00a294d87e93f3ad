"""The parameters of a service as a tree that speaks BACnet: objects, in them properties, in them values; by name.

analog-value 1
  object-identifier: analog-value,1
  list-of-results
    present-value: 100 hertz
      property-identifier: present-value (85)
      property-value: 100
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from dissectors.bacnet import tags as tagging
from dissectors.bacnet.codec import VALUE_ONLY, Outline, plain
from dissectors.bacnet.tags import Tag
from dissectors.bacnet.values import ConstructedValue, Enumerated, ObjectId, escape, show, show_held, show_tag
from dissectors.meaning import Node

_UNITS, _PRESENT = 117, 85
_FIRST = "[1]"
"""Of several that have no name: BACnet counts from 1."""

_LONGEST = 200
"""Characters of a value in a line of the tree."""


def outlined(octets: bytes, outline: Outline) -> tuple[Node, ...]:
    """The tree of parameters, `outline` as `codec.decode` filled it. Total."""
    tree = tagging.read(octets)
    nodes = _nodes(tree.tags, outline, 0)
    if tree.used < len(octets):
        words = f"{tree.error or 'no tags'}: {octets[tree.used : tree.used + 32].hex(' ').upper()}"
        nodes.append(Node("not readable", words, tree.used, len(octets)))
    about = _about(nodes)
    return (Node(*about, nodes[0].begin, nodes[-1].end, tuple(nodes)),) if about is not None else tuple(nodes)


def _nodes(tags: Sequence[Tag], outline: Outline, depth: int, units: str = "", within: int | None = None) -> list[Node]:
    """One node a tag; tags that make one record stand below a node of their own. `within`: the end of the record whose
    tags these are, None where they are all of a bracket."""
    found: list[Node] = []
    places = {tag.end: place for place, tag in enumerate(tags)}
    at = 0
    while at < len(tags):
        begin = tags[at].start
        ends = [end for end in outline.groups.get(begin, {}) if places.get(end, -1) > at and (at or end != within)]
        if not ends or depth > tagging.DEPTH_MAX:
            index = outline.elements.get(begin) if at or within is None else None  # else that of the whole record
            found.append(_tag(tags[at], outline, depth, units, len(found) + 1, index))
            at += 1
            continue
        end, last = max(ends), places[max(ends)] + 1
        record = outline.groups[begin][end]
        below = _nodes(tags[at:last], outline, depth + 1, _units(record) or units, end)
        name, text = _record(record, units)
        number = outline.elements.get(begin, 0 if name else len(found) + 1)
        name = f"[{number}] {name or _words(record.type or 'record')}" if number else name
        found.append(Node(name, text, begin, end, tuple(below)))
        at = last
    return found


def _tag(tag: Tag, outline: Outline, depth: int, units: str, place: int, index: int | None) -> Node:
    said = outline.tags.get(tag.start, "")
    name, _, text = ("", "", said.removeprefix(VALUE_ONLY)) if said.startswith(VALUE_ONLY) else said.partition(": ")
    if tag.children is None:
        text = text or show_tag(tag)
        which = name if index is None else f"[{index}] {name}".rstrip()
        return Node(which or f"[{place}]", _short(text), tag.start, tag.end)
    name = name or f"[{tag.number}]"
    name = name if index is None else f"[{index}] {name}"
    children = _nodes(tag.children, outline, depth + 1, units)
    only = children[0] if len(children) == 1 else None
    if only is not None and not only.children and only.name == _FIRST:  # one value in its brackets
        return Node(name, only.text, tag.start, tag.end)
    if only is not None and only.children and only.name.startswith(_FIRST + " "):  # one record in its brackets
        return Node(name, only.text, tag.start, tag.end, only.children)
    count = f"{len(children)} values" if len(children) != 1 and any(c.name == _FIRST for c in children) else ""
    return Node(name, count, tag.start, tag.end, tuple(children))


def _record(record: ConstructedValue, units: str) -> tuple[str, str]:
    """What a record is about: an object, a property with its value; no name where it is about neither."""
    thing = next((value for _, value in record if isinstance(value, ObjectId)), None)
    which = record.get("property-identifier")
    if which is not None:
        name, value = _reference(record), _value_of(record)
        text = "" if value is None else value
        return name, _short(f"{text} {units}" if units and text and which.value == _PRESENT else text)
    if thing is not None:
        return str(thing).replace(",", " "), ""
    return "", _short(show(record))


def _about(nodes: Sequence[Node]) -> tuple[str, str] | None:
    """Object and property of a message about one, with the value that it has."""
    told = {node.name: node for node in nodes}
    thing, which = told.get("object-identifier"), told.get("property-identifier")
    if thing is None or which is None:
        return None
    index = told.get("property-array-index")
    name = f"{thing.text.replace(',', ' ')} {which.text.rpartition(' (')[0] or which.text}"
    name += f"[{index.text}]" if index is not None else ""
    value = told.get("property-value")
    return name, value.text if value is not None else ""


def _reference(record: ConstructedValue) -> str:
    index = record.get("property-array-index")
    return f"{record['property-identifier']}" + (f"[{index}]" if index is not None else "")


def _value_of(record: ConstructedValue) -> str | None:
    result = record.get("read-result")
    if isinstance(result, ConstructedValue):
        ((kind, value),) = result.entries
        if kind == "property-access-error" and isinstance(value, ConstructedValue):
            return "error: " + " ".join(str(part) for _, part in value)
        return _held(record, value)
    for name in ("property-value", "value"):
        if name in record:
            return _held(record, record[name])
    return None


def _held(record: ConstructedValue, value: object) -> str:
    held = plain(value) if isinstance(value, Tag) else value
    return show_held(record["property-identifier"].value, record.get("property-array-index"), held)


def _units(record: ConstructedValue) -> str:
    """The unit of an object whose properties are told together."""
    results = record.get("list-of-results")
    for item in results if isinstance(results, Iterable) else ():
        which = item.get("property-identifier") if isinstance(item, ConstructedValue) else None
        if isinstance(which, Enumerated) and which.value == _UNITS:
            return _value_of(item) or ""
    return ""


def _words(type_name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", type_name).lower()


def _short(text: str) -> str:
    text = escape(text)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"
