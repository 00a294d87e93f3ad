"""The lines of a text that comes in parts; long ones in pieces, of which none ends within an octet. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from sniff.formats.log_spellings import ESCAPED_STRING

LONGEST = 1 << 13
"""Characters of a line that are looked at; a frame of a field bus is far shorter."""

LONGEST_HELD = 1 << 17
"""Characters of a line of which the end has not come; of a longer one the begin is given."""

LONGEST_ROW = 1 << 20
"""Characters of a row of a table; a longer one is none."""

SPACES = re.compile(r"\s{4,}")
"""Space that says no more than three of it would."""
_LAST_DIGITS = re.compile(r"(?<![0-9A-Fa-f])[0-9A-Fa-f]+\Z")


def rows_in(parts: Iterable[str]) -> Iterator[str]:
    """The lines of a text that comes in parts, whole: rows of a table, whose cells may be long. Bounded."""
    held = ""
    for part in parts:
        *whole, held = (held + part).split("\n")
        for line in whole:
            yield from line.removeprefix("\ufeff").rstrip("\r").split("\r")
        if len(held) > LONGEST_ROW:
            yield held
            held = ""
    if held:
        yield from held.rstrip("\r").split("\r")


def lines_in(parts: Iterable[str]) -> Iterator[str]:
    """The lines of a text that comes in parts, wherever it is cut; long ones in pieces. Bounded."""
    held = ""
    for part in parts:
        *whole, held = (held + part).split("\n")
        for line in whole:
            yield from _pieces_between(line.rstrip("\r"))
        if len(held) > LONGEST_HELD:
            *begun, held = _pieces_between(held)
            yield from begun
    if held:
        yield from _pieces_between(held.rstrip("\r"))


def _pieces_between(line: str) -> Iterator[str]:
    """The pieces of lines that only a carriage return ends."""
    for one in line.split("\r"):
        yield from pieces(one.removeprefix("\ufeff"))


def pieces(text: str) -> Iterator[str]:
    """A line, in pieces that go on in one another where it is longer than is looked at (a whole capture on one)."""
    if text.count("},") >= _OBJECTS and _OBJECT_BEGINS.match(text) is not None:
        for part in _BETWEEN_OBJECTS.split(text):
            yield from pieces(part)
        return
    if len(text) < LONGEST:
        yield text
        return
    string = _STRING.search(text, 0, LONGEST // 2)
    if string is not None:
        yield from _pieces_of_string(text, string)
        return
    text = SPACES.sub("   ", text)
    while len(text) > LONGEST - 2:
        cut = _between_octets(text)
        yield f"{text[:cut]} \\"
        text = text[cut:]
    yield text


def _pieces_of_string(text: str, string: re.Match[str]) -> Iterator[str]:
    """The same of a line with a string of octets that has escapes, each piece a string; without its end it goes on in
    what is still to come."""
    quote, head, held, size = string["q"], text[: string.end()], [], string.end()
    at = string.end()
    for sign in _SIGN.finditer(text, at):
        if sign[0] == quote:
            break
        held.append(sign[0])
        at, size = sign.end(), size + len(sign[0])
        if size > LONGEST - 16:
            yield f"{head}{''.join(held)}{quote} \\"
            head, held, size = f"b{quote}", [], 2
    yield from pieces(f"{head}{''.join(held)}{text[at:]}")


_STRING = re.compile(rf"(?<![0-9A-Za-z_])b?{ESCAPED_STRING}")
_SIGN = re.compile(r"\\x[0-9A-Fa-f]{2}|\\u[0-9A-Fa-f]{4}|\\[0-7]{1,3}|\\[^xu0-7]|[^\\]", re.DOTALL)
"""A character of a string, or an escape that is whole."""


def _between_octets(text: str) -> int:
    """The last place of a long line that is looked at where no octet, however it is written, is cut in two."""
    cut = end = max(text.rfind(" ", LONGEST // 2, LONGEST - 2), text.rfind(",", LONGEST // 2, LONGEST - 2) + 1)
    for _ in range(_TRIED):
        if end <= 0 or _BESIDE.match(text, end) is None:
            break
        end = text.rfind(" ", LONGEST // 2, end)
    else:
        end = cut  # each octet begins so
    if end > 0:
        return end
    opened = _OPENED.search(text, LONGEST - 10, LONGEST - 2)
    if opened is not None:
        return opened.start()
    digits = _LAST_DIGITS.search(text, 0, LONGEST - 2)  # without space, in pairs from where they begin
    begin = digits.start() if digits is not None else 0
    return begin + (LONGEST - 2 - begin) // 2 * 2


_TRIED = 4
_BESIDE = re.compile(r" ?[(/'\[]")
"""What stands beside an octet and says it once more."""
_OPENED = re.compile(
    r"(?:\\[xu]?[0-9A-Fa-f]{0,4}|[\[({][0-9A-Fa-fx]{0,4}|<[0-9A-Za-z]{0,4}|[#$%][0-9A-Fa-f]{0,3}|&[Hh]?[0-9A-Fa-f]{0,2}"
    r"|0[xX][0-9A-Fa-f]{0,2})\Z"
)
"""The begin of an octet that has a sign before its digits."""
_OBJECTS = 3
_OBJECT_BEGINS = re.compile(r"[^{}]{0,200}\[\s*\{")
_BETWEEN_OBJECTS = re.compile(r"(?<=\}),\s*(?=\{)")
"""Between objects of a list that is all on one line."""
