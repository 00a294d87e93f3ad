"""One decoder for all parameter tables: tags → named values. `encode` of encoding.py is the way back.

Decoding is total: what does not fit its layout keeps what was read, says why, and leaves the rest as tags. `Any` is
read with the type of the property that the message names; where that does not fit, by the tags alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as made
from typing import Any

from dissectors.bacnet import layout as notation
from dissectors.bacnet import tags as tagging
from dissectors.bacnet.encoding import encode as encode
from dissectors.bacnet.encoding import encode_any as encode_any
from dissectors.bacnet.layout import LayoutField
from dissectors.bacnet.property_types import BY_OBJECT, PROPERTY_TYPES, VARYING
from dissectors.bacnet.tags import Tag
from dissectors.bacnet.values import (
    APPLICATION,
    NUMBER_OF,
    ConstructedValue,
    Enumerated,
    ObjectId,
    base,
    primitive,
    show,
    show_held,
    show_part,
)
from dissectors.findings import counted

KNOWN_OBJECTS = 63
"""Object types from here on are later than the tables of property types, or a vendor's."""

_DEPTH_MAX = 40  # nested types; the tags themselves are bounded by tags.DEPTH_MAX


@dataclass(frozen=True, slots=True)
class WrongType:
    """The value of a standard property of a standard object that is of another primitive type than the standard's."""

    object: ObjectId
    property: int
    expected: str
    found: str

    def __str__(self) -> str:
        which = Enumerated(self.property, "PropertyIdentifier")
        return f"{self.object} {which} is {self.found}, not {self.expected}"


@dataclass(frozen=True, slots=True)
class Decoded:
    """What a layout made of octets: the values, the tags left over, and why decoding stopped (None: all fitted).

    `wrong`: values of properties that are of another type than they should.
    """

    record: ConstructedValue
    rest: tuple[Tag, ...] = ()
    error: str | None = None
    wrong: tuple[WrongType, ...] = ()


class _Misfit(Exception):
    """The tags are not what the layout says; `entries` were read before."""

    def __init__(self, why: str, entries: Sequence[tuple[str, Any]] = (), at: int = 0) -> None:
        super().__init__(why)
        self.entries = tuple(entries)
        self.at = at


_EMPTY = "empty"
VALUE_ONLY = "= "


@dataclass(slots=True)
class Outline:
    """What the octets of parameters are. `tags`: of each tag "property-identifier: present-value (85)", or its value
    alone after `VALUE_ONLY`, by its place; `groups`: the records that several tags make, by begin and end; `elements`:
    the index of each element of a property that came whole, by where it begins."""

    tags: dict[int, str] = made(default_factory=dict)
    elements: dict[int, int] = made(default_factory=dict)
    groups: dict[int, dict[int, ConstructedValue]] = made(default_factory=dict)


@dataclass(slots=True)
class _Scope:
    """Which property is spoken of: the type of its value follows from it."""

    wrong: list[WrongType]
    object: ObjectId | None = None
    property: int | None = None
    index: int | None = None
    names: Outline | None = None  # for those who ask
    whole: bool = False  # the value of a property, in which a list is all of its elements

    def inner(self) -> _Scope:
        return _Scope(self.wrong, self.object, self.property, self.index, self.names)

    def of_value(self) -> _Scope:
        """Inside a value other properties are spoken of."""
        return _Scope(self.wrong, names=self.names, whole=self.index is None)

    def count(self, tag: Tag, index: int) -> None:
        if self.names is not None and self.whole:
            self.names.elements.setdefault(tag.start, index)

    def group(self, tags: Sequence[Tag], record: ConstructedValue) -> None:
        if self.names is not None and len(tags) > 1:
            self.names.groups.setdefault(tags[0].start, {}).setdefault(tags[-1].end, record)

    def name(self, tag: Tag, text: str) -> None:
        if self.names is not None:
            self.names.tags.setdefault(tag.start, text)

    def name_part(self, tag: Tag, field: LayoutField, value: Any) -> None:
        if self.names is not None:  # a text for each value is dear
            self.name(tag, _named(field, value))

    def name_value(self, tag: Tag, value: Any) -> None:
        if self.names is not None:
            self.name(tag, f"{VALUE_ONLY}{show(value)}")

    def name_held(self, tag: Tag, value: Any) -> None:
        if self.names is not None and self.property is not None:
            self.name(tag, f"{VALUE_ONLY}{show_held(self.property, self.index, value)}")

    def note(self, field: LayoutField, value: Any) -> None:
        if isinstance(value, ObjectId) and field.name != "initiating-device-identifier":
            self.object = value
        elif isinstance(value, Enumerated) and field.type == "PropertyIdentifier":
            self.property, self.index = value.value, None
        elif field.name.endswith("array-index") and isinstance(value, int):
            self.index = value

    def value_type(self) -> str | None:
        if self.property is None:
            return None
        found = PROPERTY_TYPES.get(self.property)
        if self.object is not None and self.property in VARYING:
            found = BY_OBJECT.get((self.object.type, self.property))
        if found is not None and found.startswith("{") and self.index is not None:
            return "Unsigned" if self.index == 0 else found[1:-1]
        return found


def decode(layout: str | None, octets: bytes, names: Outline | None = None) -> Decoded:
    """The parameters in `octets` by a layout (None: tags only). Total.

    `names`, when given, is filled with what each tag is.
    """
    tree = tagging.read(octets)
    if layout is None:
        return Decoded(ConstructedValue(None, ()), tree.tags, tree.error)
    entries: tuple[tuple[str, Any], ...] = ()
    error, at = None, 0
    wrong: list[WrongType] = []
    try:
        found, at = _sequence(notation.parse(layout), tree.tags, 0, _Scope(wrong, names=names), 0)
        entries = tuple(found)
    except _Misfit as misfit:
        entries, at, error = misfit.entries, misfit.at, str(misfit)
    rest = tree.tags[at:]
    if error is None and rest:
        error = f"{counted(len(rest), 'tag')} more than the service has"
    if tree.error is not None:  # what is not there was cut off
        wrong = [one for one in wrong if one.found != _EMPTY]
    return Decoded(ConstructedValue(None, entries), rest, tree.error or error, tuple(wrong))


def _sequence(
    fields: Sequence[LayoutField], tags: Sequence[Tag], at: int, scope: _Scope, depth: int
) -> tuple[list[tuple[str, Any]], int]:
    entries: list[tuple[str, Any]] = []
    for field in fields:
        start = at
        try:
            if not _fits(field, tags, at):
                if field.optional:
                    continue
                raise _Misfit(f"{field.name} is missing{_instead(tags, at)}")
            value, at = _field(field, tags, at, scope, depth)
        except _Misfit as misfit:
            raise _Misfit(str(misfit), entries, start) from None
        scope.note(field, value)
        entries.append((field.name, value))
    return entries, at


def _instead(tags: Sequence[Tag], at: int) -> str:
    """What stands in the place of something that is missing."""
    if at >= len(tags):
        return ""
    tag = tags[at]
    known = not tag.context and tag.number < len(APPLICATION)
    return f", {APPLICATION[tag.number] if known else f'tag [{tag.number}]'} stands there"


def _fits(field: LayoutField, tags: Sequence[Tag], at: int) -> bool:
    if field.tag is None and (field.item is not None or field.type == "Any"):
        return True
    if at >= len(tags):
        return False
    tag = tags[at]
    if field.tag is not None:
        return tag.context and tag.number == field.tag
    if field.type in notation.ANYTHING:
        return not tag.context
    kind = base(field.type)
    if kind is not None:
        return not tag.context and tag.number == NUMBER_OF[kind]
    alternatives = notation.choice(field.type)
    if alternatives is not None:
        return any(_fits(alternative, tags, at) for alternative in alternatives)
    parts = notation.sequence(field.type) or ()
    for part in parts:
        if _fits(part, tags, at):
            return True
        if not part.optional:
            return False
    return not parts


def _field(field: LayoutField, tags: Sequence[Tag], at: int, scope: _Scope, depth: int) -> tuple[Any, int]:
    if depth > _DEPTH_MAX:
        raise _Misfit(f"{field.name} is nested too deep")
    if field.tag is None:
        value, after = _in_place(field.type, tags, at, scope, depth)
        if base(field.type) is not None or (field.type in notation.ANYTHING and after == at + 1):
            scope.name_part(tags[at], field, value)
        return value, after
    tag = tags[at]
    if base(field.type) is not None:
        if tag.children is not None:
            raise _Misfit(f"{field.name} is no primitive value")
        value = _primitive(field.type, tag)
        scope.name_part(tag, field, value)
        return value, at + 1
    if tag.children is None:
        raise _Misfit(f"{field.name} has no opening tag")
    inner = scope.inner()
    scope.name(tag, field.name)
    value, used = _in_place(field.type, tag.children, 0, inner, depth + 1)
    if used != len(tag.children):
        raise _Misfit(f"{field.name} holds more than its type")
    if not field.item:
        scope.property, scope.index = inner.property, inner.index
    return value, at + 1


def _in_place(type_name: str, tags: Sequence[Tag], at: int, scope: _Scope, depth: int) -> tuple[Any, int]:
    """A value of the type whose tags stand at `at`, without a context tag around it."""
    if depth > _DEPTH_MAX:
        raise _Misfit(f"{type_name} is nested too deep")
    if type_name in notation.ANYTHING:
        end = _end_of_anything(type_name, tags, at)
        return _any(tags[at:end], scope, depth), end
    if type_name.startswith("{"):
        item = type_name[1:-1]
        values: list[Any] = []
        while at < len(tags):
            value, after = _in_place(item, tags, at, scope, depth + 1)
            if after == at:
                raise _Misfit(f"{item} has no tags")
            if base(item) is not None:
                scope.name_value(tags[at], value)
            scope.count(tags[at], len(values) + 1)
            values.append(value)
            at = after
        return tuple(values), at
    if base(type_name) is not None:
        return _application(type_name, tags, at), at + 1
    alternatives = notation.choice(type_name)
    if alternatives is not None:
        for field in alternatives:
            if _fits(field, tags, at):
                value, after = _field(field, tags, at, scope, depth + 1)
                return ConstructedValue(type_name, ((field.name, value),)), after
        raise _Misfit(f"no alternative of {type_name} fits")
    fields = notation.sequence(type_name)
    if fields is None:
        raise _Misfit(f"{type_name} is not known")
    try:
        entries, after = _sequence(fields, tags, at, scope, depth + 1)
    except _Misfit as misfit:
        raise _Misfit(str(misfit)) from None
    record = ConstructedValue(type_name, tuple(entries))
    scope.group(tags[at:after], record)
    return record, after


def _end_of_anything(type_name: str, tags: Sequence[Tag], at: int) -> int:
    """Where a value of no certain type ends that begins at `at`."""
    if type_name == "AnyPrimitive":
        return at + 1
    if type_name == "AnyApplication":
        return next((place for place in range(at, len(tags)) if tags[place].context), len(tags))
    return len(tags)


def _named(field: LayoutField, value: Any) -> str:
    """A part with its value, an enumeration with its number too, as Wireshark has it."""
    shown = show_part(field.name, value)
    is_named = isinstance(value, Enumerated) and shown != str(value.value) and not shown.endswith(str(value.value))
    return f"{field.name}: {shown} ({value.value})" if is_named else f"{field.name}: {shown}"


def _application(type_name: str, tags: Sequence[Tag], at: int) -> Any:
    kind = base(type_name)
    if at >= len(tags):
        raise _Misfit(f"{type_name} is missing")
    tag = tags[at]
    if kind is None or tag.context or tag.number != NUMBER_OF[kind]:
        raise _Misfit(f"{type_name} expected")
    return _primitive(type_name, tag)


def _primitive(type_name: str, tag: Tag) -> Any:
    try:
        return primitive(type_name, tag.octets)
    except ValueError as error:
        raise _Misfit(str(error)) from None


def _any(tags: Sequence[Tag], scope: _Scope, depth: int) -> Any:
    """The value of a property: by its type where that fits, else by its tags. One value, or a tuple of several."""
    expected = scope.value_type()
    if expected is not None:
        try:
            value, used = _in_place(expected, tags, 0, scope.of_value(), depth + 1)
            if len(tags) == 1 and base(expected) is not None:
                scope.name_held(tags[0], value)
            if used == len(tags) and (used or expected.startswith("{")):
                return value
        except _Misfit:
            _note_type(expected, tags, scope)
    values = tuple(plain(tag) for tag in tags)
    return values[0] if len(values) == 1 else values


def _note_type(expected: str, tags: Sequence[Tag], scope: _Scope) -> None:
    """Keep that a value is of another type, where that is sure: one value or none in place of a primitive one.

    Null is no value: written, it gives a commanded property up.
    """
    kind, about = base(expected), scope.object
    if kind is None or about is None or about.type >= KNOWN_OBJECTS or scope.property is None or len(tags) > 1:
        return
    if not tags:
        scope.wrong.append(WrongType(about, scope.property, kind, _EMPTY))
        return
    (tag,) = tags
    if tag.context:
        found = f"in a context tag {tag.number}"
    elif tag.number == NUMBER_OF["Null"] or not tag.number < len(APPLICATION):
        return
    else:
        found = APPLICATION[tag.number]
    if found == kind:  # the right type, but no such value
        found = f"{found} of {len(tag.octets)} octets"
    scope.wrong.append(WrongType(about, scope.property, kind, found))
    scope.name(tag, f"{VALUE_ONLY}{found} {show(plain(tag))} (the property is {kind})")


def plain(tag: Tag) -> Any:
    """The value of an application tag; other tags stay tags."""
    if tag.context or tag.number >= len(APPLICATION):
        return tag
    try:
        return primitive(APPLICATION[tag.number], tag.octets)
    except ValueError:
        return tag
