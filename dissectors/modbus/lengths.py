"""Lengths of frames, told by their first octets: a function for each message of the layout.

Lengths count the whole RTU frame, address … CRC:  [unit][function][data …][CRC lo][CRC hi]
                                         offset:    0     1          2 …
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from dissectors.modbus.notation import (
    CHECK,
    HEAD,
    Counted,
    FieldPlace,
    Means,
    Message,
    counted,
    first,
    fixed_length,
    octets_of,
    places,
)

MIN_FRAME: Final = 4
MAX_FRAME: Final = 256
"""Octets of the shortest and longest RTU frame (Modbus over Serial Line V1.02, 2.5.1)."""

MORE: Final = 0
NEVER: Final = -1
"""Answers of a `Length` beside a number of octets: more octets are needed to tell; no such frame begins so."""

Octets = bytes | bytearray

Length = Callable[[Octets, int, int], int]
"""(octets, start, end) → octets of the frame that begins at `start`, or MORE, or NEVER; reads only [start, end)."""


def length_of(message: Message) -> Length:
    """What tells the length of a message."""
    total = fixed_length(message)
    count = counted(message)
    if count is not None:
        at, least = count.count.at, count.count.field.least
        return _counted(at, least) if count.count.field.size == 1 else _long_counted(at, least, most_of(count))
    length = _fixed(total) if total is not None else _walked(message)
    selector = first(message, Means.SELECTOR)
    if selector is None or selector.field.only is None:
        return length
    return _selected(selector.at, selector.field.only, length)


def is_told_by_three(message: Message) -> bool:
    """Whether the first three octets of a message tell its length, whatever they are."""
    count = counted(message)
    if count is not None:
        return count.count.at == HEAD and count.count.field.size == 1
    return fixed_length(message) is not None and first(message, Means.SELECTOR) is None


def most_of(count: Counted) -> int:
    """The most that a byte count may say."""
    among = count.quantity.field.among if count.quantity is not None else None
    return count.beside + octets_of(count.items, max(among)) if among else MAX_FRAME


def _fixed(total: int) -> Length:
    def length(octets: Octets, start: int, end: int) -> int:
        return total

    return length


def _counted(at: int, least: int) -> Length:
    """A byte count at offset `at` counts the octets between itself and the CRC."""

    def length(octets: Octets, start: int, end: int) -> int:
        if start + at >= end:
            return MORE
        count = octets[start + at]
        total = at + 3 + count
        return total if count >= least and total <= MAX_FRAME else NEVER

    return length


def _long_counted(at: int, least: int, most: int) -> Length:
    """The same, counted in two octets."""

    def length(octets: Octets, start: int, end: int) -> int:
        if start + at + 1 >= end:
            return MORE
        count = octets[start + at] << 8 | octets[start + at + 1]
        return at + 4 + count if least <= count <= most else NEVER

    return length


def _selected(at: int, value: int, length: Length) -> Length:
    """Of the one value of a selector whose layout is known."""

    def selected(octets: Octets, start: int, end: int) -> int:
        if start + at >= end:
            return MORE
        return length(octets, start, end) if octets[start + at] == value else NEVER

    return selected


def _walked(message: Message) -> Length:
    """As many groups as an octet says, each a number (never the same twice), a byte count, and what that counts."""
    many, groups = places(message)[-2:]
    at_count, at_groups = many.at, groups.at
    size = _head_of(groups)

    def length(octets: Octets, start: int, end: int) -> int:
        if start + at_count >= end:
            return MORE
        count = octets[start + at_count]
        if at_groups + size * count + CHECK > MAX_FRAME:
            return NEVER
        if start + at_groups + size * count > end:
            return MORE
        at, before = start + at_groups, -1
        for _ in range(count):
            if at + 1 - start > MAX_FRAME:
                return NEVER
            if at + 1 >= end:
                return MORE
            if octets[at] == before:
                return NEVER
            before = octets[at]
            at += size + octets[at + 1]
        total = at + CHECK - start
        return total if total <= MAX_FRAME else NEVER

    return length


def _head_of(groups: FieldPlace) -> int:
    return sum(each.size for each in groups.field.group if not each.is_list)
