"""Answers to reads that cannot hold what was asked for: how many characters an attribute has is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from dissectors.findings import Tally
from dissectors.n2.commands import parse_command
from dissectors.n2.objects import holds_current_value

READ = "read-attribute"
READ_LENGTH = 12
"""Octets of a read, `>` to CR."""

FRAMED = 4
"""Octets of an acknowledge that holds data, beside them: `A`, checksum, CR. One that holds none has no checksum."""

Attribute = tuple[int, int]
"""Region, attribute."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What a read asks for: the attribute, and the characters that its value may have, ascending."""

    attribute: Attribute
    widths: tuple[int, ...]


@lru_cache(maxsize=4096)
def asked_for(command: bytes) -> Asked | None:
    """What a good read asks for; None of other commands, and of attributes of unknown layout."""
    if len(command) != READ_LENGTH:
        return None
    told = parse_command(command)
    encoding = told.encoding
    if told.type.kind != READ or encoding is None or told.region is None or told.attribute is None:
        return None
    more = (encoding.width + 2,) if holds_current_value(told.region, told.attribute) else ()
    return Asked((told.region, told.attribute), (encoding.width, *more))


def width_of(length: int) -> int:
    """Characters of data in an acknowledge of so many octets."""
    return max(0, length - FRAMED)


@dataclass(slots=True)
class Misfits:
    """What a station answered to reads of known attributes. `reads`: how many it acknowledged; `fitting`: attributes
    that it gave at their length; `empty`: acknowledges without a value; `odd`: those of another length, by attribute.

    An acknowledge names neither station nor object. One behind a command that nothing followed may be that one's, late,
    and is not counted.
    """

    reads: int = 0
    fitting: set[Attribute] = field(default_factory=set)
    empty: Tally = field(default_factory=Tally)
    odd: dict[Attribute, Tally] = field(default_factory=dict)

    def see_fitting(self, asked: Asked, count: int) -> None:
        """Take acknowledges that hold a value as it is known."""
        self.reads += count
        if count:
            self.fitting.add(asked.attribute)

    def see(self, asked: Asked, length: int, time: int, rows: Sequence[int | None]) -> None:
        """Take an acknowledge of a read: its octets, when it closed, and the rows of both."""
        width = width_of(length)
        if width in asked.widths:
            self.see_fitting(asked, 1)
            return
        self.reads += 1
        (self.odd.setdefault(asked.attribute, Tally()) if width else self.empty).add(time, *rows)
