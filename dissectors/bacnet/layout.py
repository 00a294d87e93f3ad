"""The notation of the parameter tables, and what it means.

    "[0] object-identifier ObjectIdentifier, [2]? array-index Unsigned, [3] value Any, ? count Unsigned, items {Item}"

[n] context tag n (none: application tag, or the parts of the type follow in place) · ? may be absent · {X} list of X ·
Any: whatever the property holds, to the end · AnyPrimitive: one application tag of any type · AnyApplication: all
application tags to the next context tag. A type is an application type, an enumeration, a bit string, a sequence or a
choice.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from dissectors.bacnet.choices import CHOICES
from dissectors.bacnet.sequences import SEQUENCES
from dissectors.bacnet.values import base

_FIELD = re.compile(r"(?:\[(?P<tag>\d+)\])?(?P<optional>\?)?\s*(?P<name>[a-z0-9-]+) (?P<type>\{?[A-Za-z0-9]+\}?)")

ANYTHING = frozenset({"Any", "AnyPrimitive", "AnyApplication"})
"""Types of values that may be of any type."""


@dataclass(frozen=True, slots=True)
class LayoutField:
    """One parameter of a sequence, or one alternative of a choice."""

    name: str
    type: str
    tag: int | None
    optional: bool

    @property
    def item(self) -> str | None:
        """The type of the items when it is a list."""
        return self.type[1:-1] if self.type.startswith("{") else None


@cache
def parse(layout: str) -> tuple[LayoutField, ...]:
    """The fields of a layout. Raises ValueError when it is not in the notation."""
    fields = []
    for part in layout.split(", ") if layout else ():
        match = _FIELD.fullmatch(part.strip())
        if match is None:
            raise ValueError(f"layout {part!r}: expected [TAG]? NAME TYPE")
        tag = match["tag"]
        fields.append(
            LayoutField(match["name"], match["type"], None if tag is None else int(tag), bool(match["optional"]))
        )
    return tuple(fields)


def sequence(type_name: str) -> tuple[LayoutField, ...] | None:
    """The fields of a sequence type, None for other types."""
    layout = SEQUENCES.get(type_name)
    return None if layout is None else parse(layout)


def choice(type_name: str) -> tuple[LayoutField, ...] | None:
    """The alternatives of a choice type, None for other types."""
    layout = CHOICES.get(type_name)
    return None if layout is None else parse(layout)


def exists(type_name: str) -> bool:
    """Whether the tables know the type."""
    bare = type_name[1:-1] if type_name.startswith("{") else type_name
    return bare in ANYTHING or base(bare) is not None or bare in SEQUENCES or bare in CHOICES
