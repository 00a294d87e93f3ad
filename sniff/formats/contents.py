"""Kind of a file without magic octets at its begin: text, a text capture, octets as they were heard. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import islice

from sniff.formats.text_line import MAGIC

_LINES_SEEN = 200
_OURS = re.compile(r"[+~-][0-9]{1,15}(\.[0-9]{1,6})?\s+([0-9A-Fa-f]{2}([\s!]|[0-9A-Fa-f]{2}|$)|\")")
"""How a line of a text capture begins; no line of a byte log does."""

_NUMBERED = re.compile(r"#\d+\b.*\b[0-9A-Fa-f]{2} [0-9A-Fa-f]{2}\b|(?:#\d{1,3}){4}")
"""A frame with its number, or of numbers of characters, which is no comment."""

_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_WRITTEN = frozenset((*range(0x20, 0x7F), *b"\t\n\r\f\x1b", *range(0x80, 0x100)))
_HIGH = bytes(range(0x80, 0x100))
"""Octets that text is made of, in any code that ASCII is part of; escapes colour the output of tools."""

_WINDOW = re.compile(rb"\x1b\][0-9]{1,3};[^\x00-\x1f]{0,400}(?:\x07|\x1b\\)")

_CONTROLS_MOST = 0.01
_DUMPED_LEAST, _DIGITS = 64, b"0123456789ABCDEFabcdefx ,;:-\t"
_UTF16_LEAST, _UTF16_ZEROS = 16, 0.9
_ASCII_FRAME = re.compile(rb":((?:[0-9A-F]{2}){3,260})(?=[\r\n]|$)")
_N2_FRAME = re.compile(rb"[>A]([0-9A-F]{2,260})([0-9A-F]{2})(?=[\r\n]|$)")
PUTTY = re.compile(rb"=~=~=~=~=~=~=~=~=~=~=~= PuTTY log [ -~]{0,40} =~=~=~=~=~=~=~=~=~=~=~=\r?\n")
"""The heading that PuTTY writes above what a port gave."""


def is_text_capture(start: bytes) -> bool:
    """Whether the first line that is no comment is one of a text capture; so are comments alone."""
    if (codec := utf16_of(start)) is not None:  # the reader says how to save it
        start = start.decode(codec, "replace").encode("utf-8", "replace")
    return bool(start) and is_written(start) and _first_line_is_ours(start.splitlines())


def _first_line_is_ours(lines: Iterable[bytes]) -> bool:
    for octets in islice(lines, _LINES_SEEN):
        line = octets.decode("utf-8", "replace").removeprefix("\ufeff").strip()
        if line.startswith(MAGIC) or _OURS.match(line):
            return True
        if (line and not line.startswith("#")) or _NUMBERED.match(line):
            return False
    return True


def is_text(start: bytes) -> bool:
    """Whether it is text that a tool or a person wrote."""
    return bool(start) and (is_utf16(start) or (is_written(start) and not _is_ascii_traffic(start)))


def is_raw(start: bytes) -> bool:
    """Whether it is octets as they were heard: no text, or frames of characters with nothing beside them."""
    return bool(start) and not is_utf16(start) and (not is_written(start) or _is_ascii_traffic(start))


def is_utf16(start: bytes) -> bool:
    """Whether it is text of two octets a character, as Windows saves it: every other octet of it is 0, nearly."""
    return utf16_of(start) is not None


def utf16_of(start: bytes) -> str | None:
    """The codec of such text: "utf-16" where it says its order itself; None where it is none."""
    tail = start[2:4096]
    if start.startswith(_UTF16):
        return "utf-16" if 3 * tail.count(0) >= len(tail) else None
    seen = start[:4096]
    for first, codec in ((1, "utf-16-le"), (0, "utf-16-be")):
        zeros, others = seen[first::2], seen[1 - first :: 2]
        if len(seen) < _UTF16_LEAST or zeros.count(0) < _UTF16_ZEROS * len(zeros) or 0 in others:
            continue
        if all(octet in _WRITTEN for octet in others) and (b"\n" in others or b"\r" in others or _is_dumped(others)):
            return codec
    return None


def _is_dumped(others: bytes) -> bool:
    """Whether a text that begins with so long a line is nothing but digits, and what stands between them."""
    return len(others) >= _DUMPED_LEAST and not others.translate(None, delete=_DIGITS)


def is_written(start: bytes) -> bool:
    """Whether nearly all octets are those of text, or name the window of a terminal, whose output was kept."""
    start = _WINDOW.sub(b"", start)
    others = start.translate(None, delete=bytes(_WRITTEN))
    low = start[:4096].translate(None, delete=_HIGH)
    return len(others) <= _CONTROLS_MOST * len(start) and 2 * len(low) >= len(start[:4096])


def _is_ascii_traffic(start: bytes) -> bool:
    """Whether lines are frames of characters that end with their sum, and hardly anything else is there."""
    body = PUTTY.sub(b"", start)
    frames = [(match, sum(bytes.fromhex(match[1].decode())) % 256 == 0) for match in _ASCII_FRAME.finditer(body)]
    frames += [(match, sum(match[1]) % 256 == int(match[2], 16)) for match in _N2_FRAME.finditer(body)]
    labelled = sum(body[match.start() - 1 : match.start()] not in (b"", b"\r", b"\n") for match, _ in frames)
    if not any(fits for _, fits in frames) or 2 * labelled > len(frames):
        return False
    return 2 * sum(len(match[0]) for match, _ in frames) >= len(body)
