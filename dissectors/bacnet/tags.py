"""BACnet tags: octets to a tree of tags and back (ANSI/ASHRAE 135, 20.2.1). Total: hostile lengths end the reading.

    number (4 bits, 15 = next octet) | class (1 bit: context) | length / value / type (3 bits)

Length 0 … 4 inline, 5 = next octet, 254 there = two more, 255 there = four more. In context class 6 opens and 7 closes.
An application Boolean has its value where others have their length.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from dissectors.quick_values import quickly_made

DEPTH_MAX = 16
"""Deepest nesting that is read."""

BOOLEAN = 1


@quickly_made
@dataclass(frozen=True, slots=True)
class Tag:
    """One tag with its content: `octets` of a primitive one, or `children` of a pair of opening and closing tags.

    `start`, `end`: its place in the octets that were read (0 when it was made by hand).
    """

    number: int
    context: bool
    octets: bytes = b""
    children: tuple[Tag, ...] | None = None
    start: int = 0
    end: int = 0

    @property
    def is_open(self) -> bool:
        """Whether it is a pair of opening and closing tags."""
        return self.children is not None


@quickly_made
@dataclass(frozen=True, slots=True)
class Tree:
    """What `read` found: the tags, how many octets they take, and why it ended early (None at the end)."""

    tags: tuple[Tag, ...]
    used: int
    error: str | None = None


@dataclass(slots=True)
class TagHeader:
    """The head of one tag in the octets: `kind` is "primitive", "opening" or "closing"; content in [begin, end)."""

    number: int
    context: bool
    kind: str
    begin: int
    end: int
    value: int = 0  # length / value / type bits


def header_at(octets: bytes, at: int) -> TagHeader | str:
    """The tag at `at`, or why there is none."""
    size = len(octets)
    if at >= size:
        return "no tag"
    first = octets[at]
    at += 1
    number = first >> 4
    if number == 15:
        if at >= size:
            return "cut inside a tag number"
        number = octets[at]
        at += 1
    context, low = bool(first & 8), first & 7
    if context and low >= 6:
        return TagHeader(number, True, "opening" if low == 6 else "closing", at, at, low)
    if not context and number == BOOLEAN:
        if low >= 5:
            return f"value code {low} in a Boolean"
        return TagHeader(number, False, "primitive", at, at, low)
    length = low
    if low == 5:
        wide = octets[at] if at < size else -1
        width = 4 if wide == 255 else 2 if wide == 254 else 0
        if wide < 0 or at + 1 + width > size:
            return "cut inside a tag length"
        length = int.from_bytes(octets[at + 1 : at + 1 + width], "big") if width else wide
        at += 1 + width
    elif low > 5:
        return f"length code {low} in an application tag"
    if at + length > size:
        return f"a tag of {length} octets, {size - at} left"
    return TagHeader(number, context, "primitive", at, at + length, low)


def read(octets: bytes, begin: int = 0) -> Tree:
    """All tags from `begin` on. What cannot be read ends it, with the tags so far and the reason; never raises."""
    stack: list[tuple[int, int, list[Tag]]] = []
    level: list[Tag] = []
    at, error = begin, None
    while at < len(octets):
        header = header_at(octets, at)
        if isinstance(header, str):
            error = header
            break
        if header.kind == "opening":
            if len(stack) >= DEPTH_MAX:
                error = f"nested deeper than {DEPTH_MAX}"
                break
            stack.append((header.number, at, level))
            level = []
        elif header.kind == "closing":
            if not stack or stack[-1][0] != header.number:
                error = f"closing tag {header.number} without its opening tag"
                break
            number, start, outer = stack.pop()
            outer.append(Tag(number, True, b"", tuple(level), start, header.end))
            level = outer
        else:
            content = octets[header.begin : header.end]
            if not header.context and header.number == BOOLEAN:
                content = bytes((header.value,))
            level.append(Tag(header.number, header.context, content, None, at, header.end))
        at = header.end
    if error is None and stack:
        error = f"opening tag {stack[-1][0]} is never closed"
    used = at
    while stack:  # what is open stays readable
        number, start, outer = stack.pop()
        used = start
        outer.append(Tag(number, True, b"", tuple(level), start, at))
        level = outer
    return Tree(tuple(level), used, error)


def write(tags: tuple[Tag, ...] | list[Tag]) -> bytes:
    """The octets of tags, each length in its shortest form."""
    return b"".join(_write(tag) for tag in tags)


def head(number: int, context: bool, length: int) -> bytes:
    """The octets in front of a primitive tag's content."""
    first = (8 if context else 0) | (length if length < 5 else 5)
    out = bytes((number << 4 | first,)) if number < 15 else bytes((0xF0 | first, number))
    if length < 5:
        return out
    if length < 254:
        return out + bytes((length,))
    return out + (b"\xfe" + struct.pack(">H", length) if length < 65536 else b"\xff" + struct.pack(">I", length))


def _write(tag: Tag) -> bytes:
    if tag.children is not None:
        inner = write(tag.children)
        if tag.number < 15:
            return bytes((tag.number << 4 | 14,)) + inner + bytes((tag.number << 4 | 15,))
        return bytes((0xFE, tag.number)) + inner + bytes((0xFF, tag.number))
    if not tag.context and tag.number == BOOLEAN and len(tag.octets) == 1 and tag.octets[0] < 5:
        return bytes((BOOLEAN << 4 | tag.octets[0],))
    return head(tag.number, tag.context, len(tag.octets)) + tag.octets
